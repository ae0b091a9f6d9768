"""``xb_muscle evaluate``: models against recordings and against the paper, as tables and figures."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from xb_muscle_ros.cli.common import add_overwrite, add_reading, add_work, known_of, warn, work_options_of

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
    from xb_muscle_ros.errors import UserError
    from xb_muscle_ros.evaluate.report import comparison_table, force_table, readings_with_conditions, srs_table_text
    from xb_muscle_ros.evaluate.results import Request
    from xb_muscle_ros.evaluate.run import evaluate
    from xb_muscle_ros.evaluate.writing import older_results, write
    from xb_muscle_ros.files import refuse_older
    from xb_muscle_ros.models.registry import METHODS, split_set

    if arguments.paper != (arguments.empirical is not None):
        raise UserError("--paper and --empirical go together; give the table of measured SRS, empirical_srs.json")
    if arguments.golden is not None and not arguments.paper:
        raise UserError("--golden is compared with --paper only; add --paper --empirical JSON")
    if not arguments.bags and not arguments.paper:
        raise UserError("there is nothing to evaluate; give bags, or --paper --empirical JSON")
    if arguments.measured_only and (arguments.paper or arguments.model or arguments.fiber):
        raise UserError("--measured-only has no models; drop it, or --paper, --model and --fiber")
    if arguments.settle is not None and not 0.0 < arguments.settle <= 1e6:
        raise UserError(f"--settle is {arguments.settle:g} s; allowed is above 0 to 1e6")
    refuse_older(older_results(arguments.out), arguments.overwrite)
    for name in arguments.model or ():
        split_set(name)
    if arguments.method is not None and arguments.method not in METHODS:
        raise UserError(f"method '{arguments.method}' is not known; known: {', '.join(METHODS)}")
    request = Request(
        bags=tuple(arguments.bags),
        fibres=tuple(arguments.fiber),
        models=None if arguments.model is None else tuple(arguments.model),
        method=arguments.method,
        settle_s=arguments.settle,
        measured_only=arguments.measured_only,
        skip_bad=arguments.skip_bad,
        empirical=arguments.empirical,
        golden=arguments.golden,
        out=arguments.out,
        work=work_options_of(arguments),
        known=known_of(arguments),
        only=arguments.trials_of,
    )
    results = evaluate(request, warn)
    for line in results.warnings:
        warn(line)
    found = results.sections
    if found.get("force_rmsd", {}).get("overall"):
        print(f"force RMSD, fibre means ± s.d.\n\n{force_table(found['force_rmsd'])}\n")
    if "paper" in found:
        print(f"beside the paper (= to 0.01 or within its bound, ≠ not)\n\n{comparison_table(found['paper'])}\n")
    if "srs" in found:
        shown = readings_with_conditions(found["srs"])
        for reading in shown:
            print(f"RMSD of relative SRS, reading '{reading}'\n\n{srs_table_text(found['srs'], reading)}\n")
        if shown and found["srs"]["aic_note"]:
            print(found["srs"]["aic_note"] + "\n")
    for path in write(request, results):
        print(path)
    return 0
