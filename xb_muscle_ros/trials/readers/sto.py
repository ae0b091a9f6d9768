"""Trials from OpenSim's storage and motion files (``.sto``, ``.mot``): one table below a header that ends by itself.

Header lines are ``key=value`` (``nRows``, ``nColumns``, ``inDegrees``, ...; ``datarows`` and ``datacolumns`` in older
motion files) up to ``endheader``; then come the names of the columns, ``time`` among them, and the rows. Times are in
s, lengths in m, forces in N, as everywhere in OpenSim, unless the name of a column has a unit (``force_mN``); what is
normalised by its name (``normalized_fiber_length``, ``active_fiber_force_multiplier``) is relative to optimal fibre
length or maximal isometric force, which are L0 and F0.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.inspecting.words import fitting, read_name
from xb_muscle_ros.trials.readers.base import Pending, Reader, Recording
from xb_muscle_ros.trials.readers.contents import Contents
from xb_muscle_ros.trials.readers.description import Column, ImportMapping, filled
from xb_muscle_ros.trials.readers.lines import Rows, Text, amount, read_lines, read_rows
from xb_muscle_ros.trials.readers.named_columns import NamedColumn, contents_of, signals_of
from xb_muscle_ros.trials.readers.units import UNITS, calibration, volts_of

_NEEDED = "a storage file of OpenSim"
_END = "endheader"
# An import takes these where the mapping tells no others.
_UNITS = {"time": "s", "length": "m", "force": "N"}
_NORMALISED = {"length": "L0", "force": "F0"}
_ROWS, _COLUMNS = ("nrows", "datarows"), ("ncolumns", "datacolumns")


@dataclass(frozen=True)
class StoHeader:
    """What stands above the rows.

    Attributes:
        title: the first line, where that is no key; empty where it is.
        facts: values by key in small letters.
        names: of the columns.
        first: index of the line the rows begin with.
    """

    path: Path
    title: str
    facts: Mapping[str, str]
    names: tuple[str, ...]
    first: int

    def count(self, keys: tuple[str, ...]) -> int | None:
        """A number of rows or columns; None where the header does not tell it."""
        told = next((self.facts[key] for key in keys if key in self.facts), None)
        value = amount(told).value if told is not None else -1.0
        return int(value) if value >= 0.0 and value.is_integer() else None


def read_header(path: Path, text: Text) -> StoHeader:
    """Read what stands above the rows.

    Raises:
        UserError: the file has no ``endheader``, ends with it, or names other columns than it counts.
    """
    end = next((i for i, line in enumerate(text.lines) if line.strip().casefold() == _END), None)
    if end is None:
        raise UserError(f"{path} has no line '{_END}'; needed is {_NEEDED}; copy it again")
    pairs = [line.partition("=") for line in text.lines[:end]]
    facts = {key.strip().casefold(): value.strip() for key, sign, value in pairs if sign}
    facts |= {
        words[0].casefold(): words[1]
        for key, sign, _ in pairs
        if not sign and len(words := key.split()) == 2 and words[0].casefold() in _ROWS + _COLUMNS
    }
    title = text.lines[0].strip() if end > 0 and not pairs[0][1] else ""
    at = next((i for i in range(end + 1, len(text.lines)) if text.lines[i].strip()), None)
    if at is None:
        raise UserError(f"{path} ends within its header: no columns are named below '{_END}'; copy it again")
    line = text.lines[at]
    names = tuple(cell.strip() for cell in line.split("\t") if cell.strip()) if "\t" in line else tuple(line.split())
    header = StoHeader(path, title, facts, names, at + 1)
    told = header.count(_COLUMNS)
    if told is not None and told != len(names):
        raise UserError(
            f"{path}, line {at + 1} names {len(names)} columns, the header tells of {told}; mend one of them, or copy "
            "the file again"
        )
    return header


class StoReader(Reader):
    """One trial to a file, which is a muscle; the mapping names the columns of length and force."""

    name = "sto"
    suffixes = (".sto", ".mot")
    defaults: Mapping[str, Any] = {
        "fibre": "{file}",
        "columns": {"time": {"column": "time", "unit": _UNITS["time"]}, "length": {"unit": _UNITS["length"]}},
    }
    takes = ("decimal",)

    def defaults_for(self, told: Mapping[str, Any]) -> Mapping[str, Any]:
        """With units by the names of the columns that the mapping names; that of force where it names one."""
        columns = told.get("columns")
        named = columns if isinstance(columns, Mapping) else {}
        roles = ["time", "length", *(["force"] if named.get("force") is not None else [])]
        own: Mapping[str, Any] = self.defaults["columns"]
        units = {role: {**own.get(role, {}), "unit": _unit_of(role, named.get(role))} for role in roles}
        return {**self.defaults, "columns": {**own, **units}}

    def trials(self, path: Path, mapping: ImportMapping) -> Iterator[Pending]:
        """The one trial of the file."""
        yield Pending(filled(mapping.trial, path), lambda: _recording(path, mapping))

    def contents(self, path: Path) -> Contents:
        """All columns; lengths and forces by their names are in the units of OpenSim, which its files do not tell."""
        text = read_lines(path, _NEEDED)
        header = read_header(path, text)
        rows = read_rows(path, text, header.first, header.names)
        columns = {
            name: NamedColumn(rows.values[:, i], "s" if i == 0 else _unit(name)) for i, name in enumerate(header.names)
        }
        signals = contents_of(columns, self.defaults, rows.at)
        notes = (*rows.notices, *_of_rows(header, rows))
        return Contents(f"OpenSim {header.title}".strip(), signals, facts=header.facts, notes=notes)


def _unit(name: str) -> str:
    """The unit of a column that its name does not tell."""
    named = read_name(name)
    roles = [role for role in named.roles if role in _NORMALISED]
    return _own_unit(roles[0], name) if len(roles) == 1 and not named.unit else ""


def _own_unit(role: str, name: str) -> str:
    """The unit of OpenSim for a column."""
    return _NORMALISED[role] if role in _NORMALISED and read_name(name).is_normalised else _UNITS[role]


def _unit_of(role: str, spec: object) -> str:
    """The unit of a signal by the column that a mapping names for it: that in its name, or else OpenSim's."""
    name = str(spec.get("column", "")) if isinstance(spec, Mapping) else ""
    return fitting(read_name(name).unit, role) or _own_unit(role, name)


