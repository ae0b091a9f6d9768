"""Numbers as text: decimal points or decimal commas, and what is neither."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from typing import NamedTuple

POINT, COMMA = "point", "comma"
DECIMALS = (POINT, COMMA)
_WITH_COMMA = re.compile(r"[+-]?(\d*,\d+|\d+,)([eE][+-]?\d+)?")
_WITH_POINT = re.compile(r"[+-]?(\d*\.\d+|\d+\.)([eE][+-]?\d+)?")
# 1,234 may be a little more than one, or more than a thousand.
_EITHER = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}")
_GROUPED = re.compile(r"[+-]?[1-9]\d{0,2}(?P<mark>[ '.,\u00a0\u2009\u202f\u2019])\d{3}(?:(?P=mark)\d{3})*(?:[.,]\d+)?")


class Marks(NamedTuple):
    """Cells that show a decimal mark (line and text of the first of each kind); None where there is none.

    Attributes:
        comma: one with a comma.
        point: one with a point.
        sure: one with a comma that is no mark of thousands.
    """

    comma: tuple[int, str] | None = None
    point: tuple[int, str] | None = None
    sure: tuple[int, str] | None = None


def marks_of(cells: Iterable[tuple[int, str]]) -> Marks:
    """Decimal marks in cells, each with its line; other cells than numbers do not count."""
    found = Marks()
    for line, text in cells:
        if "," in text and _WITH_COMMA.fullmatch(text):
            found = found._replace(comma=found.comma or (line, text))
            if found.sure is None and not _EITHER.fullmatch(text):
                found = found._replace(sure=(line, text))
        elif found.point is None and "." in text and _WITH_POINT.fullmatch(text):
            found = found._replace(point=(line, text))
    return found


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
