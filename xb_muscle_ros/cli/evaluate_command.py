"""``xb_muscle evaluate``: models against recordings and against the paper, as tables and figures."""

from __future__ import annotations

import argparse
from pathlib import Path

from xb_muscle_ros.cli import common
from xb_muscle_ros.errors import UserError

DESCRIPTION = (
    "Score models over the trials of recordings: force RMSD, short-range stiffness (SRS), AIC, paired tests; with "
    "--paper over the paper's whole grid of conditions. Writes evaluate.json, evaluate.md, CSV files and figures."
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    common.add_bags(parser, nargs="*")
    common.add_fibre(
        parser, several=True,
        help="fibre files or names (default: the package's file of a bag's fibre; with --paper all that were measured)",
    )  # fmt: skip
    common.add_reading(parser, several=True)
    parser.add_argument("--model", nargs="+", help="parameter sets (default: all that the fibre files have)")
    common.add_method(parser)
    common.add_settle(parser)
    parser.add_argument(
        "--protocol", metavar="NAME",
        help="in place of scores: what this protocol shows, of the recordings and of the --model sets (default: none) "
        "that are given the same; names as for simulate",
    )  # fmt: skip
    parser.add_argument("--measured-only", action="store_true", help="evaluate the recordings alone, without models")
    parser.add_argument("--skip-bad", action="store_true", help="leave out recordings that cannot be evaluated")
    parser.add_argument(
        "--paper", action="store_true", help="simulate the paper's grid of conditions (with --empirical)"
    )
    parser.add_argument("--empirical", type=Path, metavar="JSON", help="measured SRS of all fibres: empirical_srs.json")
    parser.add_argument("--golden", type=Path, metavar="JSON", help="the authors' released output: golden_srs.json")
    common.add_out(parser, "folder for evaluate.json, tables and figures")
    common.add_work(parser)


def run(arguments: argparse.Namespace) -> int:
    """Evaluate, print the tables, write the files."""
    return _protocol(arguments) if arguments.protocol is not None else _scores(arguments)


def _protocol(arguments: argparse.Namespace) -> int:
    from xb_muscle_ros.api.protocols import analyse_protocol, check_room
    from xb_muscle_ros.protocols.registry import protocol_of

    refused = ("measured_only", "skip_bad", "paper", "empirical", "golden", "scheduler", "processes")
    for name in refused:
        if getattr(arguments, name) not in (None, False):
            raise UserError(f"--{name.replace('_', '-')} does not go with --protocol; leave one of them out")
    check_room(arguments.out, protocol_of(arguments.protocol), (), arguments.overwrite)
    model = arguments.model or ()
    found = common.called(
        analyse_protocol, arguments, trials=arguments.bags, fibre=arguments.fiber, model=model, tell=common.warn
    )  # fmt: skip
    print(found)
    for path in found.save(arguments.out, overwrite=True):
        print(path)
    return 0


def _scores(arguments: argparse.Namespace) -> int:
    from xb_muscle_ros.api.evaluating import evaluate
    from xb_muscle_ros.evaluate.writing import older_results
    from xb_muscle_ros.files import refuse_older

    if arguments.paper != (arguments.empirical is not None):
        raise UserError("--paper and --empirical go together; give the table of measured SRS, empirical_srs.json")
    refuse_older(older_results(arguments.out), arguments.overwrite)
    found = common.called(evaluate, arguments, arguments.bags, fibre=arguments.fiber, progress=True, tell=common.warn)
    if str(found):
        print(found)
    for path in found.save(arguments.out, overwrite=True):
        print(path)
    return 0
