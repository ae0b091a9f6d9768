"""Fibres side by side: what each says of every component by itself, and its error before and after."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from xb_muscle_ros.diagnose.component import NAMED, Component
from xb_muscle_ros.diagnose.report import phrases as say
from xb_muscle_ros.diagnose.report.figures.common import (
    DOTS,
    WIDTH_MM,
    Figure,
    finite,
    shown_of,
    svg,
    unique,
    wrapped,
)
from xb_muscle_ros.diagnose.result import Diagnosis, OfStudyFibre
from xb_muscle_ros.plotting.style import DATA, MODEL, SECOND, figure

_FIBRES, _COMPONENTS = 12, 10
# Columns in which a gain has room beside its standard error.
_ROOMY = 6
_ROW_MM, _DOTS_MM = 9.0, 42.0
_DARK = 0.62
# Candidates that no fibre gives as much are left out.
_LEAST = 0.05


def draw_fibres(d: Diagnosis) -> Figure | None:
    """Matrix of components and fibres over the fibres' errors; None for one fibre."""
    if len(d.by_fibre) < 2:
        return None
    fibres = d.by_fibre[:_FIBRES]
    known = [c for c in d.components if c.by_fibre]
    shown = [c for c in known if max(_of_any(c)) >= _LEAST][:_COMPONENTS]
    matrix_mm = 14.0 + _ROW_MM * len(shown)
    with figure(WIDTH_MM, matrix_mm + _DOTS_MM + 12.0) as made:
        heights = (matrix_mm, _DOTS_MM)
        axes = made.subplots(2, 1, sharex=True, height_ratios=heights) if shown else [None, made.subplots()]
        if shown:
            _matrix(axes[0], shown, fibres)
        handles = _errors(axes[1], fibres, 1 + say.changed(d))
        upright = len(fibres) > _ROOMY
        names = [wrapped(row.fibre, 18, 2) if upright else wrapped(row.fibre, 11, 2) for row in fibres]
        axes[1].set_xticks(range(len(fibres)), names, fontsize=7, rotation=90 if upright else 0)
        axes[1].set_xlim(-0.5, len(fibres) - 0.5)
        made.legend(handles=handles, loc="outside lower center", ncols=4, frameon=False)
        caption = (
            "Top: inclusion probability of each component from the recordings of one fibre alone (shade and upper "
            f"number), and its held-out gain there{'' if upright else ' with standard error'} (lower number). "
            f"Heavy frame: {NAMED:g} or more. Bottom: held-out force RMSD of each fibre, base (open) and answer "
            "(filled); squares, the held-out fibre, predicted with effects as the others have them."
            f"{shown_of(len(fibres), len(d.by_fibre), 'fibres', 'the first given')}"
            f"{shown_of(len(shown), len(known), 'candidates', 'the most probable')}"
        )
        return Figure(svg(made), caption, "Components and errors of every fibre side by side")


def _of_any(c: Component) -> list[float]:
    """Probabilities by all fibres and by each."""
    return finite([c.inclusion_probability, *(row.inclusion_probability for row in c.by_fibre)]) or [0.0]


def _matrix(axis: Any, shown: Sequence[Component], fibres: Sequence[OfStudyFibre]) -> None:
    import matplotlib as mpl
    from matplotlib.patches import Rectangle

    values = np.full((len(shown), len(fibres)), np.nan)
    rows = [{row.fibre: row for row in c.by_fibre} for c in shown]
    for i, of in enumerate(rows):
        for j, fibre in enumerate(fibres):
            if fibre.fibre in of:
                values[i, j] = of[fibre.fibre].inclusion_probability
    # From white to a blue that print in grey keeps apart.
    colours = mpl.colors.LinearSegmentedColormap.from_list("probability", ["white", MODEL])
    axis.imshow(values, cmap=colours, vmin=0.0, vmax=1.0, aspect="auto")
    for i, of in enumerate(rows):
        for j, fibre in enumerate(fibres):
            if not math.isfinite(values[i, j]):
                axis.text(j, i, say.NOTHING, ha="center", va="center", fontsize=7)
                continue
            colour = "white" if values[i, j] > _DARK else "black"
            axis.text(j, i - 0.17, say.probability(values[i, j]), ha="center", va="center", fontsize=7.5, color=colour)
            gain = say.gain(of[fibre.fibre].heldout_gain)
            gain = gain if len(fibres) <= _ROOMY else gain.split(" ")[0]
            axis.text(j, i + 0.25, gain, ha="center", va="center", fontsize=6.5, color=colour)
            if values[i, j] >= NAMED:
                axis.add_patch(Rectangle((j - 0.47, i - 0.45), 0.94, 0.9, fill=False, edgecolor="black", linewidth=1.1))
    axis.set_yticks(range(len(shown)), [wrapped(say.title(c), 30) for c in shown], fontsize=7)
    axis.tick_params(length=0, labelbottom=False)
    axis.spines[:].set_visible(False)


def _errors(axis: Any, fibres: Sequence[OfStudyFibre], models: int) -> list[Any]:
    from matplotlib.ticker import MaxNLocator

    unseen = any(row.before.heldout_rmsd_f0 is not None for row in fibres)
    handles: list[Any] = []
    for k, row in enumerate(fibres):
        scores = (row.before, row.after)
        pair = [s.heldout_rmsd_f0 if unseen else s.train_rmsd_f0 for s in scores]
        handles += _pair(axis, k - (0.13 if row.left_out_rmsd_f0 else 0.0), pair[:models], "o", "")
        if row.left_out_rmsd_f0:
            handles += _pair(axis, k + 0.13, row.left_out_rmsd_f0[:models], "s", ", held-out fibre")
    axis.set_ylim(0.0, 1.08 * axis.get_ylim()[1])
    axis.yaxis.set_major_locator(MaxNLocator(5))
    axis.set_ylabel(f"{'Held-out force' if unseen else 'Force'} RMSD (% F$_0$)")
    axis.grid(axis="y", color="#ececec", linewidth=0.6)
    axis.set_axisbelow(True)
    return unique(handles)


def _pair(axis: Any, at: float, pair: Sequence[float | None], mark: str, more: str) -> list[Any]:
    known = [100.0 * v for v in finite(pair)]
    if len(known) == 2:
        axis.plot([at, at], known, color=DATA, linewidth=1.2, zorder=1)
    handles: list[Any] = []
    for value, look, colour in zip(pair, DOTS, (SECOND, MODEL), strict=False):
        for y in finite([value]):
            changed = {**look, "marker": mark, "markeredgecolor": colour, "label": look["label"] + more}
            handles += axis.plot([at], [100.0 * y], markersize=5, **changed)
    return handles
