"""``xb_muscle diagnose``: say what physics a simulation left out of recordings."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from xb_muscle_ros.cli.common import add_overwrite, add_reading, add_work, known_of, warn, work_options_of

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
        nargs="+",
        metavar="FIBER",
        help="fibre file, or name of a fibre in the package; with several each fibre's bags are found by its name",
    )
    parser.add_argument("--model", help="parameter set of the fibre file (default: the one the file names)")
    parser.add_argument("--method", help="how heads are distributed over strain (default: the fibre file's)")
    add_reading(parser)
    parser.add_argument(
        "--features", type=Path, metavar="JSON", help="measured SRS and isometric force to be met beside the traces"
    )
    parser.add_argument(
        "--predict", type=Path, metavar="JSON", help="the same, held out: predicted and compared, never fitted"
    )
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder for report and results")
    parser.add_argument("--quick", action="store_true", help="look less hard: minutes become tens of seconds")
    parser.add_argument("--seed", type=int, default=1, help="of the bootstrap (default 1)")
    add_overwrite(parser)
    add_work(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Diagnose, print the answer, say where the report is."""
    from xb_muscle_ros.diagnose.outcome import older_results
    from xb_muscle_ros.diagnose.run import diagnose_bags
    from xb_muscle_ros.files import refuse_older

    out: Path = arguments.out
    refuse_older(older_results(out), arguments.overwrite)
    _check_pooled(arguments)
    (fiber,) = arguments.fiber
    found = diagnose_bags(
        arguments.bags,
        fiber,
        out,
        arguments.quick,
        arguments.seed,
        arguments.model,
        arguments.method,
        work_options_of(arguments, journal=out / "journal.jsonl"),
        known=known_of(arguments),
        only=arguments.trials_of,
    )
    for line in found["warnings"]:
        warn(line)
    print(found["summary"])
    print(f"verdict: {found['verdict']}{': ' + ', '.join(found['answer']) if found['answer'] else ''}")
    for name in ("report.html", "diagnosis.json", found["augmented_fiber"]):
        if name:
            print(out / name)
    return 0


def _check_pooled(arguments: argparse.Namespace) -> None:
    """Read what only a pooled diagnosis takes, and refuse it as long as there is none.

    Raises:
        UserError: several fibres or tables of features, after what is wrong with them.
    """
    if len(arguments.fiber) == 1 and arguments.features is None and arguments.predict is None:
        return
    from xb_muscle_ros.diagnose.feature_tables import read_features
    from xb_muscle_ros.diagnose.intake import read_fibres
    from xb_muscle_ros.errors import UserError

    studies = read_fibres(
        arguments.bags, arguments.fiber, arguments.model, arguments.method, known_of(arguments), arguments.trials_of
    )
    for path in (arguments.features, arguments.predict):
        if path is not None:
            read_features(path, {study.fibre.name: study.trials for study in studies})
    raise UserError(
        f"{len(studies)} fibres with tables of features cannot be diagnosed together yet; give one fibre at a time, "
        "without --features and --predict"
    )
