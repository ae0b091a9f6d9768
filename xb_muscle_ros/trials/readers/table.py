"""A table: columns of numbers by name; every complaint names the row and the column."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.errors import UserError, suggest
from xb_muscle_ros.trials.readers.cells import (
    COMMA,
    FORMULA,
    POINT,
    WORKED_OUT,
    Cell,
    clock_seconds,
    is_blank,
    is_clock,
    is_grouped,
    with_comma,
    with_point,
)
from xb_muscle_ros.trials.readers.layout import plain
from xb_muscle_ros.trials.readers.rows import Rows
from xb_muscle_ros.trials.trial import Array

Places = npt.NDArray[np.bool_]
Indices = npt.NDArray[np.int64]
_Value = TypeVar("_Value", bound=np.generic)


@dataclass(frozen=True)
class Table:
    """A table as it stands in a file.

    Attributes:
        path: the file.
        header: names of the columns; numbers from 1 where the table has none.
        rows: what is below.
        decimal: `cells.POINT` or `cells.COMMA`.
        notices: what was found of encoding, header and decimal mark, one line each.
        units: what is told of the unit of each column; empty where nothing is.
        starts: first rows of blocks, each a trial; the first is 0.
        rate: samples in a second and where that is told, where it is and is the same for all blocks.
        sheet: the sheet of a workbook.
        name: what names of its trials have of the table's own; empty where the file has no other.
    """

    path: Path
    header: tuple[str, ...]
    rows: Rows
    decimal: str = POINT
    notices: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    starts: tuple[int, ...] = (0,)
    rate: tuple[float, str] | None = None
    sheet: str = ""
    name: str = ""

    @property
    def where(self) -> str:
        """The table, for messages."""
        return f"{self.path}, sheet '{self.sheet}'" if self.sheet else str(self.path)

    def place(self, row: int) -> str:
        """A row (from 0), for messages, by its number in the file (from 1)."""
        return f"{self.rows.word} {self.rows.number(row)}"

    def called(self, name: str, lines: Iterable[str]) -> Table:
        """The same with a name of its own, and with lines on other tables of the file."""
        return replace(self, name=name, notices=(*lines, *self.notices))

    def index(self, column: str) -> int:
        """Place of a column, by its name or else by its number from 1.

        Raises:
            UserError: no such column, or several.
        """
        wanted = plain(column)
        found = [i for i, name in enumerate(self.header) if plain(name) == wanted]
        if len(found) == 1:
            return found[0]
        if found:
            numbers = " or ".join(str(i + 1) for i in found)
            raise UserError(
                f"{self.where} has more than one column '{column}'; rename one, or give its number: {numbers}"
            )
        if wanted.isdecimal() and 1 <= int(wanted) <= len(self.header):
            return int(wanted) - 1
        hint = suggest(column, self.header)
        raise UserError(
            f"{self.where} has no column '{column}'; its columns: {', '.join(self.header)}"
            f"{hint if 'did you mean' in hint else ''}"
        )

    def texts(self, column: str) -> Iterator[str]:
        """Cells of a column without blanks around them.

        Raises:
            UserError: no such column.
        """
        place = self.index(column)
        return (_text(cells, place) for cells in self.rows.cells)

    def text(self, column: str, row: int) -> str:
        """One of them."""
        return _text(self.rows.cells[row], self.index(column))

    def numbers(self, column: str) -> Array:
        """Values of a column, shape (rows,).

        Raises:
            UserError: no such column, or a cell that is missing or no finite number.
        """
        values, blank = self.samples(column)
        if blank.any():
            self.refuse(column, blank)
        return values

    def samples(self, column: str, ragged: bool = False) -> tuple[Array, Places]:
        """Values of a column, not finite where a cell is blank, and where that is; shape (rows,) each.

        Args:
            ragged: cells that are missing, because a row is short, are blank.

        Raises:
            UserError: no such column, or a cell that is neither blank nor a finite number.
        """
        values = self.rows.column(self.index(column), self.decimal)
        bad, blank = ~np.isfinite(values), np.isnan(values)
        if blank.any() and self.rows.matrix(self.decimal) is None:
            place, rows = self.index(column), self.rows.cells
            cells = [next(iter(rows[i][place:]), "" if ragged else None) for i in np.flatnonzero(blank)]
            blank[blank] = [cell is not None and is_blank(cell) for cell in cells]
        if not np.array_equal(bad, blank):
            self.refuse(column, bad)
        return values, blank

    def times(self, column: str, rows: Indices) -> tuple[Array, bool]:
        """Values of a column of time in some rows, and whether they are s because its cells are times of a clock.

        Raises:
            UserError: as for `numbers`, or a date that cannot be read.
        """
        if self.has_clock(column):
            return self._clock(column, rows), True
        values, blank = self.samples(column, ragged=True)  # missing times are refused here
        if taken(blank, rows).any():
            missing = np.zeros_like(blank)
            missing[rows] = blank[rows]
            self.refuse(column, missing)
        return taken(values, rows), False

    def has_clock(self, column: str) -> bool:
        """Whether the first cell of a column is the time of a clock."""
        return self.rows.matrix(self.decimal) is None and is_clock(self.text(column, 0))

    def refuse(self, column: str, bad: Places, allowed: str = "") -> None:
        """Refuse a column.

        Args:
            bad: the cells at fault.
            allowed: what would allow them.

        Raises:
            UserError: always, naming the first of them.
        """
        first = int(np.argmax(bad))
        run = int(np.argmin(bad[first:])) or bad.size - first
        text = self.text(column, first)
        more = f" (a run of {run} {self.rows.word}s)" if run > 1 else ""
        if int(bad.sum()) > run:
            more += f"; so do {int(bad.sum()) - run} further {self.rows.word}s"
        remedy = f"needed is a finite number; mend or remove the {self.rows.word}"
        if text == FORMULA:
            remedy = WORKED_OUT
        elif allowed:
            remedy = f"needed is a finite number; {allowed}"
        elif bool(bad.all()) and not text:
            remedy = "name another column"
            if self.rate is not None:
                remedy += (
                    f", or none for the time: there are {self.rate[0]:.6g} samples in a second by '{self.rate[1]}'"
                )
        elif run > 1 and not text:
            remedy = f"needed is a finite number; remove these {self.rows.word}s, or fill them in where the signal is "
            remedy += "known"
        elif is_grouped(text):
            remedy = "thousands separators are not read; export the numbers without them"
        elif "," in text and self.decimal == POINT:
            remedy = "if that is a decimal comma, give --decimal comma; else mend or remove the line"
        found = text if text == FORMULA else f"'{text}'" if text else "nothing"
        raise UserError(f"{self.where}, {self.place(first)}, column '{column}' holds {found}{more}; {remedy}")

    def _clock(self, column: str, rows: Indices) -> Array:
        asked = np.zeros(len(self.rows), bool)
        asked[rows] = True
        seconds = clock_seconds(itertools.compress(self.texts(column), asked))
        if seconds is not None:
            return seconds
        wrong = next((row for row in rows.tolist() if not is_clock(self.text(column, row))), None)
        if wrong is None:
            raise UserError(
                f"{self.where}, column '{column}': dates change and are not written as 2026-11-30; write them so, or "
                "leave the column out and give the rate of the samples (--rate '1000 Hz')"
            )
        text = self.text(column, wrong)
        found = f"'{text}'" if text else "nothing"
        raise UserError(
            f"{self.where}, {self.place(wrong)}, column '{column}' holds {found}; needed is the time of a clock such "
            f"as '{self.text(column, int(rows[0]))}'; mend or remove the {self.rows.word}"
        )


def _text(cells: Sequence[Cell], place: int) -> str:
    cell = cells[place] if place < len(cells) else ""
    return cell.strip() if isinstance(cell, str) else f"{cell:.12g}"


def taken(values: npt.NDArray[_Value], rows: Indices) -> npt.NDArray[_Value]:
    """Values of some rows, ascending; those of rows that follow each other are no copy."""
    if rows.size and int(rows[-1]) - int(rows[0]) + 1 == rows.size:
        return values[int(rows[0]) : int(rows[-1]) + 1]
    return values[rows]


def decimal_of(where: str, rows: Rows) -> tuple[str, str]:
    """The decimal mark that cells show, and a line on it where it is the comma.

    Raises:
        UserError: both marks occur, or every comma may be one of thousands.
    """
    if rows.matrix(POINT) is not None:
        return POINT, ""
    comma = with_comma(rows.holding(","))
    if comma is None:
        return POINT, ""
    point = with_point(rows.holding("."))
    if point is not None:
        raise UserError(
            f"{where}, {rows.word} {comma[0]} holds '{comma[1]}', {rows.word} {point[0]} '{point[1]}': decimal commas "
            "and points in one file; tell which mark is that of decimals by --decimal comma or --decimal point"
        )
    sure = with_comma(rows.holding(","), sure=True)
    line, text = sure or comma
    if sure is None:
        raise UserError(
            f"{where}, {rows.word} {line} holds '{text}', which is {text.replace(',', '.')} or "
            f"{text.replace(',', '')}; tell which by --decimal comma, or export the numbers without "
            "thousands separators"
        )
    return COMMA, f"{where} has decimal commas: '{text}' in {rows.word} {line} is read as {text.replace(',', '.')}"
