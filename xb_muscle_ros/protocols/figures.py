"""How a protocol's figures tell data and models apart: by shape, lightness and dash, not by hue alone."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.models.titles import title_of
from xb_muscle_ros.plotting.style import DATA, MODEL, SECOND, THIRD
from xb_muscle_ros.protocols.base import MEASURED, Found
from xb_muscle_ros.trials.trial import Array

_COLOURS = (MODEL, SECOND, THIRD, "#5e3c99", "#e9b44c", "#8ecdf0")
# A logarithmic axis from one end to so many times it has room for 1, 2 and 5 of each decade.
_WIDE = 500.0
_MARKERS = ("s", "^", "D", "v", "P", "X")
_DASHES: tuple[Any, ...] = ("-", (0, (4, 1.5)), (0, (1, 1)), (0, (4, 1.5, 1, 1.5)), (0, (7, 2)), (0, (2, 1)))


# Shares of black and white in the colours of the most and the least calcium, the colour that tells them in a legend,
# and how many of them it has; and how often a word is moved to be free of others.
_DARKEST_TO_LIGHTEST, _KEY, _MOST_SHADES, _MOVES = (-0.3, 0.6), "#5a5a5a", 6, 40


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
    once: dict[str, Any] = {}
    for name, handle in zip(names, handles, strict=True):
        once.setdefault(name, handle)
    if once:
        axis.legend(once.values(), once.keys(), frameon=False, handlelength=1.8)


class Shade(NamedTuple):
    """Of one level of pCa.

    Attributes:
        pca: the level; NaN where it is not known.
        share: of white in its colour; negative: of black.
    """

    pca: float
    share: float


def shades(found: Sequence[Found]) -> list[Shade]:
    """A lightness for each level of pCa, the most calcium first and darkest; one level keeps its colour."""
    pca = np.concatenate([_levels(each) for each in found])
    levels = np.unique(pca)
    darkest, lightest = _DARKEST_TO_LIGHTEST if levels.size > 1 else (0.0, 0.0)
    return [Shade(*each) for each in zip(levels.tolist(), np.linspace(darkest, lightest, levels.size), strict=True)]


def at_level(found: Found, shade: Shade) -> npt.NDArray[np.bool_]:
    """Which rows are of a level, shape (rows,)."""
    levels = _levels(found)
    return np.isnan(levels) if np.isnan(shade.pca) else levels == shade.pca


def shaded(look: Look, shade: Shade) -> Look:
    """The same look in the lightness of a level of pCa."""
    return Look(*({**each, "color": mixed(each["color"], shade.share)} for each in look))


def mixed(colour: str, share: float) -> tuple[float, float, float]:
    """A colour with a share of white, or, where it is negative, of black."""
    from matplotlib.colors import to_rgb

    red, green, blue = ((1.0 - abs(share)) * each + max(share, 0.0) for each in to_rgb(colour))
    return red, green, blue


def legend_of_pca(axis: Any, levels: Sequence[Shade]) -> None:
    """Which lightness is which pCa, where there are several; of many levels some."""
    from matplotlib.lines import Line2D

    if len(levels) < 2:
        return
    some = np.unique(np.linspace(0, len(levels) - 1, min(len(levels), _MOST_SHADES)).round()).astype(int)
    shown = [levels[k] for k in some]
    lines = [Line2D([], [], color=mixed(_KEY, each.share), linewidth=2.0) for each in shown]
    names = ["not known" if np.isnan(each.pca) else f"{each.pca:g}" for each in shown]
    made = axis.legend(lines, names, title="pCa", title_fontsize=7.5, frameon=True, handlelength=1.4, labelspacing=0.25)
    made.get_frame().set(facecolor="white", edgecolor="none", alpha=0.85)


def _levels(found: Found) -> Array:
    levels: Array = np.round(found.column("pca"), 6)
    return levels


def spread(axis: Any, marks: Sequence[tuple[float, float, str]], beside: bool) -> None:
    """Words at points, moved upwards where they would lie on each other.

    Args:
        marks: x, y and text of each, in data.
        beside: to the right of its point; else above it.
    """
    figure = axis.figure
    figure.draw_without_rendering()  # where points lie is known once the axes have their places
    renderer, taken = figure.canvas.get_renderer(), list[Any]()
    for x, y, text in sorted(marks, key=lambda mark: mark[1]):
        said = axis.annotate(
            text, (x, y), (3, 0) if beside else (0, 2), textcoords="offset points", fontsize=6.5,
            ha="left" if beside else "center", va="center" if beside else "bottom", annotation_clip=False,
        )  # fmt: skip
        for _ in range(_MOVES):
            box = said.get_window_extent(renderer)
            hit = [each for each in taken if each.overlaps(box)]
            if not hit:
                break
            up = (max(each.y1 for each in hit) - box.y0) * 72.0 / figure.dpi + 0.5
            said.xyann = (said.xyann[0], said.xyann[1] + up)
        taken.append(said.get_window_extent(renderer))


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
    """Plain numbers at 1, 2 and 5 of each decade of a logarithmic axis (an ``axes.xaxis`` or ``axes.yaxis``).

    Of many decades at 1 alone.
    """
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    low, high = axis.get_view_interval()
    many = low > 0.0 and high > _WIDE * low
    axis.set_major_locator(LogLocator(subs=(1.0,) if many else (1.0, 2.0, 5.0)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())
