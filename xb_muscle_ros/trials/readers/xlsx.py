"""Trials from workbooks (Excel, OpenDocument), by a mapping of columns and units: a sheet is a table."""

from __future__ import annotations

import datetime
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from xb_muscle_ros.errors import UserError, suggest
from xb_muscle_ros.trials.readers.base import begin_of
from xb_muscle_ros.trials.readers.cells import Cell
from xb_muscle_ros.trials.readers.encoding import looks_like_text
from xb_muscle_ros.trials.readers.exports import rate_of
from xb_muscle_ros.trials.readers.layout import LOOKED_AT, Wanted
from xb_muscle_ros.trials.readers.making import head_of, locate, make_table
from xb_muscle_ros.trials.readers.options import ANY_TABLE, Sheets, TableOptions
from xb_muscle_ros.trials.readers.rows import CellRows
from xb_muscle_ros.trials.readers.table import Table
from xb_muscle_ros.trials.readers.tabular import TableReader
from xb_muscle_ros.trials.readers.xlsx_marks import marks_of, read_marks, with_formulas


class XlsxReader(TableReader):
    """Sheets of a workbook. Formulas have the values that the program which saved the file gave them."""

    name = "xlsx"
    suffixes = (".xlsx", ".xlsm", ".xlsb", ".xls", ".ods")
    takes = (*ANY_TABLE, "decimal", "header", "sheet", "blanks")

    def matches(self, path: Path) -> bool:
        """Whether the file is called so; text that some programs call ``.xls`` is none."""
        return super().matches(path) and not looks_like_text(begin_of(path))

    def tables(self, path: Path, options: TableOptions) -> Iterator[Table]:
        """A table for each sheet that is asked for; of several, those that hold no such table are left out and told."""
        with _opened(path) as workbook:
            names = _chosen(path, workbook.sheet_names, options.sheets)
            found: list[Table] = []
            skipped: list[str] = []
            for name in names:
                try:
                    table = _table(path, name, workbook, options)
                    _check(table, options.wanted)
                except UserError as problem:
                    if len(names) == 1:
                        raise
                    skipped.append(str(problem))
                else:
                    found.append(table)
        if not found:
            raise UserError(f"{path}: no sheet holds the table: {skipped[0]}")
        for i, table in enumerate(found):
            lines = [f"left out: {line}" for line in skipped] if i == 0 else []
            own = table.sheet if len(found) > 1 or _by_pattern(options) else ""
            yield table.called(own, lines)


def _by_pattern(options: TableOptions) -> bool:
    return options.sheets is not None and options.sheets.pattern is not None


def _opened(path: Path) -> Any:
    try:
        from python_calamine import CalamineError, load_workbook
    except ImportError:
        raise UserError(
            f"{path} is a workbook, which needs python-calamine; install xb_muscle_ros[files], or save the sheet as CSV"
        ) from None
    try:
        return load_workbook(path)
    except FileNotFoundError as problem:
        raise UserError(f"{path} cannot be read: {problem.strerror}; give a workbook") from problem
    except (CalamineError, OSError) as problem:
        raise UserError(
            f"{path} is no whole workbook ({problem}); save it again without a password, or as CSV"
        ) from None


def _chosen(path: Path, names: Sequence[str], sheets: Sheets | None) -> list[str]:
    if sheets is None:
        return list(names)
    if sheets.pattern is not None:
        found = [name for name in names if sheets.pattern.fullmatch(name)]
        if found:
            return found
        raise UserError(f"{path} has no sheet whose whole name is '{sheets.name}'; its sheets: {', '.join(names)}")
    if sheets.name in names:
        return [sheets.name]
    hint = suggest(sheets.name, names)
    raise UserError(
        f"{path} has no sheet '{sheets.name}'; its sheets: {', '.join(names)}{hint if 'did you mean' in hint else ''}"
    )


def _table(path: Path, name: str, workbook: Any, options: TableOptions) -> Table:
    sheet = workbook.get_sheet_by_name(name)
    marks = marks_of(path, name)
    everything = with_formulas(sheet.to_python(skip_empty_area=False), marks)
    numbers = [i for i, row in enumerate(everything, 1) if any(cell != "" for cell in row)]
    moments = {j for row in everything for j, cell in enumerate(row) if isinstance(cell, datetime.datetime)}
    rows = [_ended([_cell(cell, j in moments) for j, cell in enumerate(everything[i - 1])]) for i in numbers]
    where = f"{path}, sheet '{name}'"
    if not rows:
        raise UserError(f"{where} is empty; needed are a header and rows of numbers")
    first = rows[:LOOKED_AT]
    _, found = locate(where, CellRows.word, numbers, {"": first}, options)
    head = head_of(CellRows.word, numbers, first, found)
    above = [" ".join(str(cell) for cell in row) for row in rows[: found.header or 0]]
    width = len(head.names)
    rows = [[*row, *[""] * (width - len(row))] for row in rows[found.first :]]
    numbers = numbers[found.first :]
    lines = list(read_marks(where, rows, numbers, head, marks))
    body = CellRows(rows, numbers)
    return make_table(path, name, head, body, options, rate=rate_of(above)).called("", lines)


def _check(table: Table, wanted: Wanted) -> None:
    """Make sure that a sheet has the columns asked for."""
    for name in sorted(wanted.names):
        table.index(name)
    for pattern in wanted.patterns:
        if not any(map(pattern.fullmatch, table.header)):
            raise UserError(f"{table.where} has no column whose whole name is '{pattern.pattern}'")


def _ended(row: list[Cell]) -> list[Cell]:
    """A row without the empty cells at its end."""
    while row and row[-1] == "":
        row.pop()
    return row


def _cell(value: Any, moment: bool) -> Cell:
    """A number or text; times and dates are written as clocks show them.

    Args:
        moment: the column holds dates with times: one without is midnight.
    """
    if isinstance(value, bool):
        return float(value)
    if isinstance(value, (int, float)):
        return float(value)
    if isinstance(value, datetime.datetime):
        return value.isoformat(" ")
    if isinstance(value, datetime.timedelta):
        seconds = value.total_seconds()
        return f"{int(seconds // 3600)}:{int(seconds % 3600 // 60):02}:{seconds % 60:09.6f}"
    if isinstance(value, datetime.date):
        return f"{value.isoformat()} 00:00:00" if moment else value.isoformat()
    if isinstance(value, datetime.time):
        return value.isoformat("microseconds")
    return str(value)
