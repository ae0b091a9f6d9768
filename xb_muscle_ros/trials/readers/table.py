"""Tables of numbers in delimited text, whatever its encoding; every complaint names the row and the column.

Text is UTF-8, UTF-16 as Excel's "Unicode text", or Windows-1252. A header line names the columns.
"""

from __future__ import annotations

import codecs
import csv
import math
import re
import unicodedata
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from xb_muscle_ros.errors import UserError, suggest
from xb_muscle_ros.trials.trial import Array

POINT, COMMA = "point", "comma"
DECIMALS = (POINT, COMMA)
_WITH_COMMA = re.compile(r"[+-]?(\d*,\d+|\d+,)([eE][+-]?\d+)?")
_WITH_POINT = re.compile(r"[+-]?(\d*\.\d+|\d+\.)([eE][+-]?\d+)?")
# 1,234 may be a little more than one, or more than a thousand.
_EITHER = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}")
_GROUPED = re.compile(r"[+-]?[1-9]\d{0,2}(?P<mark>[ '.,\u00a0\u2009\u202f\u2019])\d{3}(?:(?P=mark)\d{3})*(?:[.,]\d+)?")
_DELIMITERS = "\t;,"
# Excel tells itself the delimiter in a line before the header.
_SEPARATOR_LINE = re.compile(r"sep=(.)", re.IGNORECASE)
_BEGINS = {
    codecs.BOM_UTF8: "utf-8-sig",
    codecs.BOM_UTF16_LE: "utf-16",
    codecs.BOM_UTF16_BE: "utf-16",
}


def with_comma(cells: Iterable[tuple[int, str]], sure: bool = False) -> tuple[int, str] | None:
    """The first number with a comma, and its line; with `sure`, one whose comma is no mark of thousands."""
    return next((c for c in cells if _WITH_COMMA.fullmatch(c[1]) and not (sure and _EITHER.fullmatch(c[1]))), None)


def with_point(cells: Iterable[tuple[int, str]]) -> tuple[int, str] | None:
    """The first number with a decimal point, and its line."""
    return next((cell for cell in cells if _WITH_POINT.fullmatch(cell[1])), None)


def number(text: str, decimal: str = POINT) -> float:
    """The number a cell holds; nan where it holds none, or one with marks of thousands."""
    if "_" in text:  # Python's own way to write thousands
        return math.nan
    text = text.replace("\u2212", "-")
    if decimal == COMMA and "," in text:
        if not _WITH_COMMA.fullmatch(text):
            return math.nan
        text = text.replace(",", ".")
    elif decimal == COMMA and "." in text:
        return math.nan
    try:
        return float(text)
    except ValueError:
        return math.nan


def is_grouped(text: str) -> bool:
    """Whether a cell that is no number is one with marks of thousands."""
    return _GROUPED.fullmatch(text) is not None


