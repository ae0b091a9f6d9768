"""Trials from tables, whatever these stand in, by a mapping of columns and units."""

from __future__ import annotations

import abc
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from xb_muscle_ros.trials.readers import blanks
from xb_muscle_ros.trials.readers.base import Pending, Reader, Recording, Signal
from xb_muscle_ros.trials.readers.contents import Contents
from xb_muscle_ros.trials.readers.description import FACTS, ImportMapping, fact_of, filled
from xb_muscle_ros.trials.readers.left_out import Told, is_left_out, told_by, wanted_by
from xb_muscle_ros.trials.readers.length import L0_RANGE_M
from xb_muscle_ros.trials.readers.options import DEFAULTS, TableOptions, read_options, wanted
from xb_muscle_ros.trials.readers.parts import Part, parts_of
from xb_muscle_ros.trials.readers.pca_columns import check_pca
from xb_muscle_ros.trials.readers.rates import other_rate, rate_warning
from xb_muscle_ros.trials.readers.table import Table, taken
from xb_muscle_ros.trials.readers.table_contents import table_contents
from xb_muscle_ros.trials.readers.tree import Keys
from xb_muscle_ros.trials.readers.units import UNITS, calibration, unit_in, volts_of
from xb_muscle_ros.trials.trial import Array


class TableReader(Reader):
    """A file is one or more tables, each of one trial or several.

    Names of trials have the table's own name, and what tells its trials apart, behind the file's.
    """

    tells = True

    @abc.abstractmethod
    def tables(self, path: Path, options: TableOptions) -> Iterator[Table]:
        """The tables of a file.

        Raises:
            UserError: it cannot be read, or holds none.
        """

    def trials(self, path: Path, mapping: ImportMapping) -> Iterator[Pending]:
        """The trials of each table; a table is read whole."""
        named = [column.name for column in mapping.columns.values() if column.pattern is None]
        named = [name for name in named if name != mapping.time.name or mapping.rate_hz is None]
        named += [mapping.trial_column] if mapping.trial_column is not None else []
        patterns = [column.pattern for column in mapping.columns.values() if column.pattern is not None]
        told = mapping.told
        for table in self.tables(path, mapping.table._replace(wanted=wanted(named, patterns))):
            parts, how = parts_of(table, mapping)
            for i, part in enumerate(parts):
                notices = (*table.notices, *told, *how, *_unit_doubts(table, mapping, part)) if i == 0 else ()
                told = ()
                name = _name(table, mapping, part)
                yield Pending(name, partial(_recording, table, mapping, part, notices))

    def told(self, path: Path, tree: Mapping[str, Any]) -> Told:
        """Units and rate by the first table's header, where the mapping leaves them out."""
        if not is_left_out(tree):
            return Told()
        options = read_options(Keys(tree, "mapping"), FACTS)._replace(wanted=wanted_by(tree))
        return told_by(next(self.tables(path, options)), tree)

    def contents(self, path: Path) -> Contents:
        """The columns of the first table."""
        return table_contents(path, self.tables(path, DEFAULTS))

    def pca(self, path: Path, mapping: ImportMapping) -> float | None:
        """As the file's name or the mapping tells; None where a column does."""
        return None if mapping.calcium is not None else super().pca(path, mapping)


def _name(table: Table, mapping: ImportMapping, part: Part) -> str:
    return "_".join(text for text in (filled(mapping.trial, table.path), table.name, part.name) if text)


def _recording(table: Table, mapping: ImportMapping, part: Part, notices: tuple[str, ...]) -> Recording:
    """The columns of one trial in a table."""
    name = _name(table, mapping, part)
    where = f"{table.where}, trial {name}" if part.name else table.where

    def at(i: int) -> str:
        return table.place(int(part.rows[i]))

    time, clock = _time(table, mapping, part)
    signals = {
        "time": Signal(f"column '{part.columns['time']}'" if mapping.rate_hz is None else mapping.time.name, time, at)
    }
    lines = [f"{where}: {line}" for line in (part.end, clock) if line]
    for key in mapping.columns:
        if key != "time":
            column = part.columns[key]
            values, filled_in = _values(table, mapping, part, column, time)
            signals[key] = Signal(f"column '{column}'", values, at)
            lines += [f"{where}, column '{column}': {filled_in}"] if filled_in else []
    lines += _rate_doubts(table, mapping, time)
    facts = {**mapping.facts_of(table.path), **_sheet_facts(table, mapping), **part.facts}
    return Recording(
        where,
        name,
        signals,
        facts,
        notes=tuple(line.removeprefix(f"{where}, ") for line in lines if "filled" in line),
        warnings=(*notices, *lines, *check_pca(table, mapping, part, facts["pca"])),
    )


