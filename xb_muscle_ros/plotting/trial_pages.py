"""Pages of trials, each with two panels on one axis of time."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

from xb_muscle_ros.plotting.style import figure, save

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


Draw = Callable[[Any, Any, int], list[Any]]
"""Draws a trial, by its place, into its upper and lower axes; returns what the legend names."""


def draw_pages(path: Path, trials: int, per_page: int, look: Look, draw: Draw, columns_of_one: int) -> list[Path]:
    """Draw trials in their order, so many to a page, with one legend above all of a page.

    Args:
        path: of the first page, PNG; a PDF goes beside it. Further pages are called ``<name>_2`` and so on.
        trials: how many there are.
        per_page: of them, at most.
        look: of every page.
        draw: one of them.
        columns_of_one: of the legend above a single trial, which may be narrower than all names side by side.

    Returns:
        paths of the pages.
    """
    pages = []
    for page, first in enumerate(range(0, trials, per_page), start=1):
        shown = range(first, min(first + per_page, trials))
        columns = min(_COLUMNS, len(shown))
        rows = -(-len(shown) // columns)
        with figure(20.0 + 58.0 * columns, look.extra_mm + look.row_mm * rows) as made:
            handles: list[Any] = []
            for i, (upper, lower) in zip(shown, _panels(made, len(shown), (rows, columns), look), strict=True):
                handles = max(handles, draw(upper, lower, i), key=len)
            named = len(handles) if len(shown) > 1 else columns_of_one
            made.legend(handles=handles, loc="outside upper center", ncols=named, frameon=False)
            pages.append(path if page == 1 else path.with_name(f"{path.stem}_{page}{path.suffix}"))
            save(made, pages[-1])
    return pages


def _panels(made: Any, trials: int, shape: tuple[int, int], look: Look) -> Iterator[tuple[Any, Any]]:
    """Upper and lower axes of each trial of a page, labelled at its edges."""
    grid, columns = made.add_gridspec(*shape), shape[1]
    for i in range(trials):
        cell = grid[i // columns, i % columns].subgridspec(2, 1, height_ratios=look.heights, hspace=look.gap)
        upper = made.add_subplot(cell[0])
        lower = made.add_subplot(cell[1], sharex=upper)
        if i % columns == 0:
            upper.set_ylabel(look.upper)
            lower.set_ylabel(look.lower)
        if i + columns >= trials:
            lower.set_xlabel("Time (s)")
        yield upper, lower
