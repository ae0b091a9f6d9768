"""``xb_muscle evaluate``: models against recordings and against the paper, as tables and figures."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from xb_muscle_ros.cli.common import add_overwrite, add_reading, add_work, warn

if TYPE_CHECKING:
    from xb_muscle_ros.cli.common import Subparsers


def add(subparsers: Subparsers) -> None:
    """Add the command to the command line."""
    parser = subparsers.add_parser(
        "evaluate",
        help="score models against recordings, and set them beside the paper",
        description="Score models over the trials of recordings: force RMSD, short-range stiffness, AIC, paired tests; "
        "with --paper the paper's whole grid of conditions. Writes evaluate.json, .md, CSV and figures.",
    )
    parser.add_argument("bags", nargs="*", metavar="BAG", help="bag folder, .mcap file, or folder of bags")
    parser.add_argument(
        "--fiber", "--fibre", dest="fiber", nargs="+", default=[], metavar="FIBER",
        help="fibre files or names (default: the package's file of a bag's fibre; with --paper all that were measured)",
    )  # fmt: skip
    add_reading(parser, several=True)
    parser.add_argument("--model", nargs="+", help="parameter sets (default: all that the fibre files have)")
    parser.add_argument("--method", help="how heads are distributed over strain (default: the fibre file's)")
    parser.add_argument("--settle", type=float, help="isometric time before each trial, s (default: until at rest)")
    parser.add_argument("--measured-only", action="store_true", help="evaluate the recordings alone, without models")
    parser.add_argument("--skip-bad", action="store_true", help="leave out recordings that cannot be evaluated")
    parser.add_argument(
        "--paper", action="store_true", help="simulate the paper's grid of conditions (with --empirical)"
    )
    parser.add_argument("--empirical", type=Path, metavar="JSON", help="measured SRS of all fibres: empirical_srs.json")
    parser.add_argument("--golden", type=Path, metavar="JSON", help="the authors' released output: golden_srs.json")
    parser.add_argument("--out", type=Path, required=True, help="folder for evaluate.json, tables and figures")
    add_overwrite(parser)
    add_work(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Evaluate, print the tables, write the files."""
    from xb_muscle_ros.api.evaluating import evaluate
    from xb_muscle_ros.errors import UserError
    from xb_muscle_ros.evaluate.writing import older_results
    from xb_muscle_ros.files import refuse_older

    if arguments.paper != (arguments.empirical is not None):
        raise UserError("--paper and --empirical go together; give the table of measured SRS, empirical_srs.json")
    refuse_older(older_results(arguments.out), arguments.overwrite)
    found = evaluate(
        arguments.bags,
        fibre=arguments.fiber,
        model=arguments.model,
        method=arguments.method,
        reference_length=arguments.reference_length,
        f0=arguments.f0,
        trials_of=arguments.trials_of,
        settle=arguments.settle,
        measured_only=arguments.measured_only,
        skip_bad=arguments.skip_bad,
        empirical=arguments.empirical,
        golden=arguments.golden,
        processes=arguments.processes,
        scheduler=arguments.scheduler,
        out=arguments.out,
        progress=True,
        tell=warn,
    )
    if str(found):
        print(found)
    for path in found.save(arguments.out, overwrite=True):
        print(path)
    return 0
