"""Where the parts of a table are: its header, a row of units below it, and its first row of numbers.

A header is the row that names the columns asked for; where none does, the row above the first numbers that go on.
"""

from __future__ import annotations

import itertools
import re
import unicodedata
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from xb_muscle_ros.trials.readers.cells import Cell, is_blank, like_number
from xb_muscle_ros.trials.readers.units import KINDS, header_unit, unit_in

# A header is looked for in so many rows; numbers that go on do so for so many.
LOOKED_AT = 500
_GO_ON = 10
_NUMBER, _BLANK, _TEXT = "n", "-", "t"
_LONGEST_UNIT = 12


def plain(name: str) -> str:
    """A column's name as it is compared: the two signs for micro are one."""
    return unicodedata.normalize("NFKC", name).strip()


@dataclass(frozen=True)
class Wanted:
    """Columns that are asked for.

    Attributes:
        names: those that go by name, as `plain` has them.
        patterns: of names.
        by_number: whether one goes by its number.
    """

    names: frozenset[str] = frozenset()
    patterns: tuple[re.Pattern[str], ...] = ()
    by_number: bool = False

    @property
    def only_numbers(self) -> bool:
        """Whether columns go by number alone, so that a table needs no header."""
        return self.by_number and not self.names and not self.patterns

    def named_by(self, row: Sequence[str]) -> bool:
        """Whether a row names all of them."""
        if not self.names and not self.patterns:
            return False
        return self.names <= set(row) and all(any(map(pattern.fullmatch, row)) for pattern in self.patterns)


class Found(NamedTuple):
    """Rows of a table, counted from 0.

    Attributes:
        header: the header; None where there is none.
        units: a row of units; None where there is none.
        first: the first row of numbers.
        sure: how surely so: larger is surer, see `_sureness`.
    """

    header: int | None
    units: int | None
    first: int
    sure: tuple[float, ...] = ()


def find(rows: Sequence[Sequence[Cell]], wanted: Wanted) -> Found | None:
    """The parts of a table among its first rows; None where they do not show."""
    names = [[plain(str(cell)) for cell in row] for row in rows]
    named = next((i for i, row in enumerate(names) if wanted.named_by(row)), None)
    if named is not None:
        return _below(rows, named, (1.0,))
    kinds = [[_kind(cell) for cell in row] for row in rows]
    first = next((i for i in range(len(rows)) if _goes_on(kinds[i : i + _GO_ON])), None)
    if first is None:
        return None
    width = _width(kinds[first : first + _GO_ON])
    if any(_TEXT not in row and row.count(_NUMBER) >= min(width, 2) for row in kinds[:first]):
        return None  # numbers stand above: what looks like a header is a row at fault
    units = first - 1 if first >= 2 and is_unit_row(rows[first - 1], rows[first - 2]) else None
    header = first - 1 if units is None else units - 1
    if header < 0 or _TEXT not in kinds[header] or 2 * _filled(kinds[header]) < width:
        return Found(None, None, first, _sureness(kinds, None, first))
    return Found(header, units, first, _sureness(kinds, header, first))


def at_header(rows: Sequence[Sequence[Cell]], header: int | None) -> Found:
    """The parts of a table whose header is known, or that has none."""
    kinds = [[_kind(cell) for cell in row] for row in rows]
    if header is not None:
        found = _below(rows, header, ())
        return found._replace(sure=_sureness(kinds, header, found.first))
    first = next((i for i in range(len(rows)) if _goes_on(kinds[i : i + _GO_ON])), 0)
    return Found(None, None, first, _sureness(kinds, None, first))


