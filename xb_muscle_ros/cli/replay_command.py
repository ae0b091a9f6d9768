"""``xb_muscle replay``: recordings through the model, offline or through a running node."""

from __future__ import annotations

import argparse

from xb_muscle_ros.cli import common

DESCRIPTION = (
    "Replay bags through the model, compare simulated with measured force, and write replay.json, a figure and the "
    "simulated bags."
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    common.add_bags(parser)
    common.add_fibre(parser, required=True)
    common.add_model(parser)
    common.add_reading(parser)
    common.add_out(parser, "folder for replay.json, figures and simulated bags")
    parser.add_argument(
        "--live", action="store_true", help="play the bags through a running muscle_node (mode lockstep)"
    )
    parser.add_argument(
        "--substeps", type=int, default=1, metavar="N", help="steps between two samples (default 1, as the node)"
    )
    common.add_settle(parser)


def run(arguments: argparse.Namespace) -> int:
    """Replay, print the table, write the files."""
    from xb_muscle_ros.api.replaying import check_options, replay
    from xb_muscle_ros.replay.run import check_room

    check_options(arguments.substeps, arguments.settle, arguments.live, bool(arguments.changes))
    fibre = common.fibre_of(arguments)
    trials = common.trials_of(arguments, fibre)
    check_room(arguments.out, trials, arguments.overwrite)
    found = replay(
        trials, fibre, substeps=arguments.substeps, settle=arguments.settle, live=arguments.live, tell=common.warn
    )  # fmt: skip
    print(found.table)
    for path in found.save(arguments.out, overwrite=True):
        print(path)
    return 0