@dataclass(frozen=True)
class Table:
    """A table as text: ``header`` names the columns, ``rows`` pairs line numbers (from 1) with cells.

    Attributes:
        header: names of the columns, none twice.
        rows: line number and cells of each row.
        decimal: `POINT` or `COMMA`.
        notices: what was found of encoding and decimal mark, one line each.
    """

    path: Path
    header: tuple[str, ...]
    rows: tuple[tuple[int, tuple[str, ...]], ...]
    decimal: str = POINT
    notices: tuple[str, ...] = ()

    def line(self, row: int) -> int:
        """Line number in the file (from 1) of a row (from 0)."""
        return self.rows[row][0]

    def texts(self, column: str) -> list[str]:
        """Cells of a column without blanks around them.

        Raises:
            UserError: no such column.
        """
        index = self._index(column)
        return [cells[index].strip() if index < len(cells) else "" for _, cells in self.rows]

    def numbers(self, column: str) -> Array:
        """Values of a column, shape (rows,).

        Raises:
            UserError: no such column, or a cell that is missing or no finite number.
        """
        texts = self.texts(column)
        values: Array = np.array([number(text, self.decimal) for text in texts])
        bad = ~np.isfinite(values)
        if bad.any():
            self._refuse(column, texts, bad)
        return values

    def _index(self, column: str) -> int:
        wanted = _plain(column)
        for i, name in enumerate(self.header):
            if _plain(name) == wanted:
                return i
        hint = suggest(column, self.header)
        raise UserError(
            f"{self.path} has no column '{column}'; its columns: {', '.join(self.header)}"
            f"{hint if 'did you mean' in hint else ''}"
        )

    def _refuse(self, column: str, texts: list[str], bad: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> None:
        first = int(np.argmax(bad))
        run = int(np.argmin(bad[first:])) or bad.size - first
        text = texts[first]
        more = f" (a run of {run} lines)" if run > 1 else ""
        if int(bad.sum()) > run:
            more += f"; so do {int(bad.sum()) - run} further lines"
        remedy = "needed is a finite number; mend or remove the line"
        if run > 1 and not text:
            remedy = "needed is a finite number; remove these lines, or fill them in where the signal is known"
        elif is_grouped(text):
            remedy = "thousands separators are not read; export the numbers without them"
        elif "," in text and self.decimal == POINT:
            remedy = "if that is a decimal comma, give --decimal comma; else mend or remove the line"
        found = f"'{text}'" if text else "nothing"
        raise UserError(f"{self.path}, line {self.line(first)}, column '{column}' holds {found}{more}; {remedy}")


def read_table(path: Path, decimal: str | None = None) -> Table:
    """Read delimited text: comma, semicolon or tab, told by the header line; lines that begin with # are comments.

    Args:
        decimal: `POINT` or `COMMA`; None for what the cells show.

    Raises:
        UserError: the file is missing, no text, has no header line or no rows, has rows that are longer than the
            header, or its decimal mark cannot be told.
    """
    if path.is_dir():
        raise UserError(f"{path} is a folder; give the files themselves, for example {path}/*.csv")
    text, encoding = read_text(path)
    lines = [(i, line) for i, line in enumerate(text.splitlines(), 1) if line.strip() and not line.startswith("#")]
    separator = _SEPARATOR_LINE.fullmatch(lines[0][1].strip()) if lines else None
    if separator is not None:
        lines = lines[1:]
    if not lines:
        raise UserError(f"{path} is empty; needed are a header line and rows of numbers")
    delimiter = separator.group(1) if separator is not None else max(_DELIMITERS, key=lines[0][1].count)
    try:
        cells = [next(csv.reader([line], delimiter=delimiter)) for _, line in lines]
    except csv.Error as problem:
        raise UserError(f"{path} is no delimited text ({problem}); export the recording as CSV or TSV") from problem
    header = tuple(name.strip() for name in cells[0])
    _check_header(path, lines[0][0], header)
    if len(cells) < 2:
        raise UserError(f"{path} has a header line but no rows; needed are rows of numbers")
    rows = tuple((line, tuple(row)) for (line, _), row in zip(lines[1:], cells[1:], strict=True))
    _check_lengths(path, header, rows)
    mark, notice = (decimal, "") if decimal is not None else _decimal(path, rows)
    return Table(path, header, rows, mark, tuple(line for line in (encoding, notice) if line))


def _check_header(path: Path, line: int, header: tuple[str, ...]) -> None:
    if all(np.isfinite(number(name)) or np.isfinite(number(name, COMMA)) for name in header):
        raise UserError(f"{path}, line {line} holds numbers; needed is a header line that names the columns")
    plain = [_plain(name) for name in header]
    twice = next((name for name in header if name and plain.count(_plain(name)) > 1), None)
    if twice is not None:
        raise UserError(f"{path} has more than one column '{twice}'; rename one")


def _check_lengths(path: Path, header: tuple[str, ...], rows: tuple[tuple[int, tuple[str, ...]], ...]) -> None:
    """Cells beyond the header have shifted others: decimal commas between commas, say."""
    for line, cells in rows:
        if any(cell.strip() for cell in cells[len(header) :]):
            raise UserError(
                f"{path}, line {line} has {len(cells)} cells, the header {len(header)}; decimal commas need another "
                "delimiter (semicolon or tab), and every column a name; export it again"
            )


def _decimal(path: Path, rows: tuple[tuple[int, tuple[str, ...]], ...]) -> tuple[str, str]:
    """The decimal mark the cells show, and a line on it where it is the comma."""
    comma = with_comma(cell for cell in _cells(rows) if "," in cell[1])
    if comma is None:
        return POINT, ""
    point = with_point(_cells(rows))
    if point is not None:
        raise UserError(
            f"{path}, line {comma[0]} holds '{comma[1]}', line {point[0]} '{point[1]}': decimal commas and points in "
            "one file; tell which mark is that of decimals by --decimal comma or --decimal point"
        )
    sure = with_comma(_cells(rows), sure=True)
    line, text = sure or comma
    if sure is None:
        raise UserError(
            f"{path}, line {line} holds '{text}', which is {text.replace(',', '.')} or {text.replace(',', '')}; tell "
            "which by --decimal comma, or export the numbers without thousands separators"
        )
    return COMMA, f"{path} has decimal commas: '{text}' in line {line} is read as {text.replace(',', '.')}"


def _cells(rows: tuple[tuple[int, tuple[str, ...]], ...]) -> Iterator[tuple[int, str]]:
    return ((line, cell.strip()) for line, cells in rows for cell in cells)


def _plain(name: str) -> str:
    """A column's name as it is compared: the two signs for micro are one."""
    return unicodedata.normalize("NFKC", name).strip()


def looks_like_text(begin: bytes) -> bool:
    """Whether the first bytes of a file may be text."""
    return bool(begin) and (_encoding(begin) is not None or b"\x00" not in begin)


def read_text(path: Path) -> tuple[str, str]:
    """Read a text file; a line on its encoding, where that is not UTF-8, comes with the text.

    Raises:
        UserError: it cannot be read, or is no text.
    """
    try:
        data = path.read_bytes()
    except OSError as problem:
        raise UserError(f"{path} cannot be read: {problem.strerror}; give a CSV or TSV file") from problem
    encoding = _encoding(data)
    notice = "" if encoding in (None, "utf-8-sig") else f"{path} is UTF-16 text and read as such"
    try:
        text = data.decode(encoding or "utf-8")
    except UnicodeDecodeError as problem:
        if encoding is not None:
            raise UserError(f"{path} is no whole {encoding} text ({problem.reason}); export it again") from None
        if b"\x00" in data:
            raise UserError(f"{path} is no text; export the recording as CSV or TSV") from None
        try:
            text, name = data.decode("cp1252"), "Windows-1252 (cp1252)"
        except UnicodeDecodeError:
            text, name = data.decode("latin-1"), "Latin-1"
        line = data[: problem.start].count(b"\n") + 1
        notice = f"{path}, line {line} is no UTF-8; the file is read as {name}"
    if "\x00" in text:
        raise UserError(f"{path} is no text; export the recording as CSV or TSV")
    return text, notice


def _encoding(data: bytes) -> str | None:
    """Encoding by the mark at the begin; UTF-16 without its mark has zero in every other byte of plain numbers."""
    marked = next((name for mark, name in _BEGINS.items() if data.startswith(mark)), None)
    if marked is not None:
        return marked
    pairs = data[:512]
    half = len(pairs) // 2
    for name, zeros, others in (("utf-16-le", pairs[1::2], pairs[::2]), ("utf-16-be", pairs[::2], pairs[1::2])):
        if half >= 2 and zeros.count(0) >= 0.9 * half and not others.count(0):
            return name
    return None
