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
    from xb_muscle_ros.evaluate.report import comparison_table, force_table, srs_table_text
    from xb_muscle_ros.evaluate.request import Request
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
    common.check_settle(arguments)
    refuse_older(older_results(arguments.out), arguments.overwrite)
    for name in arguments.model or ():
        split_set(name)
    if arguments.method is not None and arguments.method not in METHODS:
        raise UserError(f"method '{arguments.method}' is not known; known: {', '.join(METHODS)}")
    request = Request(
        bags=tuple(map(str, arguments.bags)),
        fibres=tuple(arguments.fiber),
        models=None if arguments.model is None else tuple(arguments.model),
        method=arguments.method,
        settle_s=arguments.settle,
        measured_only=arguments.measured_only,
        skip_bad=arguments.skip_bad,
        empirical=arguments.empirical,
        golden=arguments.golden,
        out=arguments.out,
        work=common.work_options_of(arguments),
        known=common.known_of(arguments),
        only=arguments.trials_of,
    )
    results = evaluate(request, common.warn)
    for line in results.warnings:
        common.warn(line)
    found = results.sections
    if found.force_rmsd is not None and found.force_rmsd.overall:
        print(f"force RMSD, fibre means ± s.d.\n\n{force_table(found.force_rmsd)}\n")
    if found.paper is not None:
        print(f"beside the paper (= to 0.01 or within its bound, ≠ not)\n\n{comparison_table(found.paper)}\n")
    if found.srs is not None:
        for reading in found.srs.shown:
            print(f"RMSD of relative SRS, reading '{reading}'\n\n{srs_table_text(found.srs, reading)}\n")
        if found.srs.shown and found.srs.aic_note:
            print(found.srs.aic_note + "\n")
    for path in write(request, results):
        print(path)
    return 0
