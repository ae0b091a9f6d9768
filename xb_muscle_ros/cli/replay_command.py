"""``xb_muscle replay``: recordings through the model, offline or through a running node."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from xb_muscle_ros.cli.common import add_fibre, add_overwrite, add_reading, fibre_of, study_of, warn

if TYPE_CHECKING:
    from xb_muscle_ros.cli.common import Subparsers


def add(subparsers: Subparsers) -> None:
    """Add the command to the command line."""
    parser = subparsers.add_parser(
        "replay",
        help="replay bags through the model and compare forces",
        description="Replay bags through the model; writes replay.json, a figure and the simulated bags.",
    )
    parser.add_argument("bags", nargs="+", metavar="BAG", help="bag folder, .mcap file, or folder of bags")
    add_fibre(parser)
    add_reading(parser)
    parser.add_argument("--out", type=Path, required=True, help="folder for replay.json, figures and simulated bags")
    parser.add_argument(
        "--live", action="store_true", help="play the bags through a running muscle_node (mode lockstep)"
    )
    parser.add_argument("--substeps", type=int, default=1, help="steps between two samples (default 1, as the node)")
    parser.add_argument("--settle", type=float, help="isometric time before each trial, s (default: until at rest)")
    add_overwrite(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Replay, print the table, write the files."""
    from xb_muscle_ros.api.replaying import check_options, replay
    from xb_muscle_ros.replay.run import check_room

    check_options(arguments.substeps, arguments.settle, arguments.live, bool(arguments.changes))
    fibre = fibre_of(arguments)
    trials = study_of(arguments, fibre).trials
    check_room(arguments.out, trials, arguments.overwrite)
    found = replay(
        trials, fibre, substeps=arguments.substeps, settle=arguments.settle, live=arguments.live, tell=warn
    )  # fmt: skip
    print(found.table)
    for path in found.save(arguments.out, overwrite=True):
        print(path)
    return 0
