"""The command line ``xb_muscle``: one module for each command."""

from __future__ import annotations

import argparse
import functools
import importlib
import sys
import warnings
from collections.abc import Callable, Sequence
from typing import Any

from xb_muscle_ros import __version__, programs
from xb_muscle_ros.errors import DataWarning, UserError

COMMANDS = {
    "demo": "replay the recordings of fibre 18Dec2017a offline and through the node",
    "inspect": "say what is in a file, and which mapping would import it",
    "import": "make bags of recordings: tables, Excel, MATLAB, Aurora, Axon, SLControl, OpenSim, other bags",
    "record": "record live topics into a bag",
    "play": "send trials in real time, to a node or an apparatus",
    "simulate": "simulate trials of a protocol into bags, and read them off",
    "export": "write trials of bags as CSV, Parquet or OpenSim tables",
    "replay": "replay bags through the model and compare forces",
    "evaluate": "score models against recordings, and set them beside the paper",
    "fibre": "write a fibre file to start from",
    "fit": "estimate a fibre's parameters from recordings",
    "diagnose": "say what physics a simulation left out of recordings",
    "prove": "test diagnoses blind: conceal effects, diagnose, score",
    "loop": "couple the muscle with a body in MuJoCo",
    "bench": "measure how fast models and node are",
    "parameters": "list parameters with unit, range and meaning",
}
"""Each is a module ``<name>_command`` of this folder: ``DESCRIPTION``, ``add_arguments`` and ``run``."""

ALIASES = {"fiber": "fibre"}
"""Other names of commands."""


def build_parser(command: str | None = None) -> argparse.ArgumentParser:
    """The whole command line.

    Args:
        command: the arguments of this one alone, which spares the others' imports; else those of every command.
    """
    made = argparse.ArgumentParser(prog="xb_muscle", description="Cross-bridge muscle: simulate, replay, measure.")
    made.add_argument("--version", action="version", version=f"xb_muscle {__version__}")
    subparsers = made.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for name, text in COMMANDS.items():
        if command not in (None, name):
            subparsers.add_parser(name, help=text)
            continue
        module = importlib.import_module(f"xb_muscle_ros.cli.{name}_command")
        parser = subparsers.add_parser(
            name,
            aliases=[other for other, known in ALIASES.items() if known == name],
            help=text,
            description=module.DESCRIPTION,
            epilog=getattr(module, "EPILOG", None),
        )
        module.add_arguments(parser)
        parser.set_defaults(run=getattr(module, "run", None))
    return made


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command; returns its exit code. What a user can mend is one line on stderr and code 2."""
    try:
        given = sys.argv[1:] if argv is None else argv
        arguments = build_parser(
            next((ALIASES.get(each, each) for each in given if each in (*COMMANDS, *ALIASES)), None)
        ).parse_args(argv)
        with warnings.catch_warnings():
            warnings.showwarning = functools.partial(_show, warnings.showwarning)
            return int(arguments.run(arguments))
    except UserError as error:
        print(f"xb_muscle: error: {error}", file=sys.stderr)
        return 2
    except BaseException as error:
        if not _is_interruption(error):
            raise
        print("xb_muscle: interrupted", file=sys.stderr)
        return 130


def _show(otherwise: Callable[..., None], message: Warning | str, category: type[Warning], *where: Any) -> None:
    """What was found odd in the user's data is one line, without a place in the code."""
    if issubclass(category, DataWarning):
        from xb_muscle_ros.cli.common import warn

        warn(str(message))
    else:
        otherwise(message, category, *where)


def _is_interruption(error: BaseException | None) -> bool:
    """Whether Ctrl-C is behind an error: a compiler that is disturbed ends with an error of its own."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None


def console() -> None:
    """Entry point of the installed script."""
    programs.run(main)


if __name__ == "__main__":
    console()
