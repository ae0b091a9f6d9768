"""``xb_muscle loop``: a body in MuJoCo, moved by the muscle."""

from __future__ import annotations

import argparse
import functools
import itertools
from collections.abc import Callable

from xb_muscle_ros.cli import common, loop_leg, loop_reflex
from xb_muscle_ros.cli.loop_models import fibres_of, platform_values
from xb_muscle_ros.errors import UserError

_MODELS = ("3state_coop", "hill_se", "hill", "mujoco")
DESCRIPTION = (
    "Step a body in MuJoCo and its muscles in turn: standing on a platform that moves (ankle: one joint; myolegs: two "
    "legs with eighty muscles), or the pendulum test (knee). Writes loop.json, loop.csv and a figure, the same bytes "
    "each time."
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("--scene", choices=tuple(_SCENES), default="ankle", help="what to move (default ankle)")
    common.add_fibre(parser, "18Dec2017a")
    parser.add_argument(
        "--model", dest="models", metavar="MODEL", action="append",
        help=f"parameter set, or mujoco for MuJoCo's own muscle (may be given again; default: {', '.join(_MODELS)}; in "
        f"the scene myolegs {', '.join(loop_leg.MODELS)})",
    )  # fmt: skip
    common.add_out(parser, "folder for loop.json, loop.csv and the figure", required=False)
    parser.add_argument(
        "--duration", type=float, metavar="S", help="length of the run, s (default: ankle 0.5, knee 4, myolegs 2)"
    )
    parser.add_argument(
        "--elastic-tendon", action="store_true", help="tendons stretch (default: rigid, as with a muscle_node)"
    )
    parser.add_argument(
        "--live", action="store_true",
        help="the muscles are fibres of a running muscle_node (mode lockstep; what is missing is said)",
    )  # fmt: skip
    ankle = parser.add_argument_group(
        "platform of the scenes ankle and myolegs (which moves both ways, and by half of it)"
    )
    ankle.add_argument("--displacement", type=float, metavar="M", help="way, m (default -0.075: backwards)")
    ankle.add_argument("--speed", type=float, metavar="M_PER_S", help="speed, m/s (default 0.2)")
    ankle.add_argument("--acceleration", type=float, metavar="M_PER_S2", help="acceleration, m/s² (default 2)")
    loop_leg.add_arguments(parser)
    loop_reflex.add_arguments(parser)


def run(arguments: argparse.Namespace) -> int:
    """Run all models in the scene asked for, print the table, write the files."""
    if arguments.scene != "myolegs":
        loop_leg.refuse(arguments)
    # A node's parameter file has a place of its own.
    if arguments.out is None and arguments.node_parameters is None:
        raise UserError("--out is missing; give a folder for loop.json, loop.csv and the figure")
    return _SCENES[arguments.scene](arguments)


def _run_joint(arguments: argparse.Namespace) -> int:
    """The scenes of one joint."""
    from xb_muscle_ros.files import matching, refuse_older
    from xb_muscle_ros.models.passive import passive_twice_line
    from xb_muscle_ros.plant.figure import draw_loop
    from xb_muscle_ros.plant.loop import DURATION_S, Muscles, in_process, run_ankle, run_knee
    from xb_muscle_ros.plant.plant import Plant
    from xb_muscle_ros.plant.reflex import NO_REFLEX
    from xb_muscle_ros.plant.report import table, write
    from xb_muscle_ros.plant.translation import RampAndHold
    from xb_muscle_ros.progress import Progress

    if arguments.live and (len(arguments.models or ()) != 1 or arguments.models == ["mujoco"]):
        raise UserError("--live is for the one model that the node has; give one --model, and not mujoco")
    # All are written anew by every run: nothing that is stale can stay.
    refuse_older(matching(arguments.out, r"loop\.(json|csv|png|pdf)"), arguments.overwrite)
    scene, elastic = arguments.scene, arguments.elastic_tendon
    duration = DURATION_S[scene] if arguments.duration is None else arguments.duration
    if not 0.01 <= duration <= 60.0:
        raise UserError(f"--duration is {duration:g} s; allowed is 0.01 to 60")
    given = platform_values(arguments)
    if scene == "knee" and given:
        raise UserError("--displacement, --speed and --acceleration are of the scenes ankle and myolegs; drop them")
    platform = RampAndHold(**given)
    reflex = loop_reflex.reflex_of(arguments)
    # Before any model is compiled: is there an engine at all?
    plant = Plant(scene)
    settings: dict[str, object] = {"mujoco": plant.version, "tick_s": plant.tick_s, "duration_s": duration}
    settings["live"] = arguments.live
    settings["tendon"] = "elastic" if elastic else "rigid"
    reflexes = [NO_REFLEX]
    if reflex.works:
        # Each model without it and with it: what it does is the difference.
        settings["reflex"] = vars(reflex)
        reflexes.append(reflex)
    fibres = fibres_of(arguments.fiber, arguments.models, _MODELS)
    muscles: Muscles = in_process
    if arguments.live:
        # The one place where this command touches ROS, and only when asked to.
        from xb_muscle_ros.plant.live import over_ros

        muscles = over_ros()
    if scene == "ankle":
        # The knee's fibre has no parallel element of its own.
        for fibre in filter(None, fibres):
            if said := passive_twice_line(fibre.values):
                common.warn(f"{fibre.model}: {said}")
        settings["platform"] = vars(platform)
        runs = [
            functools.partial(run_ankle, fibre, platform, duration, elastic, muscles, each)
            for fibre, each in itertools.product(fibres, reflexes)
        ]
        way = "backwards" if platform.displacement_m < 0.0 else "forwards"
        title = (
            f"Platform moves {100 * abs(platform.displacement_m):g} cm {way}, {platform.speed_m_per_s:g} m/s, "
            f"{platform.acceleration_m_per_s2:g} m/s²"
        )
    else:
        runs = [
            functools.partial(run_knee, fibre, moved, duration, elastic, muscles, each)
            for moved, fibre, each in itertools.product((False, True), fibres, reflexes)
        ]
        title = "Leg released from level"
    traces = []
    with Progress(len(runs), "loop") as progress:
        for run_one in runs:
            traces.append(run_one())
            progress.update()
    for trace in traces:
        if said := trace.remark:
            common.warn(said)
    print(table(traces))
    how = f"{title}; {settings['tendon']} tendons" + (f"; {reflex.words}" if reflex.works else "")
    draw_loop(arguments.out / "loop.png", traces, how)
    for path in [*write(arguments.out, traces, settings), arguments.out / "loop.png"]:
        print(path)
    return 2 if any(trace.ended for trace in traces) else 0


_SCENES: dict[str, Callable[[argparse.Namespace], int]] = {
    "ankle": _run_joint,
    "knee": _run_joint,
    "myolegs": loop_leg.run,
}