def _time(table: Table, mapping: ImportMapping, part: Part) -> tuple[Array, str]:
    """Times in the unit of the mapping, and a line on how they were read where they are those of a clock."""
    if mapping.rate_hz is not None:
        return np.arange(part.rows.size) / mapping.rate_hz, ""
    column = part.columns["time"]
    values, is_clock = table.times(column, part.rows)
    if not is_clock:
        return values, ""
    first = table.text(column, int(part.rows[0]))
    line = f"column '{column}' holds times of a clock; '{first}' is read as {values[0]:.9g} s"
    return values / mapping.time.unit.factor, line


def _rate_doubts(table: Table, mapping: ImportMapping, time: Array) -> tuple[str, ...]:
    """A line where another rate stands above the table than that of the times."""
    if table.rate is None:
        return ()
    hz, line = table.rate
    if mapping.rate_hz is None:
        return rate_warning(table.where, hz, time * mapping.time.unit.factor)
    if other_rate(hz, time) is None:
        return ()
    return (f"{table.where}: there are {hz:g} samples in a second by '{line}', {mapping.rate_hz:g} are taken",)


def _values(table: Table, mapping: ImportMapping, part: Part, column: str, time: Array) -> tuple[Array, str]:
    """Values of a signal, and a line on blanks that were filled.

    Raises:
        UserError: blanks that are too many, or at the begin or end.
    """
    values, blank = table.samples(column, part.ragged)
    values, blank = taken(values, part.rows), taken(blank, part.rows)
    if not blank.any():
        return values, ""
    told_s = mapping.table.longest_blank_s
    longest_s = blanks.LONGEST_S if told_s is None else told_s
    time_s = time * mapping.time.unit.factor
    long = blanks.too_long(blank, time_s, longest_s)
    if long.any():
        bad = np.zeros(len(table.rows), bool)
        bad[part.rows[long]] = True
        ends = bool(long[0] or long[-1])
        more = "at the begin or the end are not filled; remove them" if ends else "are filled"
        remedy = (
            f"blank samples {more}"
            if ends
            else (
                f"blanks of up to {1e3 * longest_s:g} ms {more}; allow longer ones by blanks.longest (--longest-blank "
                "'20 ms'), or remove them"
            )
        )
        table.refuse(column, bad, remedy)
    return blanks.fill(values, blank, time_s), blanks.told(blank, time_s)


def _sheet_facts(table: Table, mapping: ImportMapping) -> dict[str, float]:
    sheets = mapping.table.sheets
    match = None if sheets is None or sheets.pattern is None else sheets.pattern.fullmatch(table.sheet)
    if sheets is None or match is None:
        return {}
    found = {fact: text for fact, text in match.groupdict().items() if text is not None}
    return {fact: fact_of(text, sheets.factors.get(fact, 1.0), fact, table.where) for fact, text in found.items()}


def _may_be(table: Table, column: str, unit: str) -> bool:
    """Whether a column may be in a unit: a length near 1 m is no muscle's, but L0 as it is kept where it is 1 m."""
    if UNITS[unit].kind != "length":
        return True
    values, _ = table.samples(column, ragged=True)
    return not float(np.nanmedian(values)) * UNITS[unit].factor > L0_RANGE_M[1]


def _unit_doubts(table: Table, mapping: ImportMapping, part: Part) -> Iterator[str]:
    """Lines on columns whose header tells another unit than the mapping."""
    for key, column in mapping.columns.items():
        if key == "time" and mapping.rate_hz is not None:
            continue
        name = part.columns[key]
        unit = table.units[table.index(name)] if table.units else ""
        volts = volts_of(unit, key)
        if volts and volts != column.unit.per:
            yield (
                f"{table.where}: column '{name}' is read in {column.unit_name}, but its header tells {volts}; by "
                f"columns.{key}.unit (--{key}-unit) give {calibration(key, volts)}"
            )
        told = unit_in(unit, key)
        if told is not None and UNITS[told] != column.unit and key != "calcium" and _may_be(table, name, told):
            yield (
                f"{table.where}: column '{name}' is read in {column.unit_name}, but its header tells {told}; check "
                f"columns.{key}.unit (--{key}-unit)"
            )
