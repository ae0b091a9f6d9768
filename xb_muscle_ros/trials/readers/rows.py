"""Rows of a table below its header: lines of text that are split when needed, or cells of a workbook."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator, Sequence
from functools import cached_property
from typing import Protocol

import numpy as np

from xb_muscle_ros.trials.readers.cells import COMMA, Cell
from xb_muscle_ros.trials.trial import Array

SPACES = " "
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

    def holding(self, mark: str) -> Iterator[tuple[int, str]]:
        """Row's number and text of cells that hold a sign."""


class TextRows:
    """Lines of delimited text."""

    word = "line"

    def __init__(self, lines: Sequence[str], numbers: Sequence[int], delimiter: str) -> None:
        """Take lines without those that are no rows; `SPACES` stands for any number of blanks and tabs."""
        self._lines, self._numbers, self._delimiter = lines, numbers, delimiter
        self._matrices: dict[str, Array | None] = {}

    def __len__(self) -> int:
        """How many there are."""
        return len(self._lines)

    def number(self, row: int) -> int:
        """Line in the file."""
        return self._numbers[row]

    @cached_property
    def cells(self) -> list[list[str]]:
        """Each line split."""
        return [split(line, self._delimiter) for line in self._lines]

    def matrix(self, decimal: str) -> Array | None:
        """Read by NumPy's parser, which takes the same for numbers as Python does, but for ``1_000``."""
        if decimal not in self._matrices:
            self._matrices[decimal] = self._read(decimal)
        return self._matrices[decimal]

    def _read(self, decimal: str) -> Array | None:
        lines = self._lines
        if decimal == COMMA:
            if self._delimiter == "," or any("." in line for line in lines):
                return None
            lines = [line.replace(",", ".") for line in lines]
        delimiter = None if self._delimiter == SPACES else self._delimiter
        if delimiter is not None and lines and lines[0].endswith(delimiter):
            lines = [line.removesuffix(delimiter) for line in lines]
        try:
            found: Array = np.loadtxt(lines, delimiter=delimiter, comments=None, quotechar='"', ndmin=2)
        except ValueError:
            return None
        return found if found.shape[0] == len(lines) else None

    def holding(self, mark: str) -> Iterator[tuple[int, str]]:
        """Lines without the sign are not split."""
        # Only a quoted cell holds the delimiter.
        sign = '"' if mark == self._delimiter else mark
        for line, number in zip(self._lines, self._numbers, strict=True):
            if sign in line:
                yield from ((number, cell.strip()) for cell in split(line, self._delimiter) if mark in cell)


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

    def holding(self, mark: str) -> Iterator[tuple[int, str]]:
        """Numbers that are kept as such hold no sign."""
        for row, number in zip(self.cells, self._numbers, strict=True):
            yield from ((number, cell.strip()) for cell in row if isinstance(cell, str) and mark in cell)


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
