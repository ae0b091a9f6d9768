"""The trials of a table: below each other, beside each other, or both."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.readers.description import ImportMapping
from xb_muscle_ros.trials.readers.side_by_side import Aside, columns_of
from xb_muscle_ros.trials.readers.table import Indices, Table
from xb_muscle_ros.trials.trial import Array

# A column of this name tells trials apart without being asked for.
TRIAL_COLUMN = "trial"
# Time that starts anew comes back to its first value within so many steps, and goes on for so many samples.
_SAME_START_STEPS = 2.0
_LEAST_SAMPLES = 10


class Part(NamedTuple):
    """What belongs to one trial.

    Attributes:
        name: what its name has beside the file's; empty where the table is one trial.
        rows: indices, in the order of the file.
        columns: name of the column of each signal.
        facts: what the names of its columns tell.
        ragged: whether other trials are beside it, so that rows may end before its columns.
        end: a line on blank rows below it that are left out; empty where there are none.
    """

    name: str
    rows: Indices
    columns: Mapping[str, str]
    facts: Mapping[str, float]
    ragged: bool = False
    end: str = ""


def parts_of(table: Table, mapping: ImportMapping) -> tuple[list[Part], tuple[str, ...]]:
    """The trials in a table, and lines on how they are distinguished.

    Rows are split by the trial column, by blocks of the file, or by time that starts anew; columns by patterns.

    Raises:
        UserError: the mapping's trial column is missing or has an empty cell, or patterns do not fit the columns.
    """
    asides = columns_of(table, mapping)
    rows, how = _rows(table, mapping, asides)
    lines = [how] if len(rows) > 1 else []
    if len(asides) > 1 or asides[0].name:
        lines.append(f"columns are those of {len(asides)} trials: {', '.join(each.name for each in asides)}")
    parts = []
    for (name, indices), aside in itertools.product(rows, asides):
        kept, end = _ended(table, aside, indices)
        label = "_".join(filter(None, (name, aside.name)))
        parts.append(Part(label, kept, aside.columns, aside.facts, bool(aside.name), end))
    return parts, tuple(f"{table.where}: {line}" for line in lines)


def _rows(table: Table, mapping: ImportMapping, asides: list[Aside]) -> tuple[list[tuple[str, Indices]], str]:
    """Rows of trials that are below each other, with what their names have, and how they are distinguished."""
    everything = np.arange(len(table.rows))
    found = _by_column(table, mapping)
    if found is None and len(table.starts) > 1:
        bounds = [*table.starts, everything.size]
        found = _numbered(bounds), f"the table has {len(table.starts)} blocks, a trial each"
    found = found or _by_time(table, mapping, asides[0].columns["time"], everything)
    if found is None or len(found[0]) < 2:
        return [("", everything)], ""
    return found


def _numbered(bounds: list[int]) -> list[tuple[str, Indices]]:
    return [(str(i), np.arange(*pair)) for i, pair in enumerate(itertools.pairwise(bounds), 1)]


def _by_column(table: Table, mapping: ImportMapping) -> tuple[list[tuple[str, Indices]], str] | None:
    asked = mapping.trial_column
    name = asked or next((each for each in table.header if each.casefold() == TRIAL_COLUMN), None)
    if name is None:
        return None
    numbers: dict[str, int] = {}  # of values, in the order in which they come first
    found = (numbers.setdefault(text, len(numbers)) for text in table.texts(name))
    codes = np.fromiter(found, np.int32, len(table.rows))
    values = list(numbers)
    empty = np.flatnonzero(codes == numbers.get("", -1))
    if empty.size and asked:
        raise UserError(
            f"{table.where}, {table.place(int(empty[0]))}, column '{name}' holds nothing; needed is the name or "
            "number of the trial; fill it in"
        )
    if not asked and (empty.size or np.min(np.bincount(codes)) < _LEAST_SAMPLES):
        return None  # it numbers something else
    blocks = np.split(np.arange(codes.size), np.flatnonzero(codes[1:] != codes[:-1]) + 1)
    if len(blocks) == len(values) or min(block.size for block in blocks) < _LEAST_SAMPLES:
        by_value = [(value, np.flatnonzero(codes == code)) for value, code in numbers.items()]
        return by_value, f"column '{name}' tells {len(values)} trials apart"
    begins = [values[codes[block[0]]] for block in blocks]
    return list(_repeated(begins, blocks)), (
        f"column '{name}' tells {len(blocks)} trials apart: {_again(begins)}, each time a trial of its own"
    )


def _repeated(begins: list[str], blocks: list[Indices]) -> Iterator[tuple[str, Indices]]:
    """Blocks of one value, a trial each; the second of a value and those after it have their number behind it."""
    seen: dict[str, int] = {}
    for value, block in zip(begins, blocks, strict=True):
        seen[value] = seen.get(value, 0) + 1
        yield (value if seen[value] == 1 else f"{value}_{seen[value]}"), block


def _again(begins: list[str]) -> str:
    often = {value: begins.count(value) for value in dict.fromkeys(begins) if begins.count(value) > 1}
    return ", ".join(f"'{value}' comes {count} times" for value, count in often.items())


def _by_time(
    table: Table, mapping: ImportMapping, column: str, everything: Indices
) -> tuple[list[tuple[str, Indices]], str] | None:
    if mapping.rate_hz is not None or mapping.time.pattern is not None:
        return None
    bounds = bounds_of_runs(table.times(column, everything)[0])
    if bounds is None:
        return None
    parts = _numbered(bounds)
    return parts, f"time starts anew in {table.place(bounds[1])}; the table is {len(parts)} trials"


def bounds_of_runs(time: Array) -> list[int] | None:
    """Where runs of time that starts anew begin, and the end; None where it does not, or is a clock that steps back."""
    steps = np.diff(time)
    anew = np.flatnonzero(steps <= 0.0) + 1
    if not anew.size or not (steps > 0.0).any():
        return None
    step = float(np.median(steps[steps > 0.0]))
    bounds = [0, *anew.tolist(), time.size]
    if np.any(np.abs(time[anew] - time[0]) > _SAME_START_STEPS * step) or np.min(np.diff(bounds)) < _LEAST_SAMPLES:
        return None  # a clock that steps back; the trial is refused when it is read
    return bounds


def _ended(table: Table, aside: Aside, rows: Indices) -> tuple[Indices, str]:
    """Rows down to where the columns of a trial beside others end, and a line on it; others are longer."""
    if not aside.name or not rows.size:
        return rows, ""
    blank = np.ones(rows.size, bool)
    for column in aside.own:
        blank &= table.samples(column, ragged=True)[1][rows]
    filled = np.flatnonzero(~blank)
    end = int(filled[-1]) + 1 if filled.size else 0
    if end == rows.size:
        return rows, ""
    if end == 0:
        raise UserError(
            f"{table.where}: the columns of trial '{aside.name}' hold nothing; leave them out of the pattern"
        )
    return rows[:end], f"trial '{aside.name}' ends in {table.place(int(rows[end - 1]))}, others go on"
