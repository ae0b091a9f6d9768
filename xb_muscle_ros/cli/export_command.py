"""``xb_muscle export``: trials of bags as tables that other programs read."""

from __future__ import annotations

import argparse

from xb_muscle_ros.cli import common

FORMATS = ("csv", "parquet", "sto")
DESCRIPTION = (
    "Write each trial as a table: length, calcium, measured and simulated force side by side, columns with units in "
    "their names. CSV comes with the mapping by which 'xb_muscle import' makes the trial again."
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    common.add_bags(parser)
    parser.add_argument("--to", choices=FORMATS, default="csv", help="format (default %(default)s; sto: OpenSim)")
    parser.add_argument(
        "--interpolate", action="store_true",
        help="put forces of another clock on that of the lengths, by straight lines (default: a table of their own)",
    )  # fmt: skip
    common.add_out(parser, "folder of the tables", "tables")


def run(arguments: argparse.Namespace) -> int:
    """Write the tables, name them."""
    from xb_muscle_ros.api.exporting import export_trials

    for path in export_trials(
        arguments.bags, arguments.out, to=arguments.to, interpolate=arguments.interpolate,
        overwrite=arguments.overwrite, tell=common.warn,
    ):  # fmt: skip
        print(path)
    return 0
