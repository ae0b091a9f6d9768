"""Columns of a text file by name, each with the unit the file tells, as signals of a mapping."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.readers.base import Signal
from xb_muscle_ros.trials.readers.contents import Content
from xb_muscle_ros.trials.readers.description import Column, ImportMapping
from xb_muscle_ros.trials.readers.header import scaled
from xb_muscle_ros.trials.trial import Array

# Signals whose unit a file may tell; that of calcium is the mapping's.
_WITH_UNIT = ("time", "length", "force")


class NamedColumn(NamedTuple):
    """Numbers and their unit as in the file; the unit is empty where there is none."""

    values: Array
    unit: str


def column_of(path: Path, columns: Mapping[str, NamedColumn], column: Column, key: str) -> NamedColumn:
    """The column a mapping names, as ``Fin`` or ``Fin (mN)``.

    Raises:
        UserError: the file has no such column.
    """
    known = {**{f"{name} ({each.unit})": each for name, each in columns.items()}, **columns}
    if column.name in known:
        return known[column.name]
    remedy = f"name another as columns.{key}.column or --{key}-column"
    if key == "force":
        remedy += ", or import without force by 'force: null' under columns"
    raise UserError(f"{path} has no column '{column.name}'; its columns: {', '.join(columns)}; {remedy}")


def signals_of(
    path: Path,
    mapping: ImportMapping,
    columns: Mapping[str, NamedColumn],
    at: Callable[[int], str],
    with_units: bool = True,
) -> dict[str, Signal]:
    """Signals of a mapping, in its units.

    Args:
        columns: by their names in the file.
        at: where in the file a row is, for messages.
        with_units: the format is one that tells units; else those of the mapping are the file's.

    Raises:
        UserError: a column is missing, or its unit is not known or not that of the mapping.
    """
    signals = {}
    for key, column in mapping.columns.items():
        found = column_of(path, columns, column, key)
        signal = Signal(f"column '{column.name}'", found.values, at)
        if with_units and key in _WITH_UNIT:
            signal = scaled(signal, key, found.unit, column, mapping, path)
        signals[key] = signal
    return signals


def contents_of(
    columns: Mapping[str, NamedColumn], defaults: Mapping[str, Any], at: Callable[[int], str]
) -> tuple[Content, ...]:
    """Columns for `inspecting`, in the units of the file; the defaults of a reader tell the roles of some."""
    roles = {keys["column"]: role for role, keys in defaults["columns"].items() if "column" in keys}
    return tuple(
        Content(
            name, values, unit, told_role=roles.get(name, ""), told_more=_more(defaults, roles.get(name, "")), at=at
        )
        for name, (values, unit) in columns.items()
    )


def _more(defaults: Mapping[str, Any], role: str) -> dict[str, str]:
    keys = defaults["columns"].get(role, {})
    return {key: value for key, value in keys.items() if key not in ("column", "unit")}
