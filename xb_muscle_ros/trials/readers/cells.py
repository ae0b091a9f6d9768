"""What a cell of a table holds: a number, nothing, or the time of a clock."""

from __future__ import annotations

import datetime
import math
import re
from array import array
from collections.abc import Iterable, Sequence

import numpy as np

from xb_muscle_ros.trials.trial import Array

# Text, or a number that a workbook holds as such.
Cell = str | float

# In place of what a formula of a workbook gives, where nothing has worked it out.
FORMULA = "a formula without its value"
WORKED_OUT = "open the workbook in Excel or LibreOffice, which works formulas out, and save it there"

POINT, COMMA = "point", "comma"
DECIMALS = (POINT, COMMA)
_WITH_COMMA = re.compile(r"[+-]?(\d*,\d+|\d+,)([eE][+-]?\d+)?")
_WITH_POINT = re.compile(r"[+-]?(\d*\.\d+|\d+\.)([eE][+-]?\d+)?")
# 1,234 may be a little more than one, or more than a thousand.
_EITHER = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}")
_GROUPED = re.compile(r"[+-]?[1-9]\d{0,2}(?P<mark>[ '.,\u00a0\u2009\u202f\u2019])\d{3}(?:(?P=mark)\d{3})*(?:[.,]\d+)?")
# What programs write where there is no sample, in small letters.
_BLANKS = frozenset(
    (
        *("", "nan", "-nan", "na", "n/a", "<na>", "-", "--", "null", "none", "#n/a", "#n/a n/a", "#na", "#nv"),
        *("#num!", "#div/0!", "#value!", "#ref!", "#null!", "#name?"),
    )
)
_CLOCK = re.compile(
    r"(?:(?P<date>\d{4}-\d\d-\d\d|\d{1,2}[./-]\d{1,2}[./-]\d{2,4})(?:T|\s+))?(?:(?P<hours>\d{1,3}):)?"
    r"(?P<minutes>\d{1,2}):(?P<seconds>\d{1,2}(?:[.,]\d+)?)(?:\s*(?P<half>[AaPp])\.?[Mm]\.?)?"
)


def with_comma(cells: Iterable[tuple[int, str]], sure: bool = False) -> tuple[int, str] | None:
    """The first number with a comma, and its line; with `sure`, one whose comma is no mark of thousands."""
    return next((c for c in cells if _WITH_COMMA.fullmatch(c[1]) and not (sure and _EITHER.fullmatch(c[1]))), None)


def with_point(cells: Iterable[tuple[int, str]]) -> tuple[int, str] | None:
    """The first number with a decimal point, and its line."""
    return next((cell for cell in cells if _WITH_POINT.fullmatch(cell[1])), None)


def number(text: Cell, decimal: str = POINT) -> float:
    """The number a cell holds; nan where it holds none, or one with marks of thousands."""
    if not isinstance(text, str):
        return text
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


def is_blank(cell: Cell) -> bool:
    """Whether a cell says that there is no sample."""
    if isinstance(cell, str):
        return cell.strip().replace("\u2212", "-").casefold() in _BLANKS
    return math.isnan(cell)


def like_number(cell: Cell) -> bool:
    """Whether a cell holds a number, with whatever marks, or the time of a clock, or would with its formula's value."""
    if not isinstance(cell, str):
        return True
    text = cell.strip()
    if text == FORMULA:
        return True
    if math.isnan(number(text)) and math.isnan(number(text, COMMA)):
        return is_grouped(text) or is_clock(text)
    return True


def is_clock(cell: Cell) -> bool:
    """Whether a cell is the time of a clock, such as 0:00:01.250, with or without a date before it."""
    return isinstance(cell, str) and _CLOCK.fullmatch(cell.strip()) is not None


def clock_seconds(cells: Iterable[str]) -> Array | None:
    """Times of a clock in s, shape (n,): from 0:00:00, or from midnight of the first day where a date changes.

    None where a cell is none, or where the date changes and is not written as year-month-day.
    """
    seconds, days, dates = array("d"), array("q"), dict[str | None, int]()
    for cell in cells:
        match = _CLOCK.fullmatch(cell)
        if match is None:
            return None
        seconds.append(_seconds(match))
        days.append(dates.setdefault(match["date"], len(dates)))
    offsets = _offsets_s(list(dates))
    return None if offsets is None else np.array(seconds) + offsets[np.array(days)]


def _seconds(match: re.Match[str]) -> float:
    hours = int(match["hours"] or 0)
    if match["half"]:
        hours = hours % 12 + (12 if match["half"] in "Pp" else 0)
    return 3600.0 * hours + 60.0 * int(match["minutes"]) + float(match["seconds"].replace(",", "."))


def _offsets_s(dates: Sequence[str | None]) -> Array | None:
    """Midnight of each date since that of the first, s."""
    if len(dates) == 1:
        return np.zeros(1)
    try:
        known = [datetime.date.fromisoformat(date or "").toordinal() for date in dates]
    except ValueError:
        return None
    return 86400.0 * np.array([day - known[0] for day in known]) if known else None
