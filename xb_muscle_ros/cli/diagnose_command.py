"""``xb_muscle diagnose``: say what physics a simulation left out of recordings."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from xb_muscle_ros.cli.common import add_overwrite, add_reading, add_work, known_of, work_options_of

if TYPE_CHECKING:
    Subparsers = argparse._SubParsersAction[argparse.ArgumentParser]


def add(subparsers: Subparsers) -> None:
    """Add the command to the command line."""
    parser = subparsers.add_parser(
        "diagnose",
        help="say what physics a simulation left out of recordings",
        description="Locate where recordings and simulation differ, name what is missing, model it and show how well.",
    )
    parser.add_argument("bags", nargs="+", type=Path, metavar="BAG", help="bags or folders, in the order of recording")
    parser.add_argument(
        "--fiber",
        "--fibre",
        dest="fiber",
        required=True,
        action="extend",
        nargs="+",
        metavar="FIBER",
        help="fibre files, or names of fibres in the package; with several, bags are found by the fibre's name",
    )
    parser.add_argument("--model", help="parameter set of the fibre file (default: the one the file names)")
    parser.add_argument("--method", help="how heads are distributed over strain (default: the fibre file's)")
    add_reading(parser)
    parser.add_argument(
        "--features", type=Path, metavar="JSON", help="measured SRS and isometric force to be met beside the traces"
    )
    parser.add_argument(
        "--predict",
        type=Path,
        metavar="JSON",
        help="measured SRS and isometric force: predicted and compared, never fitted",
    )
    parser.add_argument(
        "--nuisance",
        action="extend",
        nargs="+",
        default=[],
        metavar="FAULT=SD",
        help="SDs of ordinary measurement errors where the study knows better, such as time_shift=0.002 (s)",
    )
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder for report and results")
    parser.add_argument("--quick", action="store_true", help="look less hard: minutes become tens of seconds")
    parser.add_argument("--seed", type=_seed, default=1, help="of the bootstrap (default 1)")
    add_overwrite(parser)
    add_work(parser)
    parser.set_defaults(run=run)


def _seed(text: str) -> int:
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f"seed '{text}'; allowed is a whole number from 0 on")
    return int(text)


def run(arguments: argparse.Namespace) -> int:
    """Diagnose, print the answer, say where the report is."""
    from xb_muscle_ros.diagnose.error_sds import error_sds_of
    from xb_muscle_ros.diagnose.outputs import older_results
    from xb_muscle_ros.diagnose.report.terminal import terminal_text
    from xb_muscle_ros.diagnose.run import diagnose_bags
    from xb_muscle_ros.files import refuse_older

    out: Path = arguments.out
    refuse_older(older_results(out), arguments.overwrite)
    found = diagnose_bags(
        arguments.bags,
        arguments.fiber,
        out,
        arguments.quick,
        arguments.seed,
        arguments.model,
        arguments.method,
        work_options_of(arguments, journal=out / "journal.jsonl"),
        known=known_of(arguments),
        only=arguments.trials_of,
        features=arguments.features,
        predict=arguments.predict,
        error_sds=error_sds_of(arguments.nuisance),
    )
    print(terminal_text(found))
    for name in ("report.html", "diagnosis.json", *found.augmented.values()):
        print(out / name)
    return 0
