"""``xb_muscle diagnose``: say what physics a simulation left out of recordings."""

from __future__ import annotations

import argparse
from pathlib import Path

from xb_muscle_ros.cli import common

DESCRIPTION = (
    "Locate where recordings and simulation differ, name what physics is missing, model it, and show how well the "
    "augmented model does."
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    common.add_bags(parser)
    common.add_fibre(
        parser, several=True, required=True,
        help="fibre files, or names of fibres in the package; with several, bags are found by the fibre's name",
    )  # fmt: skip
    common.add_model(parser, changes=False)
    common.add_reading(parser)
    parser.add_argument(
        "--features", type=Path, metavar="JSON", help="measured SRS and isometric force to be met beside the traces"
    )
    parser.add_argument(
        "--predict", type=Path, metavar="JSON",
        help="measured SRS and isometric force: predicted and compared, never fitted",
    )  # fmt: skip
    parser.add_argument(
        "--nuisance", action="extend", nargs="+", default=[], metavar="ARTEFACT=SD",
        help="SDs of measurement artefacts where the study knows better, in their units, such as time_shift=0.002 (s)",
    )  # fmt: skip
    common.add_out(parser, "folder for report and results")
    parser.add_argument("--quick", action="store_true", help="search less thoroughly: minutes become tens of seconds")
    parser.add_argument("--seed", type=_seed, default=1, metavar="N", help="seed of the bootstrap (default 1)")
    common.add_work(parser)


def _seed(text: str) -> int:
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f"seed '{text}'; allowed is a whole number from 0 on")
    return int(text)


def run(arguments: argparse.Namespace) -> int:
    """Diagnose, print the answer, say where the report is."""
    from xb_muscle_ros.api.diagnosing import diagnose
    from xb_muscle_ros.diagnose.outputs import older_results
    from xb_muscle_ros.files import refuse_older

    out: Path = arguments.out
    refuse_older(older_results(out), arguments.overwrite)
    found = common.called(
        diagnose,
        arguments,
        arguments.bags,
        arguments.fiber,
        journal=out / "journal.jsonl",
        progress=True,
        tell=lambda _: None,  # They stand in what is printed at the end.
    )
    print(found)
    for path in found.save(out, overwrite=True):
        print(path)
    return 0
