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
    from xb_muscle_ros.errors import UserError
    from xb_muscle_ros.replay.run import Player, check_room, replay, write_results
    from xb_muscle_ros.simulation.offline import one_for_all, pushing

    if not 1 <= arguments.substeps <= 10000:
        raise UserError(f"--substeps is {arguments.substeps}; allowed is 1 to 10000")
    if arguments.settle is not None and not 0.0 < arguments.settle <= 1e6:
        raise UserError(f"--settle is {arguments.settle:g} s; allowed is above 0 to 1e6")
    if arguments.live and (arguments.substeps != 1 or arguments.settle is not None):
        raise UserError("--live leaves steps and settling to the node; drop --substeps and --settle")
    if arguments.live and arguments.changes:
        raise UserError("--live gives the node a fibre file as it is; put the values of --set into a file of your own")
    fibre = fibre_of(arguments)
    trials = study_of(arguments, fibre).trials
    others = [trial.facts.fibre for trial in trials if trial.facts.fibre != fibre.name]
    if others:
        whose = ", ".join(dict.fromkeys(others))
        warn(f"{len(others)} of {len(trials)} trials are of fibre {whose}, replayed with parameters of {fibre.name}")
    check_room(arguments.out, trials, arguments.overwrite)
    player: Player | None = None
    if arguments.live:
        # The one place where this command touches ROS, and only when asked to.
        from xb_muscle_ros.node.client.player import play_live

        player = play_live
    results = replay(trials, fibre, player, arguments.substeps, arguments.settle)
    told = [pushing(*pair, fibre.model) for pair in zip(trials, results.simulated, strict=True)]
    for line in one_for_all([line for line in told if line]):
        warn(line)
    print(results.table)
    for path in write_results(arguments.out, trials, results):
        print(path)
    return 0
