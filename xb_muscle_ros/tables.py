"""Tables as text, in columns that line up or as Markdown, and as CSV; numbers with their standard errors."""

from __future__ import annotations

import csv
import itertools
import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

from xb_muscle_ros.files import replaced

T = TypeVar("T")
NOTHING = "–"
MARK = "*"
MARK_NOTE = f"{MARK} standard error as large as the value or larger: known to be small, and no more"

Columns = Mapping[str, Callable[[T], str]]
"""Heads, with the unit where there is one, and what each column says of a record."""
Filled = tuple[Sequence[str], Sequence[Sequence[str]]]
"""Heads and rows of a table."""


def number(value: float | None, form: str = ".3f", factor: float = 1.0) -> str:
    """A number times a factor; a dash for None and NaN."""
    if value is None or not math.isfinite(value):
        return NOTHING
    text = format(value if factor == 1.0 else factor * value, form)
    # What is rounded to zero has no sign.
    return text.removeprefix("-") if not text.strip("-0.") else text


def error_text(se: float | None, factor: float = 1.0) -> str:
    """A standard error with the sign before it; empty where it is not known."""
    if se is None or not math.isfinite(se):
        return ""
    scaled = factor * se
    return f" ± {scaled:.0f}" if scaled >= 10.0 else f" ± {scaled:.2g}"


def unsound(value: float | None, se: float | None) -> bool:
    """Whether a standard error is as large as its value or larger: such a number is known to be small, and no more."""
    return value is not None and se is not None and math.isfinite(se) and se >= abs(value)


def with_error(value: float | None, se: float | None, form: str = ".3f", factor: float = 1.0) -> str:
    """A number ± its standard error, with `MARK` where that is as large; the number alone where it has none."""
    text = number(value, form, factor)
    return text if text == NOTHING else text + error_text(se, factor) + (MARK if unsound(value, se) else "")


def filled(columns: Columns[T], records: Iterable[T]) -> Filled:
    """Heads, and a row for each record."""
    return list(columns), [[say(record) for say in columns.values()] for record in records]


def aligned(head: Sequence[str], rows: Sequence[Sequence[str]], left: Collection[int] = (0,), rule: bool = True) -> str:
    """A table for a terminal.

    Args:
        head, rows: as many cells each.
        left: columns whose cells stand to the left; the others stand to the right.
        rule: lines below the heads.
    """
    widths = [max(len(line[i]) for line in (head, *rows)) for i in range(len(head))]
    lines = ["  ".join(_padded(line, widths, left)).rstrip() for line in (head, *rows)]
    if rule:
        lines.insert(1, "  ".join("-" * width for width in widths))
    return "\n".join(lines)


def markdown(head: Sequence[str], rows: Iterable[Sequence[str]], left: Collection[int] = (0,)) -> str:
    """The same as Markdown; a bar within a cell becomes a slash."""
    lines = [list(head), *([cell.replace("|", "/") for cell in row] for row in rows)]
    widths = [max(3, *(len(line[i]) for line in lines)) for i in range(len(head))]
    rules = ["-" * w if i in left else "-" * (w - 1) + ":" for i, w in enumerate(widths)]
    return "\n".join(f"| {' | '.join(_padded(line, widths, left))} |" for line in (lines[0], rules, *lines[1:]))


def _padded(cells: Sequence[str], widths: Sequence[int], left: Collection[int]) -> list[str]:
    sized = enumerate(zip(cells, widths, strict=True))
    return [cell.ljust(width) if i in left else cell.rjust(width) for i, (cell, width) in sized]


def write_csv(path: Path, rows: Iterable[Mapping[str, Any]], columns: Sequence[str] = ()) -> None:
    """Write rows one by one; None and NaN become empty, floats stay exact. The file appears whole or not at all.

    Args:
        path: of the file.
        rows: column -> value, the same columns in each.
        columns: for a table that may be without rows; else those of the first row.
    """
    rest = iter(rows)
    first = next(rest, None)
    with replaced(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        # csv writes floats as repr does, and None as nothing.
        writer = csv.DictWriter(file, list(first or columns), lineterminator="\n")
        writer.writeheader()
        for row in itertools.chain([first] if first else [], rest):
            writer.writerow({name: None if _not_finite(cell) else cell for name, cell in row.items()})


def _not_finite(cell: Any) -> bool:
    return isinstance(cell, float) and not math.isfinite(cell)
