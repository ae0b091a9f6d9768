"""``xb_muscle loop --scene myolegs``: standing with the eighty muscles of MyoLeg."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

from xb_muscle_ros.cli import common, loop_reflex
from xb_muscle_ros.cli.loop_models import fibres_of, platform_values, values_of
from xb_muscle_ros.errors import UserError

if TYPE_CHECKING:
    from xb_muscle_ros.models.fibre_file import Fibre
    from xb_muscle_ros.plant.leg.body import Body
    from xb_muscle_ros.plant.leg.drives import Drive
    from xb_muscle_ros.plant.leg.stance import Stance
    from xb_muscle_ros.plant.reflex import Reflex

MODELS = ("3state_coop_slack", "hill_se_slack", "hill", "mujoco")
"""Whose series elements do not push: muscles of a leg go slack."""
_SWAY_PERCENT, _SWAY_HZ = (0.0, 1.0, 3.0), (0.5, 1.0)
_AIM = {"lead": "lead_m", "knee": "knee_rad", "tone": "tone"}
_OWN = ("lead", "knee", "tone", "sway", "sway_hz", "csv_step", "node_parameters")
_CSV_STEP_S = 0.005


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of this scene alone."""
    group = parser.add_argument_group("stance of the scene myolegs")
    group.add_argument("--lead", type=float, metavar="M", help="centre of mass before the ankles, m (default 0.05)")
    group.add_argument("--knee", type=float, metavar="RAD", help="flexion of the knees, rad (default 0.087)")
    group.add_argument(
        "--tone", type=float, metavar="SHARE",
        help="least activation of every muscle: more means co-contraction (default 0.02)",
    )  # fmt: skip
    group.add_argument(
        "--sway", type=float, action="append", metavar="PERCENT",
        help="sway before the push by so much soleus fibre length, %% (may be given again; default 0, 1 and 3)",
    )  # fmt: skip
    group.add_argument(
        "--sway-hz", type=float, action="append", metavar="HZ",
        help="its frequency (may be given again; default 0.5 and 1)",
    )  # fmt: skip
    group.add_argument(
        "--csv-step", type=float, metavar="S",
        help="time from one row of loop.csv to the next, s (default 0.005; 0.001: every tick)",
    )  # fmt: skip
    group.add_argument(
        "--node-parameters", type=Path, metavar="FILE",
        help="run nothing; write the parameter file of a muscle_node that has the fibres of the one --model",
    )  # fmt: skip


def refuse(arguments: argparse.Namespace) -> None:
    """Refuse what another scene was given and only this one takes.

    Raises:
        UserError: one of this scene's options.
    """
    given = [f"--{name.replace('_', '-')}" for name in _OWN if getattr(arguments, name) is not None]
    if given:
        raise UserError(f"{', '.join(given)} only with --scene myolegs; drop it, or take that scene")


