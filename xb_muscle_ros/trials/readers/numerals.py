"""Numbers as text: decimal points or decimal commas, and what is neither."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable

POINT, COMMA = "point", "comma"
DECIMALS = (POINT, COMMA)
_WITH_COMMA = re.compile(r"[+-]?(\d*,\d+|\d+,)([eE][+-]?\d+)?")
_WITH_POINT = re.compile(r"[+-]?(\d*\.\d+|\d+\.)([eE][+-]?\d+)?")
# 1,234 may be a little more than one, or more than a thousand.
_EITHER = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}")
_GROUPED = re.compile(r"[+-]?[1-9]\d{0,2}(?P<mark>[ '.,\u00a0\u2009\u202f\u2019])\d{3}(?:(?P=mark)\d{3})*(?:[.,]\d+)?")


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
