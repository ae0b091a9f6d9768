"""Arguments and messages that several commands share."""

from __future__ import annotations

import argparse
import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

    from xb_muscle_ros.models.fibre_file import Fibre
    from xb_muscle_ros.work import Options

    Subparsers = argparse._SubParsersAction[argparse.ArgumentParser]


def add_fibre(parser: argparse.ArgumentParser, required: bool = True) -> None:
    """Options that pick a fibre, a model and a method."""
    parser.add_argument(
        "--fiber", "--fibre", dest="fiber", required=required, help="fibre file, or name of a fibre in the package"
    )
    parser.add_argument("--model", help="parameter set of the fibre file (default: the one the file names)")
    parser.add_argument("--method", help="how heads are distributed over strain (default: the fibre file's)")
    parser.add_argument(
        "--set",
        dest="changes",
        metavar="NAME=VALUE",
        action="append",
        default=[],
        type=_change,
        help="another value for a parameter of model or method, for example bins=200 (may be given again)",
    )


def fibre_of(arguments: argparse.Namespace, for_fit: bool = False) -> Fibre:
    """The fibre that the options pick; says what it lacks of its own, a line each.

    Args:
        arguments: parsed.
        for_fit: what it lacks is to be fitted, see `load_fibre`.
    """
    from xb_muscle_ros.models.catalogue import without_effect_line
    from xb_muscle_ros.models.fibre_file import borrowed_line, changed, load_fibre

    fibre = load_fibre(arguments.fiber, arguments.model, arguments.method, for_fit)
    fibre = changed(fibre, dict(arguments.changes), "--set")
    for line in (borrowed_line(fibre), "" if for_fit else without_effect_line(fibre.model, fibre.values)):
        if line:
            warn(line)
    return fibre


def _change(text: str) -> tuple[str, float]:
    """Name and value of ``NAME=VALUE``; argparse makes one line of the error."""
    name, equals, value = text.partition("=")
    if not equals:
        raise argparse.ArgumentTypeError(f"'{text}' is not NAME=VALUE, for example bins=200")
    try:
        return name.strip(), float(value)
    except ValueError:
        raise argparse.ArgumentTypeError(f"'{value}' in '{text}' is not a number") from None


def add_work(parser: argparse.ArgumentParser) -> None:
    """Options that pick where long work is done."""
    parser.add_argument("--scheduler", metavar="ADDRESS", help="Dask scheduler (host:8786) whose workers do the work")
    parser.add_argument(
        "--processes", type=int, metavar="N", help="processes on this machine (default: one per core; 0: in this one)"
    )


def work_options_of(arguments: argparse.Namespace, label: str = "", journal: Path | None = None) -> Options:
    """Where the options want work done.

    Args:
        arguments: parsed.
        label: shown before the progress bar.
        journal: file that keeps finished results.

    Raises:
        UserError: options that are out of range or against each other.
    """
    from xb_muscle_ros.errors import UserError
    from xb_muscle_ros.work import Options

    if arguments.processes is not None and arguments.scheduler is not None:
        raise UserError("--processes is of this machine and --scheduler of a cluster; drop one of them")
    if arguments.processes is not None and not 0 <= arguments.processes <= 1024:
        raise UserError(f"--processes is {arguments.processes}; allowed is 0 to 1024")
    return Options(arguments.scheduler, arguments.processes, journal, label)


def warn(message: str) -> None:
    """One line on stderr."""
    print(f"xb_muscle: warning: {message}", file=sys.stderr)
