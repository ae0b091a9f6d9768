"""``xb_muscle replay``: recordings through the model, offline or through a running node."""

from __future__ import annotations

import argparse

from xb_muscle_ros.cli import common
from xb_muscle_ros.errors import UserError

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
    from xb_muscle_ros.replay.run import Player, check_room, replay, write_results
    from xb_muscle_ros.simulation.offline import one_for_all, pushing

    if not 1 <= arguments.substeps <= 10000:
        raise UserError(f"--substeps is {arguments.substeps}; allowed is 1 to 10000")
    common.check_settle(arguments)
    if arguments.live and (arguments.substeps != 1 or arguments.settle is not None):
        raise UserError("--live leaves steps and settling to the node; drop --substeps and --settle")
    if arguments.live and arguments.changes:
        raise UserError("--live gives the node a fibre file as it is; put the values of --set into a file of your own")
    fibre = common.fibre_of(arguments)
    trials = common.study_of(arguments, fibre).trials
    others = [trial.facts.fibre for trial in trials if trial.facts.fibre != fibre.name]
    if others:
        whose = ", ".join(dict.fromkeys(others))
        common.warn(
            f"{len(others)} of {len(trials)} trials are of fibre {whose}, replayed with parameters of {fibre.name}"
        )
    check_room(arguments.out, trials, arguments.overwrite)
    player: Player | None = None
    if arguments.live:
        # The one place where this command touches ROS, and only when asked to.
        from xb_muscle_ros.node.player import play_live

        player = play_live
    results = replay(trials, fibre, player, arguments.substeps, arguments.settle)
    told = [pushing(*pair, fibre.model) for pair in zip(trials, results.simulated, strict=True)]
    for line in one_for_all([line for line in told if line]):
        common.warn(line)
    print(results.table)
    for path in write_results(arguments.out, trials, results):
        print(path)
    return 0
