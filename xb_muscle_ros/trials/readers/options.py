"""How a table is to be read, where it does not show: keys of a mapping."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.readers.cells import DECIMALS
from xb_muscle_ros.trials.readers.layout import Wanted, plain
from xb_muscle_ros.trials.readers.tree import Keys, check_keys

# What only tables have; each reader takes some of them.
TABLE_KEYS = ("decimal", "encoding", "header", "sheet", "blanks")
# A column of each trial by the names of columns.
PATTERN = "pattern"
# What every table takes.
ANY_TABLE = ("columns.trial", "columns.time.rate", PATTERN)
# A table without a header.
NO_HEADER = "none"


@dataclass(frozen=True, eq=False)
class Sheets:
    """Which sheets of a workbook are read: one by its name, or those whose whole name a pattern matches.

    Attributes:
        name: of the one, or the pattern's text.
        pattern: its named groups tell facts of the trials in a sheet; None for one by name.
        factors: what numbers that the groups find are multiplied with.
    """

    name: str
    pattern: re.Pattern[str] | None = None
    factors: Mapping[str, float] = field(default_factory=dict)


class TableOptions(NamedTuple):
    """How a table is to be read.

    Attributes:
        decimal: `cells.POINT` or `cells.COMMA`; None for what the cells show.
        encoding: of text, as Python names it; None for what the bytes show.
        header: number of the line that names the columns, or `NO_HEADER`; None for what the rows show.
        sheets: of a workbook; None for all.
        longest_blank_s: runs of blank samples up to this are filled, s; None for `blanks.LONGEST_S`.
        wanted: columns that are asked for.
    """

    decimal: str | None = None
    encoding: str | None = None
    header: str | None = None
    sheets: Sheets | None = None
    longest_blank_s: float | None = None
    wanted: Wanted = Wanted()


DEFAULTS = TableOptions()


def read_options(keys: Keys, facts: Iterable[str]) -> TableOptions:
    """Options of a mapping.

    Args:
        facts: that the name of a sheet may tell.

    Raises:
        UserError: a value that is not allowed.
    """
    return TableOptions(
        decimal=keys.choice("decimal", *DECIMALS) if "decimal" in keys else None,
        encoding=_encoding(keys),
        header=_header(keys),
        sheets=_sheets(keys, tuple(facts)),
        longest_blank_s=keys.below("blanks", "longest").amount("longest", "time", "5 ms", zero=True),
    )


def wanted(names: Iterable[str], patterns: Iterable[re.Pattern[str]] = ()) -> Wanted:
    """Columns that are asked for by names, by numbers among these, and by patterns."""
    called = frozenset(plain(name) for name in names)
    by_name = frozenset(name for name in called if not name.isdecimal())
    return Wanted(by_name, tuple(patterns), bool(called - by_name))


def _encoding(keys: Keys) -> str | None:
    if "encoding" not in keys:
        return None
    name = keys.text("encoding", "give one such as utf-8, cp1252 or mac_roman")
    try:
        b"a".decode(name)
    except (LookupError, UnicodeError) as problem:
        # One letter may be too little for it.
        if not isinstance(problem, UnicodeDecodeError):
            raise UserError(
                f"{keys.where}: encoding is '{name}'; needed is one that Python knows, such as utf-8, utf-16, cp1252, "
                "latin-1 or mac_roman"
            ) from None
    return name


def _header(keys: Keys) -> str | None:
    if "header" not in keys:
        return None
    told = str(keys.values["header"])
    if told != NO_HEADER and not (told.isdecimal() and int(told) > 0):
        raise UserError(
            f"{keys.where}: header is '{told}'; needed is the number of the line that names the columns, from 1, or "
            f"'{NO_HEADER}'"
        )
    return told


def _sheets(keys: Keys, facts: tuple[str, ...]) -> Sheets | None:
    if "sheet" not in keys:
        return None
    if not isinstance(keys.values["sheet"], Mapping):
        return Sheets(keys.text("sheet", "name a sheet, or leave it out"))
    below = keys.below("sheet", "pattern", "factors")
    pattern = below.pattern("pattern", "give a regular expression of names of sheets")
    check_keys(pattern.groupindex, facts, "group in sheet.pattern: ", keys.where)
    factors = below.below("factors")
    check_keys(factors.values, pattern.groupindex, "sheet.factors.", keys.where)
    return Sheets(pattern.pattern, pattern, {name: factors.number(name) for name in factors.values})