def is_unit_row(row: Sequence[Cell], above: Sequence[Cell]) -> bool:
    """Whether a row below names holds their units: at least half of its cells are known ones."""
    filled = [cell.strip() for cell in row if isinstance(cell, str) and cell.strip()]
    if not filled or any(not isinstance(cell, str) for cell in row):
        return False
    if any(len(cell) > _LONGEST_UNIT or like_number(cell) for cell in filled):
        return False
    named = sum(isinstance(cell, str) and bool(cell.strip()) for cell in above)
    known = sum(any(unit_in(cell, signal) for signal in KINDS) for cell in filled)
    return len(filled) <= named and 2 * known >= len(filled)


def names_of(rows: Sequence[Sequence[Cell]], found: Found) -> tuple[tuple[str, ...], str]:
    """Names of the columns, and a line on how they were made where two rows make them, or none."""
    if found.header is None:
        width = max(len(row) for row in rows[found.first : found.first + _GO_ON])
        return tuple(str(i) for i in range(1, width + 1)), ""
    names = [str(cell).strip() for cell in rows[found.header]]
    while names and not names[-1]:
        names.pop()
    above = [str(cell).strip() for cell in rows[found.header - 1]] if found.header else []
    joined = _joined(names, above)
    twice = next((new for old, new in zip(names, joined, strict=True) if old and old != new), None)
    if twice is None:
        return tuple(names), ""
    return tuple(joined), f"two rows name the columns, for example '{twice}'"


def header_units(header: Sequence[str], row: Sequence[Cell] | None) -> tuple[str, ...]:
    """What is told of the unit of each column, by the row of units or else by the name; empty where nothing is."""
    below = ["" if cell is None else str(cell).strip() for cell in itertools.islice(row or (), len(header))]
    below += [""] * (len(header) - len(below))
    return tuple(unit or header_unit(name) for unit, name in zip(below, header, strict=True))


def _last(held: str, cell: str) -> str:
    return cell or held


def _joined(names: list[str], above: list[str]) -> list[str]:
    """Names that come twice, distinguished by the row above, whose cells hold until the next one."""
    twice = {name for name in names if name and names.count(name) > 1}
    if not twice or sum(map(bool, above)) < 2 or any(map(like_number, filter(None, above))):
        return names
    held: list[str] = list(itertools.accumulate(above, _last))
    held += held[-1:] * (len(names) - len(held))
    pairs = zip(names, held, itertools.chain(above, itertools.repeat("")), strict=False)
    return [f"{top} {name}".strip() if name in twice else name or own for name, top, own in pairs]


def _below(rows: Sequence[Sequence[Cell]], header: int, sure: tuple[float, ...]) -> Found:
    first = header + 1
    units = first if first < len(rows) and is_unit_row(rows[first], rows[header]) else None
    return Found(header, units, first if units is None else first + 1, sure)


def _sureness(kinds: list[list[str]], header: int | None, first: int) -> tuple[float, ...]:
    """How surely rows were split rightly: a header as wide as the rows, more numbers, more columns."""
    rows = kinds[first : first + _GO_ON]
    width = _width(rows)
    wide = header is not None and _filled(kinds[header]) >= width
    numbers = sum(row.count(_NUMBER) for row in rows) / max(sum(map(_filled, rows)), 1)
    return (0.0, float(wide or header is None), float(numbers > 0.99), float(width))


def _kind(cell: Cell) -> str:
    if is_blank(cell):
        return _BLANK
    return _NUMBER if like_number(cell) else _TEXT


def _goes_on(rows: Iterable[Sequence[str]]) -> bool:
    """Whether rows hold numbers, column by column; blanks may be anywhere."""
    rows = list(rows)
    if not rows or _NUMBER not in rows[0]:
        return False
    columns = itertools.zip_longest(*rows, fillvalue=_BLANK)
    return all(not {_NUMBER, _TEXT} <= set(column) for column in columns)


def _width(rows: Iterable[Sequence[str]]) -> int:
    """How many columns hold numbers."""
    return sum(_NUMBER in column for column in itertools.zip_longest(*rows, fillvalue=_BLANK))


def _filled(row: Sequence[str]) -> int:
    return len(row) - row.count(_BLANK)
