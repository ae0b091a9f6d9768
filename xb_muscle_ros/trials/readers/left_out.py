"""What a mapping leaves out and a table tells itself: units in its header, and the rate of its samples."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.readers.columns import SIGNALS
from xb_muscle_ros.trials.readers.layout import Wanted
from xb_muscle_ros.trials.readers.options import wanted
from xb_muscle_ros.trials.readers.rates import check_times
from xb_muscle_ros.trials.readers.table import Table
from xb_muscle_ros.trials.readers.units import calibration, unit_in, volts_of


class Told(NamedTuple):
    """What a file tells: values by key of the mapping, such as ``columns.force.unit``, and a line on each."""

    values: tuple[tuple[str, str], ...] = ()
    lines: tuple[str, ...] = ()

    @property
    def tree(self) -> dict[str, Any]:
        """The values as a mapping file has them."""
        tree: dict[str, Any] = {}
        for key, value in self.values:
            branch, (*above, name) = tree, key.split(".")
            for part in above:
                branch = branch.setdefault(part, {})
            branch[name] = value
        return tree


def is_left_out(tree: Mapping[str, Any]) -> bool:
    """Whether a mapping lacks a unit, or both column and rate of time."""
    return _lacks_time(tree) or any(_lacks_unit(spec) for spec in _signals(tree).values())


def wanted_by(tree: Mapping[str, Any]) -> Wanted:
    """Columns that a mapping asks for, before it is checked; faults are told when it is."""
    patterns = []
    for spec in _signals(tree).values():
        try:
            patterns += [re.compile(str(spec["pattern"]))] if "pattern" in spec else []
        except re.error:
            continue
    return wanted((str(spec["column"]) for spec in _signals(tree).values() if "column" in spec), patterns)


def told_by(table: Table, tree: Mapping[str, Any]) -> Told:
    """What a table tells of what a mapping leaves out.

    Raises:
        UserError: there is no such column, or its header tells no unit; or a column of time that is not named tells
            another rate than stands above the table.
    """
    found = list(_units(table, tree))
    if _lacks_time(tree) and table.rate is not None:
        check_times(table)
        hz, where = table.rate
        line = f"{table.where}: no column of time is named; there are {hz:.6g} samples in a second by '{where}'"
        found.append(("columns.time.rate", f"{hz!r} Hz", line))
    return Told(tuple((key, value) for key, value, _ in found), tuple(line for *_, line in found))


def _units(table: Table, tree: Mapping[str, Any]) -> Iterator[tuple[str, str, str]]:
    for signal, spec in _signals(tree).items():
        if not _lacks_unit(spec):
            continue
        names = _columns(table, spec)
        if signal == "time" and names and all(map(table.has_clock, names)):
            line = f"{table.where}: column '{names[0]}' holds times of a clock, read in s"
            yield "columns.time.unit", "s", line
            continue
        units = {unit_in(table.units[table.index(name)], signal) for name in names}
        unit = units.pop() if len(units) == 1 else None
        if unit is None:
            fault = "tells different units" if units else "tells no unit that is known for it"
            volts = {volts_of(table.units[table.index(name)], signal) for name in names} - {""}
            if volts:
                raise UserError(
                    f"{table.where}: {', '.join(map(repr, names))} {'is' if len(names) == 1 else 'are'} in volts; by "
                    f"columns.{signal}.unit in the mapping or --{signal}-unit give {calibration(signal, volts.pop())}"
                )
            raise UserError(
                f"{table.where}: the header of {', '.join(map(repr, names))} {fault}; give it by columns.{signal}.unit "
                f"in the mapping or --{signal}-unit"
            )
        line = f"{table.where}: column '{names[0]}' is read in {unit}, as its header says"
        yield f"columns.{signal}.unit", unit, line


def _columns(table: Table, spec: Mapping[str, Any]) -> list[str]:
    if "pattern" not in spec:
        return [table.header[table.index(str(spec["column"]))]]
    try:
        pattern = re.compile(str(spec["pattern"]))
    except re.error:
        return []
    names = [name for name in table.header if pattern.fullmatch(name)]
    if not names:
        raise UserError(
            f"{table.where} has no column whose whole name is '{pattern.pattern}'; its columns: "
            f"{', '.join(table.header)}"
        )
    return names


def _signals(tree: Mapping[str, Any]) -> dict[str, Mapping[str, Any]]:
    columns = tree.get("columns")
    if not isinstance(columns, Mapping):
        return {}
    return {key: columns[key] for key in SIGNALS if isinstance(columns.get(key), Mapping)}


def _lacks_unit(spec: Mapping[str, Any]) -> bool:
    return "unit" not in spec and ("column" in spec or "pattern" in spec)


def _lacks_time(tree: Mapping[str, Any]) -> bool:
    return not {"column", "pattern", "rate"} & set(_signals(tree).get("time", ()))
