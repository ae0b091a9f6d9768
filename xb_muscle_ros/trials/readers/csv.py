"""Trials from delimited text, by a mapping of columns and units."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.readers.assembly import trial_of
from xb_muscle_ros.trials.readers.base import Pending, Reader, Recording, Signal, begin_of
from xb_muscle_ros.trials.readers.calcium import PCA_COLUMN, SAME_PCA
from xb_muscle_ros.trials.readers.description import Column, ImportMapping, filled
from xb_muscle_ros.trials.readers.table import Table, looks_like_text, number, read_table
from xb_muscle_ros.trials.trial import Trial

# A column of this name tells trials apart without being asked for.
TRIAL_COLUMN = "trial"
# Time that starts anew comes back to its first value within so many steps, and goes on for so many samples.
_SAME_START_STEPS = 2.0
_LEAST_SAMPLES = 10
_PCA_IN_NAME = re.compile(r"p[ _-]?ca[ _=:-]*(\d+(?:[.,]\d+)?)", re.IGNORECASE)


class CsvReader(Reader):
    """Comma, semicolon or tab separated columns below a header line.

    A file is one trial, unless a column tells trials apart or time starts anew; their names then have the column's
    value, or the number from 1, behind the file's.
    """

    name = "csv"
    suffixes = (".csv", ".tsv")

    def matches(self, path: Path) -> bool:
        """Whether the file is called so or holds text."""
        return super().matches(path) or looks_like_text(begin_of(path))

    def trials(self, path: Path, mapping: ImportMapping) -> Iterator[Pending]:
        """The trials of the table; it is read whole."""
        table = read_table(path, mapping.decimal)
        parts, how = parts_of(table, mapping)
        for i, part in enumerate(parts):
            notices = (*table.notices, *how) if i == 0 else ()
            yield Pending(_name(path, mapping, part), partial(_recording, table, mapping, part, notices))

    def pca(self, path: Path, mapping: ImportMapping) -> float | None:
        """As the file's name or the mapping tells; None where a column does."""
        return None if mapping.calcium is not None else super().pca(path, mapping)


def read_csv(path: Path, mapping: ImportMapping, isometric_scaling: bool | None = None) -> Trial:
    """Read the trial of a file that holds one; see `assembly.trial_of` for what is done to it.

    Raises:
        UserError: a missing column, a cell that is no finite number, several trials, or what `assembly.trial_of`
            refuses.
    """
    pending = list(CsvReader().trials(path, mapping))
    if len(pending) > 1:
        raise UserError(f"{path} holds {len(pending)} trials; import them with xb_muscle import")
    return trial_of(pending[0].read(), mapping, path, isometric_scaling)


def _name(path: Path, mapping: ImportMapping, part: Part) -> str:
    return "_".join(text for text in (filled(mapping.trial, path), part.name) if text)


def _recording(table: Table, mapping: ImportMapping, part: Part, notices: tuple[str, ...]) -> Recording:
    """The columns of one trial in a table."""
    where = f"{table.path}, trial {_name(table.path, mapping, part)}" if part.name else str(table.path)
    facts = mapping.facts_of(table.path)

    def at(i: int) -> str:
        return f"line {table.line(int(part.rows[i]))}"

    def signal(column: Column) -> Signal:
        if column is mapping.time and mapping.rate_hz is not None:
            return Signal(column.name, np.arange(part.rows.size) / mapping.rate_hz, at)
        return Signal(f"column '{column.name}'", table.numbers(column.name)[part.rows], at)

    return Recording(
        where,
        _name(table.path, mapping, part),
        {key: signal(column) for key, column in mapping.columns.items()},
        facts,
        warnings=(*notices, *check_pca(table, mapping, part, facts["pca"])),
    )


class Part(NamedTuple):
    """Rows of one trial.

    Attributes:
        name: what its name has beside the file's; empty where the table is one trial.
        rows: indices, in the order of the file.
    """

    name: str
    rows: npt.NDArray[np.int64]


