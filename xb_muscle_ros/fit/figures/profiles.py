"""Profiles of a fit: the root of the likelihood ratio over each parameter, with its interval and what ends it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import chi2

from xb_muscle_ros.fit.ends import DATA as BY_DATA
from xb_muscle_ros.fit.ends import PRIOR
from xb_muscle_ros.plotting.style import DATA, MODEL, SECOND, SHADE, figure, save

_COLUMNS = 4
_PANEL_MM = (42.0, 40.0)
# The legend wants as much, however few the panels.
_LEAST_WIDTH_MM = 100.0
# From this ratio of its limits on an axis is logarithmic; below it a linear one reads better.
_LOG_RATIO = 8.0
_MOST_TICKS = 4
_STYLES = {BY_DATA: "-", PRIOR: "-."}
_ENDS = {BY_DATA: "end by the data", PRIOR: "end by the prior"}
_OPEN = (0, (4, 2))
_MARGIN = 0.08
# Letters below one panel.
_LONGEST_LABEL = 22


def draw_profiles(path: Path, found: Mapping[str, Any]) -> Path:
    """Draw a panel for each profiled parameter into a PNG, and a PDF beside it; returns the path."""
    rows = [row for row in found["parameters"] if "profile" in row]
    columns = min(_COLUMNS, len(rows))
    lines = -(-len(rows) // columns)
    limit = float(np.sqrt(chi2.ppf(found["level"], 1)))
    width = max(_LEAST_WIDTH_MM, 12.0 + _PANEL_MM[0] * columns)
    with figure(width, 18.0 + _PANEL_MM[1] * lines) as made:
        handles: dict[str, Any] = {}
        for i, row in enumerate(rows):
            axes = made.add_subplot(lines, columns, i + 1)
            handles |= _panel(axes, row, limit, f"{100.0 * found['level']:g} % limit")
            if i % columns == 0:
                axes.set_ylabel("√(likelihood ratio)")
        made.legend(
            handles=list(handles.values()),
            labels=list(handles),
            loc="outside upper center",
            ncols=3 if columns > 2 else 2,
            frameon=False,
        )
        save(made, path)
    return path


def _panel(axes: Any, row: Mapping[str, Any], limit: float, limit_name: str) -> dict[str, Any]:
    """One parameter; returns handles by label."""
    x, root = np.array(row["profile"], dtype=np.float64).T
    low, high = limits(row)
    ordinate = max(3.0, 1.2 * limit)
    handles: dict[str, Any] = {}
    axes.axvspan(*row["interval"], color=SHADE, linewidth=0.0, zorder=0)
    (handles["profile"],) = axes.plot(x, root, color=MODEL, marker="o", markersize=3, zorder=3)
    handles[limit_name] = axes.axhline(limit, color="black", linewidth=0.6, linestyle=":", zorder=1)
    for end, what in zip(row["interval"], row["interval_ended_by"], strict=True):
        label = _ENDS.get(what, "open: a bound or none")
        handles[label] = axes.axvline(end, color=SECOND, linewidth=0.9, linestyle=_STYLES.get(what, _OPEN), zorder=2)
    handles["start (arrow: beyond the axis)"] = _start(axes, float(row["start"]), low, high)
    scale(axes, low, high)
    axes.set_ylim(-0.12, ordinate)
    unit = "" if row["unit"] == "1" else f"({row['unit']})"
    gap = "\n" if len(row["name"]) + len(unit) > _LONGEST_LABEL else " "
    axes.set_xlabel(f"{row['name']}{gap if unit else ''}{unit}")
    return handles


def limits(row: Mapping[str, Any]) -> tuple[float, float]:
    """Ends of a profile's axis: the points followed and the interval, with a margin, wherever the fit started."""
    x = np.array([*(x for x, _ in row["profile"]), *row["interval"]], dtype=np.float64)
    low, high = float(x.min()), float(x.max())
    if low > 0.0 and high / low >= _LOG_RATIO:
        wide = (high / low) ** _MARGIN
        return low / wide, high * wide
    wide = _MARGIN * ((high - low) or abs(high) or 1.0)
    return low - wide, high + wide


def _start(axes: Any, start: float, low: float, high: float) -> Any:
    """Where the fit began: on the axis, or beyond its end with the value beside an arrow."""
    style = {"color": DATA, "markeredgecolor": "black", "markeredgewidth": 0.5, "linestyle": "none"}
    if low <= start <= high:
        return axes.plot([start], [0.0], marker="^", markersize=6, clip_on=False, zorder=4, **style)[0]
    right = start > high
    transform = axes.get_yaxis_transform()
    marker = ">" if right else "<"
    place, side = (1.0, "right") if right else (0.0, "left")
    axes.plot([place], [0.0], marker=marker, markersize=6, clip_on=False, zorder=4, transform=transform, **style)
    axes.annotate(
        short_number(float(f"{start:.3g}")),
        (place, 0.0), xycoords=transform, xytext=(-6 if right else 6, 3), textcoords="offset points",
        ha=side, va="bottom", fontsize=6.5, color="black", zorder=5,
        bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 0.5},
    )  # fmt: skip
    return axes.plot([], [], marker="^", markersize=6, **style)[0]


def scale(axes: Any, low: float, high: float) -> None:
    """Set limits, scale and a few ticks of an axis of abscissae."""
    from matplotlib.ticker import FuncFormatter, MaxNLocator, NullFormatter

    if low > 0.0 and high / low >= _LOG_RATIO:
        axes.set_xscale("log")
        ticks = log_ticks(low, high)
        axes.set_xticks(ticks, [short_number(tick) for tick in ticks])
        axes.xaxis.set_minor_formatter(NullFormatter())
    else:
        axes.xaxis.set_major_locator(MaxNLocator(nbins=_MOST_TICKS - 1, steps=[1, 2, 2.5, 5, 10]))
        axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: short_number(value)))
    axes.set_xlim(low, high)


def log_ticks(low: float, high: float) -> list[float]:
    """At most four round numbers between two positive ones, evenly spread on a logarithmic axis."""
    decades = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    for steps in ((1.0, 2.0, 5.0), (1.0, 3.0), (1.0,)):
        ticks = [float(f"{s}e{d}") for d in decades for s in steps]
        inside = [tick for tick in ticks if low <= tick <= high]
        if len(inside) <= _MOST_TICKS:
            return inside
    every = -(-len(inside) // _MOST_TICKS)
    return inside[::every]


def short_number(value: float) -> str:
    """A tick's number in few letters: 0.25, 12000, 3e−4."""
    if value != 0.0 and not 1e-3 <= abs(value) < 1e5:
        digits, power = f"{value:.5e}".split("e")
        return f"{digits.rstrip('0').rstrip('.')}e{int(power)}".replace("-", "−")
    return f"{value:.7g}".replace("-", "−")