def run(arguments: argparse.Namespace) -> int:
    """Find the stance, play all episodes of all models, print the tables, write the files."""
    from xb_muscle_ros.files import matching, refuse_older
    from xb_muscle_ros.plant.leg.body import Body
    from xb_muscle_ros.plant.leg.figure import draw_leg
    from xb_muscle_ros.plant.leg.report import beyond_lengths, ended, tables, write
    from xb_muscle_ros.plant.leg.stance import Aim, find_stance
    from xb_muscle_ros.plant.leg.study import count, run_model, sways
    from xb_muscle_ros.plant.reflex import NO_REFLEX, ReflexArc
    from xb_muscle_ros.plant.translation import RampAndHold
    from xb_muscle_ros.progress import Progress

    if arguments.node_parameters is not None:
        return _write_node_parameters(arguments)
    if arguments.live and (len(arguments.models or ()) != 1 or arguments.models == ["mujoco"]):
        raise UserError("--live is for the one model that the node has; give one --model, and not mujoco")
    refuse_older(matching(arguments.out, r"loop\.(json|csv|png|pdf)"), arguments.overwrite)
    duration = 2.0 if arguments.duration is None else arguments.duration
    if not 0.3 <= duration <= 10.0:
        raise UserError(f"--duration is {duration:g} s; allowed in the scene myolegs is 0.3 to 10")
    platform = RampAndHold(**platform_values(arguments))
    aim = Aim(**values_of(arguments, _AIM))
    percent = _SWAY_PERCENT if arguments.sway is None else arguments.sway
    swayed = sways([value / 100.0 for value in percent], arguments.sway_hz or _SWAY_HZ)
    fibres = fibres_of(arguments.fiber, arguments.models, MODELS)
    reflex = loop_reflex.reflex_of(arguments)
    pairs = [(fibre, each) for fibre in fibres for each in ((NO_REFLEX, reflex) if reflex.works else (NO_REFLEX,))]
    body = Body()
    every = _every(arguments.csv_step, body.tick_s)
    # What does not fit is told before anything takes time.
    ReflexArc(reflex, body.muscles, body.tick_s)
    stance = find_stance(body, aim)
    runs = []
    with Progress(len(pairs) * count(swayed), "loop") as progress:
        for fibre, each in pairs:
            try:
                with _drive(arguments, fibre, each) as make:
                    runs.append(run_model(make, stance, platform, swayed, duration, progress.update))
            except UserError as error:
                if len(fibres) == 1:
                    raise
                common.warn(f"{error}; that model is left out")
    if not runs:
        raise UserError("none of the models can stand so; see the warnings, or give --lead, --knee or --tone")
    for line in [*ended(runs), *(f"{one.model}, {line}" for one in runs for line in beyond_lengths(one)[:1])]:
        common.warn(line)
    print(tables(runs))
    settings: dict[str, object] = {
        "mujoco": body.mj.__version__,
        "tick_s": body.tick_s,
        "duration_s": duration,
        "fibre": next((fibre.name for fibre in fibres if fibre is not None), None),
        "tendon": "elastic" if arguments.elastic_tendon else "rigid",
        "live": arguments.live,
        **({"reflex": vars(reflex)} if reflex.works else {}),
    }
    draw_leg(arguments.out / "loop.png", runs)
    for path in [*write(arguments.out, body, stance, runs, settings, every), arguments.out / "loop.png"]:
        print(path)
    return 0


def _every(step_s: float | None, tick_s: float) -> int:
    """Ticks from one row of ``loop.csv`` to the next.

    Raises:
        UserError: not a whole number of them.
    """
    wanted = _CSV_STEP_S if step_s is None else step_s
    if not tick_s <= wanted <= 1.0 or abs(wanted / tick_s - round(wanted / tick_s)) > 1e-6:
        raise UserError(f"--csv-step is {wanted:g} s; allowed are whole ticks of {tick_s:g} s, up to 1 s")
    return round(wanted / tick_s)


def _write_node_parameters(arguments: argparse.Namespace) -> int:
    """Write the file, and print how to use it."""
    from xb_muscle_ros.plant.leg.body import Body
    from xb_muscle_ros.plant.leg.drives import bridged
    from xb_muscle_ros.plant.node_file import write_node_file

    path: Path = arguments.node_parameters
    fibres = [fibre for fibre in fibres_of(arguments.fiber, arguments.models, MODELS[:1]) if fibre is not None]
    if len(fibres) != 1 or len(arguments.models or MODELS[:1]) != 1:
        raise UserError("--node-parameters is for the one model that a node has; give one --model, and not mujoco")
    if path.exists() and not arguments.overwrite:
        raise UserError(f"{path} exists; use --overwrite to replace it, or choose another file")
    muscles = bridged(Body(), fibres[0], arguments.fiber, arguments.elastic_tendon)
    write_node_file(path, muscles.fibres, arguments.fiber, "lockstep")
    print(f"{path}\nmuscle_node --ros-args --params-file {path}  # -p mode:=realtime for another clock")
    return 0


def _drive(
    arguments: argparse.Namespace, fibre: Fibre | None, reflex: Reflex
) -> AbstractContextManager[Callable[[Body, Stance], Drive]]:
    """What makes the muscles, in this process or in a node."""
    from xb_muscle_ros.plant.leg.drives import make_drive

    if not arguments.live:
        return nullcontext(make_drive(fibre, arguments.fiber, arguments.elastic_tendon, reflex))
    # The one place where this scene touches ROS, and only when asked to.
    from xb_muscle_ros.plant.leg.live import live_drive

    return live_drive(fibre, arguments.fiber, arguments.elastic_tendon, reflex)
