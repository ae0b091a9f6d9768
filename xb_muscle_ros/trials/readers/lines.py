"""Text files with a header of facts above rows of numbers: their lines, rows, and what a header says of them.

Text is UTF-8 or Latin-1, as instruments write µ and °; lines end as on any system.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.readers.cells import COMMA, POINT, number
from xb_muscle_ros.trials.readers.rows import SPACES, TextRows
from xb_muscle_ros.trials.readers.table import decimal_of
from xb_muscle_ros.trials.trial import Array

_END = re.compile(r"\r\n|\n|\r")
_AMOUNT = re.compile(r"\s*(?P<value>[+-]?(?:[\d.,]+(?:[eE][+-]?\d+)?|nan|inf))(?:\s+(?P<unit>\S.*))?\s*", re.IGNORECASE)


class Text(NamedTuple):
    """Lines of a file, and whether the last one has its end: without, it may have been cut short."""

    lines: tuple[str, ...]
    ended: bool


def decoded(raw: bytes) -> str:
    """UTF-8 where it is that, else Latin-1."""
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        return raw.decode("latin-1")


def read_lines(path: Path, needed: str) -> Text:
    """The lines of a text file.

    Args:
        needed: the kind of file, for messages.

    Raises:
        UserError: the file cannot be read, is empty, or is no text.
    """
    try:
        raw = path.read_bytes()
    except OSError as problem:
        raise UserError(f"{path} cannot be read: {problem.strerror}; give {needed}") from problem
    if not raw.strip():
        raise UserError(f"{path} is empty; needed is {needed}")
    if b"\x00" in raw:
        raise UserError(f"{path} is no plain text (byte 0 in it); needed is {needed}; copy it again")
    lines = _END.split(decoded(raw))
    ended = lines[-1] == ""
    return Text(tuple(lines[:-1] if ended else lines), ended)


@dataclass(frozen=True)
class Rows:
    """Numbers below a header.

    Attributes:
        values: shape (rows, columns).
        lines: line of each row in the file, from 1.
        notices: what was left out or found of the decimal mark, one line each.
    """

    values: Array
    lines: tuple[int, ...]
    notices: tuple[str, ...]

    def at(self, i: int) -> str:
        """Where a row is, for messages."""
        return f"line {self.lines[i]}"


def read_rows(path: Path, text: Text, first: int, names: Sequence[str], decimal: str | None = None) -> Rows:
    """Rows of numbers with blanks or tabs between; a last one that was cut short is left out and told.

    Args:
        text: all of the file.
        first: index of the line the rows begin with.
        names: of the columns.
        decimal: `POINT` or `COMMA`; None for what the cells show.

    Raises:
        UserError: no rows, a row with too many or too few cells, or a cell that is no number.
    """
    found = [(i, line.strip()) for i, line in enumerate(text.lines[first:], first + 1) if line.strip()]
    notices = []
    if found and (not text.ended or len(found[-1][1].split()) < len(names)):
        notices.append(f"{path}, line {found[-1][0]}: the last line was cut short and is left out")
        found = found[:-1]
    if not found:
        raise UserError(f"{path} has no whole rows below its header; copy it again")
    rows = TextRows([line for _, line in found], [i for i, _ in found], SPACES)
    if decimal is None:
        decimal, notice = decimal_of(str(path), rows)
        notices += [notice] if notice else []
    return Rows(numbers(path, rows, names, decimal), tuple(i for i, _ in found), tuple(notices))


def numbers(path: Path, rows: TextRows, names: Sequence[str], decimal: str = POINT) -> Array:
    """Cells as numbers, shape (rows, columns).

    Raises:
        UserError: naming the first row with too many or too few cells, or the first cell that is no number.
    """
    table = rows.matrix(decimal)
    if table is not None and table.shape == (len(rows), len(names)):
        return table
    made = np.empty((len(rows), len(names)))
    for i, cells in enumerate(rows.cells):
        where = f"{path}, {rows.word} {rows.number(i)}"
        if len(cells) != len(names):
            raise UserError(
                f"{where} has {len(cells)} cells; needed are {len(names)}: {', '.join(names)}; mend or remove the line"
            )
        for j, cell in enumerate(cells):
            made[i, j] = number(cell, decimal)
            if math.isnan(made[i, j]) and cell.lower() != "nan":
                remedy = "needed is a number; mend or remove the line"
                if "," in cell and decimal != COMMA:
                    remedy = "if that is a decimal comma, give --decimal comma; else mend or remove the line"
                raise UserError(f"{where}, column '{names[j]}' holds '{cell}'; {remedy}")
    return made


class Amount(NamedTuple):
    """A number of a header and its unit, as it is there; the unit is empty where there is none."""

    value: float
    unit: str


def amount(text: str) -> Amount:
    """The number at the begin of a header's value, with a decimal point or comma; nan where there is none."""
    match = _AMOUNT.fullmatch(text)
    if match is None:
        return Amount(math.nan, text.strip())
    value = match["value"]
    return Amount(number(value, COMMA if "," in value else POINT), (match["unit"] or "").strip())
