"""Rows of a table below its header: lines of text that are split when needed, or cells of a workbook."""

from __future__ import annotations

import csv
import itertools
import re
from collections.abc import Iterable, Iterator, Sequence
from typing import Protocol, overload

import numpy as np

from xb_muscle_ros.trials.readers.cells import COMMA, Cell, number
from xb_muscle_ros.trials.readers.text_lines import Places
from xb_muscle_ros.trials.spool import release, roomy, settle
from xb_muscle_ros.trials.trial import Array

SPACES = " "
# Rows that are read in one go, and where some of them cannot be.
_BLOCK, _FEW = 1 << 16, 1 << 10
# A unit in brackets belongs to the name before it.
_WORD = re.compile(r"\S+(?:[ \t]+[(\[][^)\]]*[)\]])?")


class Rows(Protocol):
    """Rows of a table.

    Attributes:
        word: what one is called, for messages.
    """

    word: str

    def __len__(self) -> int:
        """How many there are."""

    def number(self, row: int) -> int:
        """The number in the file, from 1, of a row from 0."""

    @property
    def cells(self) -> Sequence[Sequence[Cell]]:
        """Cells of each row, some rows shorter than others."""

    def matrix(self, decimal: str) -> Array | None:
        """All numbers at once, shape (rows, columns), where every cell is one and rows are equally long."""

    def column(self, index: int, decimal: str) -> Array:
        """Numbers of a column, shape (rows,): nan where a cell is missing or is none; not to be changed."""

    def holding(self, mark: str) -> Iterator[tuple[int, str]]:
        """Row's number and text of cells that hold a sign."""


class TextRows:
    """Lines of delimited text."""

    word = "line"

    def __init__(self, lines: Sequence[str], numbers: Sequence[int] | Places, delimiter: str) -> None:
        """Take lines without those that are no rows; `SPACES` stands for any number of blanks and tabs."""
        self._lines, self._numbers, self._delimiter = lines, numbers, delimiter
        self._matrices: dict[str, Array | None] = {}
        self._columns: dict[str, Array] = {}
        self.cells: Sequence[list[str]] = _Split(lines, delimiter)

    def __len__(self) -> int:
        """How many there are."""
        return len(self._lines)

    def number(self, row: int) -> int:
        """Line in the file."""
        return int(self._numbers[row])

    def matrix(self, decimal: str) -> Array | None:
        """Read by NumPy's parser, which takes the same for numbers as Python does, but for ``1_000``."""
        if decimal not in self._matrices:
            self._matrices[decimal] = self._read(decimal)
        return self._matrices[decimal]

    def column(self, index: int, decimal: str) -> Array:
        """Rows that NumPy cannot read are read cell by cell, all columns at once."""
        matrix = self.matrix(decimal)
        if matrix is not None:
            return matrix[:, index] if index < matrix.shape[1] else np.full(len(self), np.nan)
        if decimal not in self._columns:
            self._columns[decimal] = self._mixed(decimal)
        found = self._columns[decimal]
        return found[index] if index < found.shape[0] else np.full(len(self), np.nan)

    def _mixed(self, decimal: str) -> Array:
        """All columns, nan where a cell is missing or no number, shape (columns, rows)."""
        width = max(map(len, self.cells), default=0)
        found, first = roomy(width * len(self)).reshape(width, len(self)), 0
        for lines in _blocks(self._lines, _FEW):
            here = found[:, first : first + len(lines)]
            block = None if self._is_quoted(lines) else self._parsed(lines, decimal)
            if block is not None and block.shape[1] == width:
                here[:] = block.T
            else:
                here[:] = np.nan
                for j, cells in enumerate(itertools.zip_longest(*(split(line, self._delimiter) for line in lines))):
                    here[j] = _column(cells, decimal)
            first += len(lines)
        release(found)
        return settle(found)

    def _read(self, decimal: str) -> Array | None:
        """All rows; each column in one piece, as it is wanted later."""
        columns, first = None, 0
        for lines in _blocks(self._lines, _BLOCK):
            block = self._parsed(lines, decimal)
            if block is None or (columns is not None and block.shape[1] != columns.shape[0]):
                return None
            if columns is None:
                columns = roomy(block.shape[1] * len(self)).reshape(block.shape[1], len(self))
            columns[:, first : first + len(lines)] = block.T
            first += len(lines)
        if columns is None:
            return None
        release(columns)
        return settle(columns).T

    def _parsed(self, lines: Sequence[str], decimal: str) -> Array | None:
        """Some lines; None where NumPy's parser cannot read them."""
        if decimal == COMMA:
            if self._delimiter == "," or any("." in line for line in lines):
                return None
            lines = [line.replace(",", ".") for line in lines]
        delimiter = None if self._delimiter == SPACES else self._delimiter
        if delimiter is None and any('"' in line for line in lines):
            return None  # blanks within quotes: cells are what `split` makes of them
        if delimiter is not None and lines[0].endswith(delimiter):
            lines = [line.removesuffix(delimiter) for line in lines]
        if not any(lines):  # nothing but delimiters
            return None
        try:
            found: Array = np.loadtxt(lines, delimiter=delimiter, comments=None, quotechar='"', ndmin=2)
        except ValueError:
            return None
        return found if found.shape[0] == len(lines) else None

    def _is_quoted(self, lines: Sequence[str]) -> bool:
        """Whether there are signs that keep cells together, which the two ways to split lines need not see alike."""
        signs = '"([' if self._delimiter == SPACES else '"'
        return any(sign in line for line in lines for sign in signs)

    def holding(self, mark: str) -> Iterator[tuple[int, str]]:
        """Lines without the sign are not split."""
        # Only a quoted cell holds the delimiter.
        sign = '"' if mark == self._delimiter else mark
        for i, line in enumerate(self._lines):
            if sign in line:
                yield from ((self.number(i), cell.strip()) for cell in split(line, self._delimiter) if mark in cell)


