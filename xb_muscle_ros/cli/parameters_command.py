"""``xb_muscle parameters``: the parameter table, or what a fibre file makes of it."""

from __future__ import annotations

import argparse

from xb_muscle_ros.cli import common

DESCRIPTION = "List the parameter table; with --fiber the parameters of the fibre's model and their values."


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    common.add_fibre(parser)
    common.add_model(parser)


def run(arguments: argparse.Namespace) -> int:
    """Print the table; with a fibre, its model's parameters and their values."""
    from xb_muscle_ros.mechanisms.base import Parameter
    from xb_muscle_ros.models.parameters import CONSTANTS, PARAMETERS
    from xb_muscle_ros.tables import Columns, aligned, filled, number

    values: dict[str, float] = {}
    rows = [*CONSTANTS.values(), *PARAMETERS.values()]
    if arguments.fiber:
        fibre = common.fibre_of(arguments)
        values = {"reference_length_m": fibre.reference_length_m, "f0_n": fibre.f0_n, **fibre.values}
        rows = [row for row in rows if row.name in values]
        print(f"fibre {fibre.name}, model {fibre.model} (file has {', '.join(fibre.available_models)}), {fibre.path}")
    columns: Columns[Parameter] = {
        "parameter": lambda row: row.name,
        "value": lambda row: number(values.get(row.name, row.default), ".6g"),
        "unit": lambda row: row.unit,
        "allowed": lambda row: f"{row.lower:g} to {row.upper:g}",
        "meaning (source)": lambda row: f"{row.meaning} ({row.source})",
    }
    print(aligned(*filled(columns, rows), left=(0, 2, 3, 4)))
    return 0
