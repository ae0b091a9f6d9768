"""How models look in the figures of an evaluation: told apart by lightness, marker and dash, not by hue alone."""

from __future__ import annotations

from typing import NamedTuple

from xb_muscle_ros.evaluate.sets import ORDER, rank

MEASURED = "#8a8a8a"
# Neighbours in complexity differ in lightness; hues after Okabe and Ito.
_COLOURS = ("#8ecdf0", "#0b4f8a", "#c1440e", "#e9b44c", "#5e3c99", "#117a55")
_MARKERS = ("o", "s", "^", "D", "v", "P")
_DASHES: tuple[tuple[float, ...], ...] = ((1, 1), (4, 1.5), (4, 1.5, 1, 1.5), (2, 1), (), (7, 2))


class Look(NamedTuple):
    """Of one model.

    Attributes:
        colour, marker: Matplotlib's.
        dashes: lengths on and off; empty for a full line.
        hollow: a later version of a set: open markers, hatched bars.
    """

    colour: str
    marker: str
    dashes: tuple[float, ...]
    hollow: bool

    @property
    def line(self) -> tuple[int, tuple[float, ...]] | str:
        """Matplotlib's line style."""
        return (0, self.dashes) if self.dashes else "-"


def look(model: str) -> Look:
    """Look of a parameter set by its model's place in complexity."""
    place = rank(model)
    return Look(_COLOURS[place], _MARKERS[place], _DASHES[place], model not in ORDER)


def shade(colour: str, depth: float) -> tuple[float, float, float]:
    """A colour mixed with white: depth 1 is the colour, 0 white."""
    from matplotlib.colors import to_rgb

    red, green, blue = to_rgb(colour)
    return (1.0 - depth * (1.0 - red), 1.0 - depth * (1.0 - green), 1.0 - depth * (1.0 - blue))