class _Split(Sequence[list[str]]):
    """Lines, split where they are asked for: the cells of an hour at 1 kHz take 1 GB."""

    def __init__(self, lines: Sequence[str], delimiter: str) -> None:
        self._lines, self._delimiter = lines, delimiter

    def __len__(self) -> int:
        return len(self._lines)

    @overload
    def __getitem__(self, key: int) -> list[str]: ...
    @overload
    def __getitem__(self, key: slice) -> list[list[str]]: ...
    def __getitem__(self, key: int | slice) -> list[str] | list[list[str]]:
        if isinstance(key, slice):
            return [split(line, self._delimiter) for line in self._lines[key]]
        return split(self._lines[key], self._delimiter)

    def __iter__(self) -> Iterator[list[str]]:
        return (split(line, self._delimiter) for line in self._lines)


def _blocks(lines: Iterable[str], size: int) -> Iterator[list[str]]:
    left = iter(lines)
    while block := list(itertools.islice(left, size)):
        yield block


def _column(cells: Sequence[str | None], decimal: str) -> Array:
    """Numbers of cells, nan where one is missing or is none, shape (cells,)."""
    try:
        # Most columns hold numbers alone; Python takes 1_000 for one.
        found = np.fromiter(map(float, cells), np.float64, len(cells))  # type: ignore[arg-type]  # None is caught
        if decimal != COMMA and not any("_" in cell for cell in cells if cell):
            return found
    except (TypeError, ValueError):
        pass
    return np.array([np.nan if cell is None else number(cell.strip(), decimal) for cell in cells])


class CellRows:
    """Rows of a sheet."""

    word = "row"

    def __init__(self, cells: Sequence[Sequence[Cell]], numbers: Sequence[int]) -> None:
        """Take rows, and their numbers in the sheet."""
        self.cells, self._numbers = cells, numbers

    def __len__(self) -> int:
        """How many there are."""
        return len(self.cells)

    def number(self, row: int) -> int:
        """Row in the sheet."""
        return self._numbers[row]

    def matrix(self, decimal: str) -> Array | None:
        """None: cells may be of any kind."""

    def column(self, index: int, decimal: str) -> Array:
        """Cells that are numbers as such, and those whose text is one."""
        rows = (row[index] if index < len(row) else np.nan for row in self.cells)
        return np.array([number(cell.strip() if isinstance(cell, str) else cell, decimal) for cell in rows])

    def holding(self, mark: str) -> Iterator[tuple[int, str]]:
        """Numbers that are kept as such hold no sign."""
        for row, place in zip(self.cells, self._numbers, strict=True):
            yield from ((int(place), cell.strip()) for cell in row if isinstance(cell, str) and mark in cell)


def split(line: str, delimiter: str) -> list[str]:
    """Cells of a line; `SPACES` stands for any number of blanks and tabs."""
    if delimiter == SPACES:
        return [word.strip('"') for word in _WORD.findall(line)]
    if '"' not in line:
        return line.split(delimiter)
    try:
        return next(csv.reader([line], delimiter=delimiter))
    except csv.Error:  # a quote that does not end: the cells at fault are named when they are read
        return line.split(delimiter)
