"""``xb_muscle inspect``: what is in a file, before it is imported."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from xb_muscle_ros.cli import common
from xb_muscle_ros.cli.import_command import FORMATS

DESCRIPTION = (
    "Say what is in recordings and bags: signals with units, ranges and sampling rates, what was recognised and why, "
    "what is missing, and which mapping would import them. What is unclear is told and left open."
)
EPILOG = "Exit code: 0 all was read, 1 some files could not be read, 2 none could."


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE", help="recording, bag, or folder of such")
    parser.add_argument("--format", choices=FORMATS, help="format of the files (default: what each looks like)")
    parser.add_argument(
        "--mapping-out", type=Path, metavar="YAML", help="write the mapping that would import the files, to start from"
    )
    common.add_out(parser, "folder for inspection.json and a picture of each file", required=False)


def run(arguments: argparse.Namespace) -> int:
    """Print the report, write what is asked for.

    Returns:
        0, 1 where some files could not be read, 2 where none could.
    """
    from xb_muscle_ros.api.inspecting import inspect

    found = inspect(arguments.files, format=arguments.format)
    for line in found.unreadable:
        print(f"xb_muscle: error: {line}", file=sys.stderr)
    if not found.files:
        return 2
    print(found.table)
    if arguments.mapping_out is not None:
        print(found.write_mapping(arguments.mapping_out, overwrite=arguments.overwrite))
    if arguments.out is not None:
        for path in found.save(arguments.out, overwrite=arguments.overwrite):
            print(path)
    return 1 if found.unreadable else 0