def _recording(path: Path, mapping: ImportMapping) -> Recording:
    text = read_lines(path, _NEEDED)
    header = read_header(path, text)
    rows = read_rows(path, text, header.first, header.names, mapping.table.decimal)
    used = [column.name for column in mapping.columns.values()]
    twice = next((name for name in used if header.names.count(name) > 1), None)
    if twice is not None:
        raise UserError(f"{path} has more than one column '{twice}'; rename one")
    columns = {name: NamedColumn(rows.values[:, i], "") for i, name in enumerate(header.names)}
    signals = signals_of(path, mapping, columns, rows.at, with_units=False)
    return Recording(
        str(path),
        filled(mapping.trial, path),
        signals,
        mapping.facts_of(path),
        (f"OpenSim storage{f' {header.title}' if header.title else ''}",),
        (*rows.notices, *_of_rows(header, rows), *_doubts(path, mapping)),
    )


def _doubts(path: Path, mapping: ImportMapping) -> Iterator[str]:
    """Lines on columns that are read in the unit of their name, or in another than that tells."""
    for key, column in mapping.columns.items():
        named = read_name(column.name)
        if key in _UNITS and named.unit and not volts_of(named.unit, key):
            yield from _unit_doubts(path, key, column, f"columns.{key}.unit" in mapping.own_keys)
        if named.is_normalised and key in _NORMALISED and column.unit.kind in ("length", "force"):
            yield (
                f"{path}: column '{column.name}' is read in {column.unit_name}, but its name tells a share of "
                f"{_NORMALISED[key]}; by columns.{key}.unit (--{key}-unit) give {_NORMALISED[key]}"
            )
        volts = volts_of(named.unit, key)
        if volts and volts != column.unit.per:
            yield (
                f"{path}: column '{column.name}' is read in {column.unit_name}, but its name tells {volts}; by "
                f"columns.{key}.unit (--{key}-unit) give {calibration(key, volts)}"
            )


def _unit_doubts(path: Path, key: str, column: Column, is_given: bool) -> Iterator[str]:
    """Lines on a column whose name has a unit; one that is OpenSim's own goes without saying."""
    unit = read_name(column.name).unit
    told = fitting(unit, key)
    read = f"{path}: column '{column.name}' is read in {column.unit_name}"
    if not told and not is_given:
        yield f"{read}; '{unit}' in its name is no known unit of {key}; check columns.{key}.unit (--{key}-unit)"
    elif told and UNITS[told] != column.unit:
        yield f"{read}, but its name tells {told}; check columns.{key}.unit (--{key}-unit)"
    elif told and not is_given and told != _own_unit(key, column.name):
        yield f"{read}, as its name says, in place of {_own_unit(key, column.name)}"


def _of_rows(header: StoHeader, rows: Rows) -> tuple[str, ...]:
    told = header.count(_ROWS)
    if told is None or told == len(rows.lines):
        return ()
    why = "the file was cut short" if len(rows.lines) < told else "rows were added"
    return (f"{header.path} has {len(rows.lines)} rows, its header tells of {told}; {why}; the rows are used",)
