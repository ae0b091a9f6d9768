"""The command line ``xb_muscle``: one module for each command."""

from __future__ import annotations

import argparse
import importlib
import sys
from collections.abc import Sequence

from xb_muscle_ros import __version__, programs
from xb_muscle_ros.errors import UserError

COMMANDS = (
    "demo",
    "import",
    "simulate",
    "replay",
    "evaluate",
    "fit",
    "diagnose",
    "prove",
    "loop",
    "bench",
    "parameters",
)


def parser() -> argparse.ArgumentParser:
    """The whole command line."""
    made = argparse.ArgumentParser(prog="xb_muscle", description="Cross-bridge muscle: simulate, replay, measure.")
    made.add_argument("--version", action="version", version=f"xb_muscle {__version__}")
    subparsers = made.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for name in COMMANDS:
        importlib.import_module(f"xb_muscle_ros.cli.{name}_command").add(subparsers)
    return made


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command; returns its exit code. What a user can mend is one line on stderr and code 2."""
    try:
        arguments = parser().parse_args(argv)
        return int(arguments.run(arguments))
    except UserError as error:
        print(f"xb_muscle: error: {error}", file=sys.stderr)
        return 2
    except BaseException as error:
        if not _is_interruption(error):
            raise
        print("xb_muscle: interrupted", file=sys.stderr)
        return 130


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
