"""``xb_muscle bench``: measured times, on screen and in ``bench.json``."""

from __future__ import annotations

import argparse
import re
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from xb_muscle_ros.cli.common import add_fibre, add_overwrite, warn

if TYPE_CHECKING:
    from xb_muscle_ros.cli.common import Subparsers

STUDIES = ("rhs", "trial", "batch", "start", "cost", "fast", "fit", "node", "roundtrip", "many", "soak")


def add(subparsers: Subparsers) -> None:
    """Add the command to the command line."""
    parser = subparsers.add_parser(
        "bench", help="measure how fast models and node are", description="Measure; figures also go to bench.json."
    )
    add_fibre(parser, required=False)
    parser.set_defaults(fiber="18Dec2017a")
    parser.add_argument("--study", nargs="+", choices=STUDIES, default=["rhs", "trial"], help="what to measure")
    parser.add_argument(
        "--duration", type=float, default=60.0, help="of the studies node, roundtrip and many, s (default 60)"
    )
    parser.add_argument("--rate", type=float, help="of those, Hz (default: node 1000, roundtrip and many 500)")
    parser.add_argument(
        "--priority", type=int, default=0, help="realtime_priority of the node in node and many (default 0: ordinary)"
    )
    parser.add_argument("--fibers", type=int, default=100, help="of the study many (default 100)")
    parser.add_argument("--ticks", type=int, default=10_000_000, help="of the study soak (default 10 million)")
    parser.add_argument(
        "--out", type=Path, default=Path("bench.json"), help="file for the figures (default bench.json)"
    )
    add_overwrite(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Measure, print, write."""
    from xb_muscle_ros.bench import right_hand_side, trial_time
    from xb_muscle_ros.bench.measure import Figure, as_text, machine, write
    from xb_muscle_ros.cli.common import fibre_of
    from xb_muscle_ros.files import matching, refuse_older
    from xb_muscle_ros.models.muscle import Muscle
    from xb_muscle_ros.trials.bag_files import remove_results

    older = matching(arguments.out.parent, re.escape(arguments.out.name))
    drawn = [name for study, name in (("cost", "cost"), ("fast", "fast_stretch")) if older or study in arguments.study]
    older += matching(arguments.out.parent, *(rf"{name}\.(png|pdf)" for name in drawn))
    refuse_older(older, arguments.overwrite)
    remove_results(older)
    fibre = fibre_of(arguments)
    made: list[Figure] = []
    if "rhs" in arguments.study or "trial" in arguments.study:
        exact = replace(fibre, values={**fibre.values, "smoothing": 0.0})
        muscles = [Muscle(fibre), Muscle(exact)]
        if "rhs" in arguments.study:
            made += [f for muscle in muscles for f in right_hand_side.figures(muscle)]
        if "trial" in arguments.study:
            made += trial_time.figures(muscles[0])
            made += [replace(f, name=f"{f.name}, exact") for f in trial_time.figures(muscles[1])]
    if "batch" in arguments.study:
        from xb_muscle_ros.bench import batch_time

        made += batch_time.figures()
    if "start" in arguments.study:
        from xb_muscle_ros.bench import start_time

        made += start_time.figures()
    if "cost" in arguments.study:
        from xb_muscle_ros.bench import cost

        points = list(cost.Study(fibre).points())
        made += cost.figures(points)
        cost.draw(points, arguments.out.with_name("cost.png"))
        print(arguments.out.with_name("cost.png"))
    if "fast" in arguments.study:
        from xb_muscle_ros.bench import fast_stretch

        made += fast_stretch.study(fibre.name, arguments.out.with_name("fast_stretch.png"))
        print(arguments.out.with_name("fast_stretch.png"))
    if "fit" in arguments.study:
        from xb_muscle_ros.bench import fit_time

        if not fit_time.casadi_is_there():
            warn(fit_time.MISSING)
        made += fit_time.figures(fibre)
    if "node" in arguments.study:
        from xb_muscle_ros.bench import node_timing

        made += node_timing.figures(arguments.duration, arguments.rate or 1000.0, arguments.priority)
    if "roundtrip" in arguments.study:
        from xb_muscle_ros.bench import node_timing

        made += node_timing.roundtrip_figures(arguments.duration, arguments.rate or 500.0)
    if "many" in arguments.study:
        from xb_muscle_ros.bench import node_timing

        made += node_timing.many_figures(
            arguments.duration, arguments.rate or 500.0, arguments.fibers, arguments.priority
        )
    if "soak" in arguments.study:
        from xb_muscle_ros.bench import soak

        made += soak.figures(fibre, arguments.ticks)
    print(as_text(made))
    write(arguments.out, made, machine())
    print(arguments.out)
    return 0
