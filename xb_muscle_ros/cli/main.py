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
    except KeyboardInterrupt:
        print("xb_muscle: interrupted", file=sys.stderr)
        return 130


def console() -> None:
    """Entry point of the installed script."""
    programs.run(main)


if __name__ == "__main__":
    console()
