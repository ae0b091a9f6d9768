"""``xb_muscle loop``: a body in MuJoCo, moved by the muscle."""

from __future__ import annotations

import argparse
import functools
import itertools
from typing import TYPE_CHECKING

from xb_muscle_ros.cli import common
from xb_muscle_ros.errors import UserError

if TYPE_CHECKING:
    from xb_muscle_ros.models.fibre_file import Fibre
    from xb_muscle_ros.plant.reflex import Reflex

_MODELS = ("3state_coop", "hill_se", "hill", "mujoco")
DESCRIPTION = (
    "Step a body in MuJoCo and its muscles in turn: standing on a platform that moves (ankle), or the pendulum test "
    "(knee). Writes loop.json, loop.csv and a figure, the same bytes each time."
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("--scene", choices=("ankle", "knee"), default="ankle", help="what to move (default ankle)")
    common.add_fibre(parser, "18Dec2017a")
    parser.add_argument(
        "--model", dest="models", metavar="MODEL", action="append",
        help=f"parameter set, or mujoco for MuJoCo's own muscle (may be given again; default: {', '.join(_MODELS)})",
    )  # fmt: skip
    common.add_out(parser, "folder for loop.json, loop.csv and the figure")
    parser.add_argument("--duration", type=float, metavar="S", help="length of the run, s (default: ankle 0.5, knee 4)")
    parser.add_argument(
        "--elastic-tendon", action="store_true", help="tendons stretch (default: rigid, as with a muscle_node)"
    )
    parser.add_argument(
        "--live", action="store_true",
        help="the muscles are fibres of a running muscle_node (mode lockstep; what is missing is said)",
    )  # fmt: skip
    ankle = parser.add_argument_group("platform of the scene ankle")
    ankle.add_argument("--displacement", type=float, metavar="M", help="way, m (default -0.075: backwards)")
    ankle.add_argument("--speed", type=float, metavar="M_PER_S", help="speed, m/s (default 0.2)")
    ankle.add_argument("--acceleration", type=float, metavar="M_PER_S2", help="acceleration, m/s² (default 2)")
    _add_reflex(parser)


_REFLEX = (
    ("length_per_l0", "PER_L0", "excitation (0 to 1) per L0 of stretch since the start"),
    ("velocity_s_per_l0", "S_PER_L0", "excitation per L0/s of lengthening"),
    ("force_per_f0", "PER_F0", "excitation per F0 of force above that of the start"),
    ("delay_s", "S", "from fibre to excitation, whole ticks (default 0.04)"),
    ("length_threshold_l0", "L0", "stretch below which length has no effect (default 0)"),
    ("velocity_threshold_l0_per_s", "L0_PER_S", "velocity below which it has no effect (default 0)"),
)


def _add_reflex(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group("stretch reflex; off unless one of the first three is given")
    for name, unit, meaning in _REFLEX:
        option = f"--reflex-{name.replace('_', '-')}"
        group.add_argument(option, dest=f"reflex_{name}", type=float, metavar=unit, help=meaning)
    group.add_argument(
        "--reflex-muscle", dest="reflex_muscles", metavar="NAME", action="append",
        help="name or pattern of muscles that have it (may be given again; default: all)",
    )  # fmt: skip


def _reflex(arguments: argparse.Namespace) -> Reflex:
    """The reflex asked for; none by default.

    Raises:
        UserError: a number out of range, or a delay without a gain.
    """
    from xb_muscle_ros.plant.reflex import Reflex

    given = {name: getattr(arguments, f"reflex_{name}") for name, _, _ in _REFLEX}
    values = {name: value for name, value in given.items() if value is not None}
    muscles = tuple(arguments.reflex_muscles or ())
    reflex = Reflex(**values, muscles=muscles)
    if (values or muscles) and not reflex.works:
        raise UserError("the reflex has no gain above 0; give --reflex-length-per-l0 or another, or drop the others")
    return reflex


def run(arguments: argparse.Namespace) -> int:
    """Run all models, print the table, write the files."""
    from xb_muscle_ros.files import matching, refuse_older
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
    asked = {
        "displacement_m": arguments.displacement,
        "speed_m_per_s": arguments.speed,
        "acceleration_m_per_s2": arguments.acceleration,
    }
    given = {name: value for name, value in asked.items() if value is not None}
    if scene != "ankle" and given:
        raise UserError("--displacement, --speed and --acceleration are of the scene ankle; drop them")
    platform = RampAndHold(**given)
    reflex = _reflex(arguments)
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
    fibres = _fibres(arguments.fiber, arguments.models)
    muscles: Muscles = in_process
    if arguments.live:
        # The one place where this command touches ROS, and only when asked to.
        from xb_muscle_ros.plant.live import over_ros

        muscles = over_ros()
    if scene == "ankle":
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


def _fibres(name: str, models: list[str] | None) -> list[Fibre | None]:
    """A fibre for each model; None is MuJoCo's muscle. A default that the fibre file has no set for is left out."""
    from xb_muscle_ros.models.fibre_file import load_fibre
    from xb_muscle_ros.plant.drives import OWN

    fibres: list[Fibre | None] = []
    load_fibre(name)  # a fibre that is not there is an error, not a model to leave out
    for model in dict.fromkeys(models or _MODELS):
        if model == OWN:
            fibres.append(None)
            continue
        try:
            fibres.append(load_fibre(name, model))
        except UserError as error:
            if models:
                raise
            common.warn(f"model {model} is left out: {error}")
    return fibres
