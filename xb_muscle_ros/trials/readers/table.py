"""Tables of numbers in delimited text, with a header line; every complaint names the row and the column."""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from xb_muscle_ros.errors import UserError, suggest
from xb_muscle_ros.trials.trial import Array

_DELIMITERS = "\t;,"


@dataclass(frozen=True)
class Table:
    """A table as text: ``header`` names the columns, ``rows`` pairs line numbers (from 1) with cells."""

    path: Path
    header: tuple[str, ...]
    rows: tuple[tuple[int, tuple[str, ...]], ...]

    def line(self, row: int) -> int:
        """Line number in the file (from 1) of a row (from 0)."""
        return self.rows[row][0]

    def numbers(self, column: str) -> Array:
        """Values of a column, shape (rows,).

        Raises:
            UserError: no such column, or a cell that is missing or no finite number.
        """
        if column not in self.header:
            raise UserError(
                f"{self.path} has no column '{column}'; its columns: {', '.join(self.header)}"
                f"{_hint(column, self.header)}"
            )
        index = self.header.index(column)
        texts = [cells[index].strip() if index < len(cells) else "" for _, cells in self.rows]
        values: Array = np.array([_number(text) for text in texts])
        bad = ~np.isfinite(values)
        if bad.any():
            first = int(np.argmax(bad))
            run = int(np.argmin(bad[first:])) or bad.size - first
            found = f"'{texts[first]}'" if texts[first] else "nothing"
            more = f" (a run of {run} lines)" if run > 1 else ""
            raise UserError(
                f"{self.path}, line {self.line(first)}, column '{column}' holds {found}{more}; needed is a finite "
                "number; mend or remove the line"
            )
        return values


def read_table(path: Path) -> Table:
    """Read delimited text: comma, semicolon or tab, told by the header line; lines that begin with # are comments.

    Raises:
        UserError: the file is missing, no text, has no header line or no rows.
    """
    if path.is_dir():
        raise UserError(f"{path} is a folder; give the files themselves, for example {path}/*.csv")
    try:
        text = path.read_text(encoding="utf-8-sig")
    except OSError as problem:
        raise UserError(f"{path} cannot be read: {problem.strerror}; give a CSV or TSV file") from problem
    except UnicodeDecodeError:
        raise UserError(f"{path} is no UTF-8 text; export the recording as CSV or TSV") from None
    lines = [(i, line) for i, line in enumerate(text.splitlines(), 1) if line.strip() and not line.startswith("#")]
    if not lines:
        raise UserError(f"{path} is empty; needed are a header line and rows of numbers")
    delimiter = max(_DELIMITERS, key=lines[0][1].count)
    try:
        cells = [next(csv.reader([line], delimiter=delimiter)) for _, line in lines]
    except csv.Error as problem:
        raise UserError(f"{path} is no delimited text ({problem}); export the recording as CSV or TSV") from problem
    header = tuple(name.strip() for name in cells[0])
    if all(_is_number(name) for name in header):
        raise UserError(f"{path}, line {lines[0][0]} holds numbers; needed is a header line that names the columns")
    twice = next((name for name in header if name and header.count(name) > 1), None)
    if twice is not None:
        raise UserError(f"{path} has more than one column '{twice}'; rename one")
    if len(cells) < 2:
        raise UserError(f"{path} has a header line but no rows; needed are rows of numbers")
    rows = tuple((line, tuple(row)) for (line, _), row in zip(lines[1:], cells[1:], strict=True))
    return Table(path, header, rows)


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _hint(column: str, header: tuple[str, ...]) -> str:
    hint = suggest(column, header)
    return hint if "did you mean" in hint else ""
