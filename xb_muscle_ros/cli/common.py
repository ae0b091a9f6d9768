"""Arguments and messages that several commands share."""

from __future__ import annotations

import argparse
import inspect
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    from xb_muscle_ros.models.fibre_file import Fibre
    from xb_muscle_ros.trials.trial import Trial
    from xb_muscle_ros.work import Options

R = TypeVar("R")


def add_bags(parser: argparse.ArgumentParser, nargs: str = "+") -> None:
    """The recordings that a command is about."""
    parser.add_argument(
        "bags", nargs=nargs, type=Path, metavar="BAG",
        help="bag folder, .mcap file, or folder of bags; in the order of recording",
    )  # fmt: skip


def add_fibre(parser: argparse.ArgumentParser, default: str | None = None, several: bool = False, **more: Any) -> None:
    """The option that picks a fibre, or `several`; `more` are further settings of the option."""
    told = "fibre file, or name of a fibre in the package" + (f" (default {default})" if default else "")
    lists = {"nargs": "+", "action": "extend", "metavar": "FIBER", "default": []} if several else {}
    settings = {"dest": "fiber", "default": default, "help": told, **lists, **more}
    parser.add_argument("--fiber", "--fibre", **settings)


def add_model(parser: argparse.ArgumentParser, changes: bool = True) -> None:
    """Options that pick a model and a method, and with `changes` one that changes values."""
    parser.add_argument("--model", help="parameter set of the fibre file (default: the one the file names)")
    add_method(parser)
    if changes:
        parser.add_argument(
            "--set", dest="changes", metavar="NAME=VALUE", action="append", default=[], type=_change,
            help="another value for a parameter of model or method, for example bins=200 (may be given again)",
        )  # fmt: skip


def add_method(parser: argparse.ArgumentParser) -> None:
    """How heads are distributed over strain."""
    parser.add_argument("--method", help="how heads are distributed over strain (default: the fibre file's)")


def add_settle(parser: argparse.ArgumentParser) -> None:
    """Isometric time before a trial."""
    parser.add_argument(
        "--settle", type=float, metavar="S", help="isometric time before each trial, s (default: until at rest)"
    )


def add_out(
    parser: argparse.ArgumentParser,
    what: str,
    default: str | None = None,
    metavar: str = "DIR",
    required: bool = True,
) -> None:
    """Where results go, and whether they may replace older ones.

    Without a default the option has to be given, unless it is not `required`: the command then says when.
    """
    text = what if default is None else f"{what} (default {default})"
    out = None if default is None else Path(default)
    parser.add_argument(
        "--out", type=Path, metavar=metavar, required=required and default is None, default=out, help=text
    )
    parser.add_argument("--overwrite", action="store_true", help="replace the results of an older run")


def fibre_of(arguments: argparse.Namespace) -> Fibre:
    """The fibre that the options pick; says what it lacks of its own, a line each; see `inputs.fibre_of`."""
    from xb_muscle_ros.api import inputs
    from xb_muscle_ros.api.telling import Lines

    changes = dict(arguments.changes)
    return inputs.fibre_of(arguments.fiber, arguments.model, arguments.method, changes, Lines(warn))


def add_reading(parser: argparse.ArgumentParser, several: bool = False) -> None:
    """Options on how bags are read; `several`: the command takes trials of several fibres in one run."""
    parser.add_argument(
        "--reference-length", metavar="LENGTH",
        help="the length that is L0, for example '30 mm', or 'first_isometric': the length before the first stretch "
        "(default: what the bag tells, else the fibre file)",
    )  # fmt: skip
    parser.add_argument(
        "--f0", metavar="FORCE",
        help="the force that is F0, for example '0.5 mN' (default: what the bag tells, else the fibre file)",
    )  # fmt: skip
    whose = "every fibre that has a file" if several else "the fibre of --fiber"
    parser.add_argument("--trials-of", metavar="FIBER", help=f"take this fibre's trials of the bags (default: {whose})")


def trials_of(arguments: argparse.Namespace, fibre: Fibre) -> list[Trial]:
    """The trials of the bags that the options name; what there is to say of them is said; see `inputs.trials_of`."""
    from xb_muscle_ros.api import inputs
    from xb_muscle_ros.api.telling import Lines

    known = inputs.known_of(arguments.reference_length, arguments.f0)
    return inputs.trials_of(arguments.bags, fibre, known, arguments.trials_of, Lines(warn))


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
    where = parser.add_argument_group("where the work is done")
    where.add_argument("--scheduler", metavar="ADDRESS", help="Dask scheduler (host:8786) whose workers do the work")
    where.add_argument(
        "--processes", type=int, metavar="N", help="processes on this machine (default: one per core; 0: in this one)"
    )


def work_options_of(arguments: argparse.Namespace, label: str = "", journal: Path | None = None) -> Options:
    """Where the options want work done; see `inputs.work_of`."""
    from xb_muscle_ros.api import inputs

    return inputs.work_of(arguments.processes, arguments.scheduler, journal, label=label)


def called(function: Callable[..., R], arguments: argparse.Namespace, *first: object, **more: object) -> R:
    """What a function answers to the arguments that are called like its parameters.

    Args:
        function: one of the public ones.
        first: its first arguments.
        more: its parameters that the command line has by other names, or not as they are; they go first.
    """
    named = inspect.signature(function).parameters.keys() & vars(arguments).keys()
    return function(*first, **({name: getattr(arguments, name) for name in named} | more))


def warn(message: str) -> None:
    """One line on stderr, above a progress bar if there is one."""
    from xb_muscle_ros.progress import Progress

    Progress.write(f"xb_muscle: warning: {message}", file=sys.stderr)
