"""Relative SRS in the manner of the paper's figure 6: along activation, amplitude and recovery, and its RMSD."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from xb_muscle_ros.evaluate.srs_scores import READINGS
from xb_muscle_ros.evaluate.srs_table import SrsTable, place
from xb_muscle_ros.figures.evaluate_look import MEASURED, look, shade
from xb_muscle_ros.figures.style import figure, save
from xb_muscle_ros.scores.activation import CLASSES, activation_class
from xb_muscle_ros.scores.conditions import (
    COMMON_AMPLITUDE_L0,
    COMMON_CLASS,
    COMMON_RECOVERY_S,
    LARGE_ABOVE_L0,
    LARGE_BELOW_S,
    SETS,
)
from xb_muscle_ros.scores.relative import nanmean, nansd
from xb_muscle_ros.trials.trial import Array

_READING = READINGS["released"]
_TOP = 1.75


class _Profile:
    """Relative SRS along one axis: shape (fibres, points), with x of the same shape or (points,)."""

    def __init__(self, table: SrsTable, along: str) -> None:
        pooled = list(table.pooled(_READING.unconditioned).values())
        each = np.array([p.test / np.where(p.unconditioned == 0.0, np.nan, p.unconditioned) for p in pooled])
        j, k = place(table.recovery_s, COMMON_RECOVERY_S), place(table.amplitude_l0, COMMON_AMPLITUDE_L0)
        level = CLASSES.index(COMMON_CLASS)
        empty = np.empty((each.shape[0], 0))
        if along == "activation":
            self.y = empty if j is None or k is None else each[:, :, j, k]
            self.x = np.array([_class_force(table, name) for name in table.fibres])[:, : self.y.shape[1]]
        elif along == "amplitude":
            moved = table.amplitude_l0 > 0.0
            self.y = empty if j is None else each[:, level, j, moved] if moved.any() else empty
            self.x = 100.0 * table.amplitude_l0[moved]
        else:
            self.y = empty if k is None else each[:, level, :, k]
            self.x = table.recovery_s
        if self.x.ndim == 1:
            self.x = np.broadcast_to(self.x[: self.y.shape[1]], self.y.shape)

    def means(self) -> tuple[Array, Array, Array]:
        """x, y and s.d. of y over fibres at the points that were tested."""
        y, sd = nanmean(self.y), nansd(self.y)
        some = np.isfinite(y)
        x = nanmean(np.where(np.isfinite(self.y), self.x, np.nan))
        return x[some], y[some], sd[some]


def draw_srs(
    path: Path, data: SrsTable, tables: Mapping[str, SrsTable], titles: Mapping[str, str], section: Mapping[str, Any]
) -> None:
    """Draw profiles of relative SRS (A to C) and its RMSD by model (D to F); PNG, and PDF beside it.

    Args:
        path: of the PNG.
        data: measured SRS.
        tables: simulated SRS by model.
        titles: what the models are called.
        section: ``srs`` of ``evaluate.json``.
    """
    with figure(180.0, 125.0) as made:
        axes = made.subplots(2, 3, sharey="row")
        for axis, along in zip(axes[0], ("activation", "amplitude", "recovery"), strict=True):
            _profile(axis, along, data, tables, titles)
        for axis, which in zip(axes[1], SETS, strict=True):
            _bars(axis, which, section)
        axes[0][0].set_ylabel("Relative SRS")
        axes[1][0].set_ylabel("RMSD of relative SRS")
        for letter, axis in zip("ABCDEF", axes.flat, strict=True):
            axis.set_title(f"{letter}  {axis.get_title(loc='left')}", loc="left", fontweight="bold")
        handles, labels = axes[0][0].get_legend_handles_labels()
        order = sorted(range(len(labels)), key=lambda k: not labels[k].startswith("measured"))
        made.legend(
            [handles[k] for k in order], [labels[k] for k in order], loc="outside upper center", ncols=4, frameon=False
        )
        axes[1][0].text(
            0.98, 0.97, "open: reading 'text'\nfilled: 'released'", transform=axes[1][0].transAxes, ha="right",
            va="top", fontsize=6.5,
        )  # fmt: skip
        save(made, path)


def _profile(axis: Any, along: str, data: SrsTable, tables: Mapping[str, SrsTable], titles: Mapping[str, str]) -> None:
    axis.axhline(1.0, color="black", linewidth=0.6, linestyle=(0, (1, 2)))
    measured = _Profile(data, along)
    shown = np.where(np.abs(measured.y) < 10.0, measured.y, np.nan)
    axis.plot(measured.x.ravel(), shown.ravel(), ".", color="black", markersize=1.8, zorder=2)
    x, y, sd = measured.means()
    tested = x.size > 0
    large = _large(along, x)
    for filled in (True, False):
        some = large == filled
        axis.errorbar(
            x[some], y[some], sd[some], fmt="o", color=MEASURED, markersize=5.5, capsize=1.5, linewidth=1.0,
            markerfacecolor=MEASURED if filled else "white", zorder=4,
            label=f"measured, {'large' if filled else 'small'} reduction",
        )  # fmt: skip
    for name, table in tables.items():
        way = look(name)
        x, y, _ = _Profile(table, along).means()
        tested |= x.size > 0
        order = np.argsort(x)
        axis.plot(
            x[order], y[order], color=way.colour, linestyle=way.line, linewidth=1.2, marker=way.marker, markersize=3.2,
            markerfacecolor="white" if way.hollow else way.colour, label=titles.get(name, name), zorder=3,
        )  # fmt: skip
    axis.set_ylim(0.0, _TOP)
    text = {
        "activation": ("Isometric force (F$_0$)", f"{100 * COMMON_AMPLITUDE_L0:g} % L$_0$, {COMMON_RECOVERY_S:g} s"),
        "amplitude": ("Amplitude (% L$_0$)", f"{COMMON_CLASS} activation, {COMMON_RECOVERY_S:g} s"),
        "recovery": ("Recovery time (s)", f"{COMMON_CLASS} activation, {100 * COMMON_AMPLITUDE_L0:g} % L$_0$"),
    }[along]
    axis.set_xlabel(text[0])
    axis.text(0.98, 0.97, text[1], transform=axis.transAxes, ha="right", va="top", fontsize=6.5)
    axis.set_title(along, loc="left")
    if not tested:
        axis.text(0.5, 0.5, "not tested", transform=axis.transAxes, ha="center", va="center")
    elif along == "recovery":
        axis.set_xscale("log")


def _large(along: str, x: Array) -> Any:
    """Which points of a profile the paper's text calls large reductions."""
    if along == "amplitude":
        return x > 100.0 * LARGE_ABOVE_L0
    if along == "recovery":
        return x < LARGE_BELOW_S
    return np.isin(activation_class(x), [CLASSES.index("low"), CLASSES.index("intermediate")])


def _class_force(table: SrsTable, fibre: str) -> Array:
    """Mean isometric force of a fibre in each class, F0, shape (classes,)."""
    force, classes = table.isometric_f0(fibre), table.classes(fibre)
    return np.array([nanmean(force[classes == level][:, None])[0] for level in range(len(CLASSES))])


def _bars(axis: Any, which: str, section: Mapping[str, Any]) -> None:
    models = list(section["models"])
    for k, name in enumerate(models):
        for side, reading in ((-0.2, "text"), (0.2, "released")):
            value = section["models"][name][reading]["rmsd"][which]
            if value is not None:
                way = look(name)
                fill = shade(way.colour, 0.4) if way.hollow else way.colour
                axis.bar(
                    k + side, value, 0.36, color=fill if reading == "released" else "white", edgecolor=way.colour,
                    linewidth=1.0, hatch="////" if way.hollow else None,
                )  # fmt: skip
    axis.set_xticks(range(len(models)), [name.replace("_", " ") for name in models], rotation=35, ha="right")
    axis.set_title(f"{which} reductions" if which != "all" else "all conditions", loc="left")
    axis.set_ylim(bottom=0.0)
