"""A table made of rows of cells, wherever they come from: its header is found, and what was found is told."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.readers.cells import COMMA, Cell, number
from xb_muscle_ros.trials.readers.layout import Found, at_header, find, header_units, names_of
from xb_muscle_ros.trials.readers.options import NO_HEADER, TableOptions
from xb_muscle_ros.trials.readers.rows import SPACES, Rows
from xb_muscle_ros.trials.readers.table import Table, decimal_of

BY_NUMBER = "a header line that names the columns, or columns by their number (column: 1, with 'header: none')"


class Head(NamedTuple):
    """What stands above the rows of a table.

    Attributes:
        names: of the columns.
        units: of each column, as told; empty where nothing is.
        notices: how they were found, without the name of the table.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    notices: tuple[str, ...] = ()


def locate(
    where: str, word: str, numbers: Sequence[int], splits: Mapping[str, Sequence[Sequence[Cell]]], options: TableOptions
) -> tuple[str, Found]:
    """The best of several ways to split the first rows into cells, and where the header is.

    Args:
        where, word: the table, and what a row is called, for messages.
        numbers: of the rows in the file.
        splits: the first rows by what separates their cells, in order of preference.

    Raises:
        UserError: there is no header, though columns go by name, or the header that was told is not there.
    """
    found: dict[str, Found] = {}
    for mark, rows in splits.items():
        there = _told(where, word, numbers, rows, options.header) if options.header else find(rows, options.wanted)
        if there is not None:
            found[mark] = there
    if found:
        mark = max(found, key=lambda each: found[each].sure)
        if found[mark].header is not None or options.header == NO_HEADER or options.wanted.only_numbers:
            return mark, found[mark]
        raise UserError(f"{where}, {word} {numbers[found[mark].first]} holds numbers; needed is {BY_NUMBER}")
    marks = [each for each in splits if each != SPACES and len(splits[each][0]) > 1] or [*splits]
    mark = max(marks, key=lambda each: len(splits[each][0]))
    first = splits[mark][0]
    if all(np.isfinite(number(cell)) or np.isfinite(number(cell, COMMA)) for cell in first):
        raise UserError(f"{where}, {word} {numbers[0]} holds numbers; needed is {BY_NUMBER}")
    return mark, Found(0, None, 1)


def head_of(word: str, numbers: Sequence[int], rows: Sequence[Sequence[Cell]], found: Found) -> Head:
    """Names and units of the columns of a table whose parts are known."""
    names, joined = names_of(rows, found)
    notices = []
    if found.header is None:
        notices.append(
            f"there is no header; columns go by their number, and rows begin in {word} {numbers[found.first]}"
        )
    elif found.header:
        notices.append(f"{word} {numbers[found.header]} names the columns; what is above is no part of the table")
    if joined:
        notices.append(joined)
    row = None if found.units is None else rows[found.units]
    if found.units is not None and row is not None:
        told = ", ".join(str(cell).strip() for cell in row if str(cell).strip())
        notices.append(f"{word} {numbers[found.units]} holds units: {told}")
    return Head(names, header_units(names, row), tuple(notices))


def make_table(
    path: Path,
    sheet: str,
    head: Head,
    rows: Rows,
    options: TableOptions,
    notices: Iterable[str] = (),
    starts: tuple[int, ...] = (0,),
    rate: tuple[float, str] | None = None,
) -> Table:
    """A table, once its head and its rows are known.

    Args:
        notices: lines on what was found before.

    Raises:
        UserError: there are no rows, rows are longer than the header, or the decimal mark cannot be told.
    """
    table = Table(path, head.names, rows, units=head.units, starts=starts, rate=rate, sheet=sheet)
    if not len(rows):
        raise UserError(f"{table.where} has a header {rows.word} but no rows; needed are rows of numbers")
    mark, found = (options.decimal, "") if options.decimal else decimal_of(table.where, rows)
    comments = _check_lengths(table, mark)
    lines = [*notices, *(f"{table.where}: {line}" for line in (*head.notices, comments) if line), found]
    return Table(path, head.names, rows, mark, tuple(filter(None, lines)), head.units, starts, rate, sheet)


def _told(where: str, word: str, numbers: Sequence[int], rows: Sequence[Sequence[Cell]], header: str) -> Found:
    """The parts of a table whose header the user tells."""
    if header == NO_HEADER:
        return at_header(rows, None)
    if int(header) not in numbers[: len(rows)]:
        raise UserError(
            f"{where}: header is {word} {header}, which is empty or a comment, or beyond the first {len(rows)} "
            f"{word}s; give the {word} that names the columns"
        )
    return at_header(rows, numbers.index(int(header)))


def _check_lengths(table: Table, decimal: str) -> str:
    """Cells beyond the header have shifted others: decimal commas between commas, say. Comments may stand there."""
    width, rows = len(table.header), table.rows
    matrix = rows.matrix(decimal)
    if matrix is not None and matrix.shape[1] <= width:
        return ""
    comments = []
    for row, cells in enumerate(rows.cells):
        beyond = [str(cell).strip() for cell in cells[width:] if str(cell).strip()] if len(cells) > width else []
        if len(beyond) == 1 and beyond[0].startswith("#"):
            comments.append(row)
        elif beyond:
            raise UserError(
                f"{table.where}, {table.place(row)} has {len(cells)} cells, the header {width}; decimal commas need "
                "another delimiter (semicolon or tab), and every column a name; export it again"
            )
    return (
        f"comments in {len(comments)} {rows.word}s, first in {table.place(comments[0])}, are no numbers"
        if comments
        else ""
    )
