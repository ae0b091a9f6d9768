"""How a protocol's figures tell data and models apart: by shape, lightness and dash, not by hue alone."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from xb_muscle_ros.models.titles import title_of
from xb_muscle_ros.plotting.style import DATA, MODEL, SECOND, THIRD
from xb_muscle_ros.protocols.base import MEASURED, Found

_COLOURS = (MODEL, SECOND, THIRD, "#5e3c99", "#e9b44c", "#8ecdf0")
_MARKERS = ("s", "^", "D", "v", "P", "X")
_DASHES: tuple[Any, ...] = ("-", (0, (4, 1.5)), (0, (1, 1)), (0, (4, 1.5, 1, 1.5)), (0, (7, 2)), (0, (2, 1)))


class Look(NamedTuple):
    """Of what was measured or of one model; keywords of Matplotlib's ``plot``.

    Attributes:
        trace: of records.
        points: of single numbers, without a line between them.
        curve: of a line fitted to these.
    """

    trace: dict[str, Any]
    points: dict[str, Any]
    curve: dict[str, Any]


def looks(found: Sequence[Found]) -> list[tuple[Look, Found]]:
    """A look for each: what was measured is grey and round."""
    made, models = [], 0
    for each in found:
        if each.of == MEASURED:
            colour, marker, dash = DATA, "o", "-"
        else:
            k = models % len(_COLOURS)
            colour, marker, dash, models = _COLOURS[k], _MARKERS[k], _DASHES[k], models + 1
        name = label(each)
        points = {
            "linestyle": "none", "marker": marker, "color": colour, "markersize": 4.0, "label": name,
            "markeredgecolor": "black", "markeredgewidth": 0.4,
        }  # fmt: skip
        curve = {"color": colour, "linestyle": dash, "linewidth": 1.2, "label": "_"}
        made.append((Look({**curve, "linewidth": 0.9, "label": name}, points, curve), each))
    return made


def label(found: Found) -> str:
    """What stands in a legend."""
    return "measured" if found.of == MEASURED else title_of(found.of)


def legend(axis: Any) -> None:
    """A legend of what was drawn, each name once."""
    handles, names = axis.get_legend_handles_labels()
    once = dict(zip(names, handles, strict=True))
    if once:
        axis.legend(once.values(), once.keys(), frameon=False, handlelength=1.8)


def logarithmic(axis: Any, x: bool = True, y: bool = False) -> None:
    """Logarithmic scales, where the lines of an axis have a positive number to show on them."""
    # A line across an axis is none that shows data.
    data = [line for line in axis.get_lines() if all(line.get_transform().contains_branch_seperately(axis.transData))]
    drawn = [points[np.all(np.isfinite(points), axis=1)] for points in (line.get_xydata() for line in data)]
    for asked, column, scale in ((x, 0, axis.set_xscale), (y, 1, axis.set_yscale)):
        if asked and any(np.any(points[:, column] > 0.0) for points in drawn):
            scale("log")


def lettered(axes: Sequence[Any]) -> None:
    """A, B, C ... above axes."""
    for letter, axis in zip("ABCDEFGH", axes, strict=False):
        axis.set_title(letter, loc="left", fontweight="bold")


def plainly(axis: Any) -> None:
    """Plain numbers at 1, 2 and 5 of each decade of a logarithmic axis (an ``axes.xaxis`` or ``axes.yaxis``)."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())
