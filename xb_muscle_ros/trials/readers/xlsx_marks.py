"""Cells of a workbook that are not what their values say: formulas that nobody worked out, and percent."""

from __future__ import annotations

import zipfile
from collections import defaultdict
from collections.abc import Collection, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree import ElementTree

from xb_muscle_ros.trials.readers.cells import FORMULA, WORKED_OUT, Cell
from xb_muscle_ros.trials.readers.making import Head
from xb_muscle_ros.trials.readers.xlsx_cells import Seen, seen_in_excel
from xb_muscle_ros.trials.readers.xlsx_ods import CONTENT, seen_in_ods


class Marks(NamedTuple):
    """Rows of such cells by their columns, from 0.

    Attributes:
        unknown: with a formula that nobody worked out.
        formulas: with a formula and its value.
        percent: with a number that is shown as percent.
    """

    unknown: defaultdict[int, set[int]]
    formulas: defaultdict[int, set[int]]
    percent: defaultdict[int, set[int]]


def marks_of(path: Path, sheet: str) -> Marks:
    """Such cells of a sheet; none where the workbook is of a kind that is not looked into (``.xls``, ``.xlsb``)."""
    marks = Marks(defaultdict(set), defaultdict(set), defaultdict(set))
    for cell in _seen(path, sheet):
        if cell.formula:
            (marks.formulas if cell.value else marks.unknown)[cell.column].add(cell.row)
        if cell.percent:
            marks.percent[cell.column].add(cell.row)
    return marks


def with_formulas(rows: Sequence[Sequence[Any]], marks: Marks) -> list[list[Any]]:
    """Rows of a sheet from its first cell on, with `FORMULA` in cells whose formula nobody worked out."""
    found = [list(row) for row in rows]
    for column, places in marks.unknown.items():
        for row in places:
            found += [[] for _ in range(row + 1 - len(found))]
            found[row] += [""] * (column + 1 - len(found[row]))
            found[row][column] = FORMULA
    return found


def read_marks(where: str, rows: list[list[Cell]], numbers: Sequence[int], head: Head, marks: Marks) -> Iterator[str]:
    """Bring cells that show percent to what their unit is, and tell of them and of formulas that all give 0.

    Args:
        rows, numbers: below the header, as wide as it is; numbers are those in the sheet, from 1. Rows are changed.
    """
    for j, name in enumerate(head.names):
        if j in marks.formulas:
            given = [row[j] for row, number in zip(rows, numbers, strict=True) if number - 1 in marks.formulas[j]]
            if given and all(value == 0.0 for value in given):
                line = f"all {len(given)} formulas of column '{name}' have the value 0"
                yield f"{where}: {line}; if that is wrong, {WORKED_OUT}"
        if j in marks.percent:
            yield from _read_percent(where, rows, numbers, head, j, marks.percent[j])


def _read_percent(
    where: str, rows: list[list[Cell]], numbers: Sequence[int], head: Head, j: int, percent: Collection[int]
) -> Iterator[str]:
    """Column by column; the header of one tells whether 5 % is 5."""
    cells = [(row, number - 1 in percent) for row, number in zip(rows, numbers, strict=True)]
    cells = [(row, shown) for row, shown in cells if not isinstance(row[j], str)]
    those = [row for row, shown in cells if shown]
    if not those:
        return
    others = len(cells) - len(those)
    count = f"{len(those)} of {len(cells)} cells" if others else "cells"
    shown = f"{where}: {count} of column '{head.names[j]}' show percent"
    rest = f"; the other {others} are read as they stand" if others else ""
    if "%" not in head.names[j] and not (head.units and "%" in head.units[j]):
        yield f"{shown}, and have no % in the header: 5 % is read as 0.05{rest}"
        return
    for row in those:
        row[j] = float(f"{100.0 * float(row[j]):.15g}")
    yield f"{shown}, as its header says: 5 % is read as 5{rest}"


def _seen(path: Path, sheet: str) -> Iterator[Seen]:
    try:
        with zipfile.ZipFile(path) as archive:
            yield from (seen_in_ods if CONTENT in archive.namelist() else seen_in_excel)(archive, sheet)
    except (zipfile.BadZipFile, KeyError, ElementTree.ParseError, OSError):
        return
