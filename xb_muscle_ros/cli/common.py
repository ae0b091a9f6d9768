"""Arguments and messages that several commands share."""

from __future__ import annotations

import argparse
import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from xb_muscle_ros.models.fibre_file import Fibre

    Subparsers = argparse._SubParsersAction[argparse.ArgumentParser]


def add_fibre(parser: argparse.ArgumentParser, required: bool = True) -> None:
    """Options that pick a fibre, a model and a method."""
    parser.add_argument(
        "--fiber", "--fibre", dest="fiber", required=required, help="fibre file, or name of a fibre in the package"
    )
    parser.add_argument("--model", help="parameter set of the fibre file (default: the one the file names)")
    parser.add_argument("--method", help="how heads are distributed over strain (default: the fibre file's)")


def fibre_of(arguments: argparse.Namespace) -> Fibre:
    """The fibre that the options pick."""
    from xb_muscle_ros.models.fibre_file import load_fibre

    return load_fibre(arguments.fiber, arguments.model, arguments.method)


def warn(message: str) -> None:
    """One line on stderr."""
    print(f"xb_muscle: warning: {message}", file=sys.stderr)
