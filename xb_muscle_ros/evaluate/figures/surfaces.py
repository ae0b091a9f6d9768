"""Relative SRS over amplitude and recovery time in the manner of the paper's figure 7: a surface for each model."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from xb_muscle_ros.evaluate.srs_scores import READINGS
from xb_muscle_ros.evaluate.srs_table import SrsTable
from xb_muscle_ros.models.titles import title_of
from xb_muscle_ros.plotting.style import figure, save
from xb_muscle_ros.scores.conditions import CLASSES, Mask
from xb_muscle_ros.scores.relative import nanmean
from xb_muscle_ros.trials.trial import Array

_READING = READINGS["released"]
_SUBMAXIMAL = ("low", "intermediate")
_COLUMNS = 3
_LIMITS = (0.3, 1.2)


def submaximal(table: SrsTable) -> Array:
    """Relative SRS at low and intermediate activation, mean over fibres and both, shape (recovery, amplitude)."""
    centre = table.relative(_READING.averaging, _READING.unconditioned).centre
    return nanmean(centre[[CLASSES.index(name) for name in _SUBMAXIMAL]])


def draw_surfaces(path: Path, data: SrsTable, tables: Mapping[str, SrsTable]) -> list[str]:
    """Draw a panel for each model with the measured conditions as dots; PNG, and PDF beside it.

    Stems lead from a dot to the model's surface. A model without at least two amplitudes and two recovery times has no
    surface and is left out.

    Returns:
        names of the models drawn.
    """
    shown = [name for name, table in tables.items() if min(_rectangle(submaximal(table))[0].shape) > 1]
    if not shown:
        return []
    columns = min(_COLUMNS, len(shown))
    rows = -(-len(shown) // columns)
    # Automatic layout fails on a single 3-D panel beside a colour bar; places are given in mm.
    width, height = 30.0 + 62.0 * columns, 8.0 + max(54.0 * rows, 70.0)
    with figure(width, height) as made:
        made.set_layout_engine(None)
        made.subplots_adjust(left=0.01, right=1.0 - 30.0 / width, bottom=8.0 / height, top=1.0 - 7.0 / height)
        made.subplots_adjust(wspace=0.12, hspace=0.14)
        axes = [made.add_subplot(rows, columns, k + 1, projection="3d") for k in range(len(shown))]
        for axis, name in zip(axes, shown, strict=True):
            drawn = _panel(axis, data, tables[name])
            axis.set_title(title_of(name), fontsize=8, y=1.02)
            axis.set_box_aspect((1.0, 1.0, 0.75), zoom=1.05)
        place = made.add_axes((1.0 - 18.0 / width, 0.5 - 28.0 / height, 3.0 / width, 56.0 / height))
        bar = made.colorbar(drawn, cax=place)
        bar.set_label("Relative SRS, low and intermediate activation")
        save(made, path)
    return shown


def _panel(axis: Any, data: SrsTable, table: SrsTable) -> Any:
    surface, rows, columns = _rectangle(submaximal(table))
    x, y = 100.0 * table.amplitude_l0[columns], np.log10(table.recovery_s[rows])
    mesh = np.meshgrid(x, y)
    import matplotlib as mpl

    scale = mpl.colors.Normalize(*_LIMITS)
    faces = mpl.colormaps["cividis"](scale(surface))
    axis.plot_surface(
        *mesh, surface, facecolors=faces, rcount=50, ccount=50, edgecolor=(0, 0, 0, 0.55), linewidth=0.3, alpha=0.85,
        shade=False,
    )  # fmt: skip
    _dots(axis, data, (x, y, surface))
    axis.set(xlabel="AMP (% L$_0$)", ylabel="RT (s)", zlim=(0.0, 1.3))
    decades = np.arange(np.floor(y.min()), np.ceil(y.max()) + 1, 2)
    axis.set_yticks(decades, [f"10$^{{{int(d)}}}$" for d in decades])
    axis.tick_params(labelsize=6.5, pad=-2)
    axis.xaxis.labelpad = axis.yaxis.labelpad = -5
    axis.view_init(elev=22.0, azim=40.0)
    return mpl.cm.ScalarMappable(scale, mpl.colormaps["cividis"])


def _dots(axis: Any, data: SrsTable, surface: tuple[Array, Array, Array]) -> None:
    from scipy.interpolate import RegularGridInterpolator

    measured = submaximal(data)
    x, y, values = surface
    at = RegularGridInterpolator((y, x), values, bounds_error=False)
    for j, k in np.argwhere(np.isfinite(measured)).tolist():
        here = (100.0 * float(data.amplitude_l0[k]), float(np.log10(data.recovery_s[j])))
        there = float(at((here[1], here[0])))
        z = float(measured[j, k])
        if np.isfinite(there):
            axis.plot([here[0]] * 2, [here[1]] * 2, [z, there], color="black", linewidth=0.5, zorder=9)
        axis.plot([here[0]], [here[1]], [z], "o", color="white", markeredgecolor="black", markersize=3.0, zorder=10)


def _rectangle(values: Array) -> tuple[Array, Mask, Mask]:
    """The part of a table without gaps, and its rows and columns: amplitudes that lack a recovery time go."""
    rows = np.any(np.isfinite(values), axis=1)
    columns = np.all(np.isfinite(values[rows]), axis=0) & np.any(rows)
    return values[np.ix_(rows, columns)], rows, columns
