"""Pages of trials, each with two panels on one axis of time."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

_COLUMNS = 3


class Look(NamedTuple):
    """How the two panels of a trial look.

    Attributes:
        heights: of the upper and the lower one, in any unit.
        gap: between them, in shares of their mean height.
        upper, lower: what they show, with the unit.
        row_mm, extra_mm: height of a row of trials, and of what is on the page beside them.
    """

    heights: tuple[int, int]
    gap: float
    upper: str
    lower: str
    row_mm: float
    extra_mm: float


def pages_of(path: Path, trials: int, per_page: int) -> Iterator[tuple[Path, slice]]:
    """File and trials of each page; further pages are called ``<name>_2`` and so on."""
    for page in range(0, trials, per_page):
        here = path if page == 0 else path.with_name(f"{path.stem}_{page // per_page + 1}{path.suffix}")
        yield here, slice(page, page + per_page)


def size_mm(trials: int, look: Look) -> tuple[float, float]:
    """Width and height of a page, mm."""
    columns = min(_COLUMNS, trials)
    return 20.0 + 58.0 * columns, look.extra_mm + look.row_mm * -(-trials // columns)


def panels(made: Any, trials: int, look: Look) -> list[tuple[Any, Any]]:
    """Upper and lower axes of each trial of a page, labelled at its edges."""
    columns = min(_COLUMNS, trials)
    grid = made.add_gridspec(-(-trials // columns), columns)
    found = []
    for i in range(trials):
        cell = grid[i // columns, i % columns].subgridspec(2, 1, height_ratios=look.heights, hspace=look.gap)
        upper = made.add_subplot(cell[0])
        lower = made.add_subplot(cell[1], sharex=upper)
        if i % columns == 0:
            upper.set_ylabel(look.upper)
            lower.set_ylabel(look.lower)
        if i + columns >= trials:
            lower.set_xlabel("Time (s)")
        found.append((upper, lower))
    return found