def parts_of(table: Table, mapping: ImportMapping) -> tuple[list[Part], tuple[str, ...]]:
    """The trials in a table, one for each value of the trial column or each start of time, and a line on the split.

    Raises:
        UserError: the mapping's trial column is missing or has an empty cell.
    """
    parts, how = _by_column(table, mapping) or _by_time(table, mapping) or ([], "")
    if len(parts) < 2:
        return [Part("", np.arange(len(table.rows)))], ()
    return parts, (f"{table.path}: {how}",)


def check_pca(table: Table, mapping: ImportMapping, part: Part, pca: float | None) -> Iterator[str]:
    """Warnings on columns of a given pCa, after making sure that no column tells another than the trial is given.

    Raises:
        UserError: a column of pCa that is not read holds another.
    """
    if mapping.calcium is not None or mapping.activation is not None or pca is None:
        return
    force = "" if mapping.force is None else mapping.force.name
    others = []
    for name in table.header:
        if PCA_COLUMN.match(name):
            _check_column(table, name, part, pca)
        found = _PCA_IN_NAME.search(name)
        if found is None:
            continue
        stated = float(found.group(1).replace(",", "."))
        stated = stated / 10.0 if stated > 12.0 else stated  # 61 is 6.1
        if abs(stated - pca) > SAME_PCA and name == force:
            yield f"{table.path}: the force column is '{name}', but pCa is given as {pca:g}; check both"
        elif abs(stated - pca) > SAME_PCA:
            others.append(f"'{name}'")
    if others:
        yield (
            f"{table.path}: not read, because of another pCa by name: {', '.join(others)}; import the file again for "
            "each, with its --force-column, --pca and --trial"
        )


def _check_column(table: Table, name: str, part: Part, pca: float) -> None:
    texts = table.texts(name)
    values = np.array([number(texts[row], table.decimal) for row in part.rows])
    with np.errstate(invalid="ignore"):
        if not np.all((values >= 1.0) & (values <= 12.0)):
            return  # no pCa
    other = np.flatnonzero(np.abs(values - pca) > SAME_PCA)
    if other.size:
        row = int(part.rows[other[0]])
        raise UserError(
            f"{table.path}, line {table.line(row)}, column '{name}' holds {texts[row]}, but pCa is given as {pca:g} "
            f"for the whole trial; read the column with --calcium-column '{name}' --calcium-unit pCa"
        )


def _by_column(table: Table, mapping: ImportMapping) -> tuple[list[Part], str] | None:
    asked = mapping.trial_column
    name = asked or next((each for each in table.header if each.casefold() == TRIAL_COLUMN), None)
    if name is None:
        return None
    texts = table.texts(name)
    rows: dict[str, list[int]] = {}
    for row, text in enumerate(texts):
        rows.setdefault(text, []).append(row)
    if "" in rows and asked:
        raise UserError(
            f"{table.path}, line {table.line(rows[''][0])}, column '{name}' holds nothing; needed is the name or "
            "number of the trial; fill it in"
        )
    if not asked and (min(map(len, rows.values())) < _LEAST_SAMPLES or "" in rows):
        return None  # it numbers something else
    parts = [Part(text, np.array(each)) for text, each in rows.items()]
    return parts, f"column '{name}' tells {len(rows)} trials apart"


def _by_time(table: Table, mapping: ImportMapping) -> tuple[list[Part], str] | None:
    if mapping.rate_hz is not None:
        return None
    time = table.numbers(mapping.time.name)
    steps = np.diff(time)
    anew = np.flatnonzero(steps <= 0.0) + 1
    if not anew.size or not (steps > 0.0).any():
        return None
    step = float(np.median(steps[steps > 0.0]))
    bounds = [0, *anew.tolist(), time.size]
    if np.any(np.abs(time[anew] - time[0]) > _SAME_START_STEPS * step) or np.min(np.diff(bounds)) < _LEAST_SAMPLES:
        return None  # a clock that steps back; the trial is refused when it is read
    parts = [Part(str(i), np.arange(*pair)) for i, pair in enumerate(itertools.pairwise(bounds), 1)]
    return parts, f"time starts anew in line {table.line(bounds[1])}; the table is {len(parts)} trials"
