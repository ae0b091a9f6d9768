"""Residual of base and answer by trial and phase."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

import numpy as np

from xb_muscle_ros.diagnose.report.figures.common import (
    WIDTH_MM,
    Figure,
    Key,
    by_activation,
    key,
    shown_of,
    svg,
    trial_labels,
    wrapped,
)
from xb_muscle_ros.diagnose.report.phrases import ONE_WAY, changed
from xb_muscle_ros.diagnose.residual import ResidualMap
from xb_muscle_ros.diagnose.result import Diagnosis
from xb_muscle_ros.diagnose.words import phase_words
from xb_muscle_ros.plotting.style import figure
from xb_muscle_ros.trials.trial import Array

_TRIALS, _PHASES = 36, 8
_ROW_MM = 5.2
# Below this lightness of a cell its numbers are white; colours reach at least so far (% F0).
_DARK, _LEAST = 0.5, 0.3

Cells = dict[tuple[Key, str], tuple[float, float, bool]]


def draw_map(d: Diagnosis) -> Figure | None:
    """Two maps side by side, base and answer; None where there is none."""
    maps = [cells(d.map_before), *([cells(d.map_after)] if changed(d) else [])]
    if not maps[0]:
        return None
    known = {phase for _, phase in maps[0]}
    phases = [p for p in dict.fromkeys(p for of in d.map_before.values() for p in of.phases) if p in known]
    worst = {t: max((maps[0].get((key(t), p), (0.0, 0.0, False))[0] for p in phases), default=0.0) for t in d.trials}
    rows = [t for t in by_activation(d.trials) if any((key(t), p) in maps[0] for p in phases)]
    shown = sorted(rows, key=lambda t: -worst[t])[:_TRIALS]
    shown = [t for t in rows if t in shown]
    columns = phases if len(phases) <= _PHASES else _largest(maps[0], phases)
    values = [abs(v[1]) for of in maps for v in of.values() if math.isfinite(v[1])]
    limit = 100.0 * max([_LEAST / 100.0, *values])
    framed = not all(v[2] for v in maps[0].values())
    with figure(WIDTH_MM if len(maps) > 1 else 0.6 * WIDTH_MM, 42.0 + _ROW_MM * len(shown)) as made:
        axes = made.subplots(1, len(maps), sharey=True, squeeze=False)[0]
        labels = trial_labels(d)
        image = None
        for axis, of, title in zip(axes, maps, ("base model", "answer"), strict=False):
            image = _draw(axis, of, [key(t) for t in shown], columns, limit, framed)
            axis.set_title(title, loc="left")
        axes[0].set_yticks(range(len(shown)), [labels[key(t)] for t in shown], fontsize=6.5)
        bar = made.colorbar(image, ax=list(axes), location="bottom", shrink=0.5, aspect=45, pad=0.02)
        bar.set_label("Mean of measured less model (% F$_0$)")
        bar.outline.set_visible(False)
        return Figure(svg(made), _caption(d, framed, len(shown), len(columns), phases), "Residual by trial and phase")


def _caption(d: Diagnosis, framed: bool, shown: int, columns: int, phases: Sequence[str]) -> str:
    frame = "Heavy frame: beyond chance and large enough to count." if framed else "Every cell of the base counts."
    both = " and answer" if changed(d) else ""
    return (
        f"Residual of base{both} by trial and phase, % F0. Colour: mean. Number: root mean square, with + where "
        "measured force is higher than the model's, − where lower, ± where it goes both ways. "
        f"{frame} Hatched: the trial has no such phase."
        f"{shown_of(shown, len(d.trials), 'trials', 'those with the largest residual of the base')}"
        f"{shown_of(columns, len(phases), 'phases', 'those with the largest residual of the base')}"
    )


def cells(maps: Mapping[str, ResidualMap]) -> Cells:
    """Root mean square, mean (F0) and whether it counts, by trial and phase."""
    return {
        ((fibre, trial), phase): (rms, math.nan if mean is None else mean, counts)
        for fibre, of in maps.items()
        for trial, phase, rms, mean, counts in of.cells()
        if math.isfinite(rms)
    }


def _largest(of: Cells, phases: Sequence[str]) -> list[str]:
    size = {p: max(v[0] for (_, q), v in of.items() if q == p) for p in phases}
    kept = sorted(phases, key=lambda p: -size[p])[:_PHASES]
    return [p for p in phases if p in kept]


def _draw(axis: Any, of: Cells, trials: Sequence[Key], phases: Sequence[str], limit: float, framed: bool) -> Any:
    from matplotlib.patches import Rectangle

    none = (math.nan, math.nan, False)
    means: Array = np.array([[100.0 * of.get((t, p), none)[1] for p in phases] for t in trials])
    image = axis.imshow(means, cmap=_colours(), vmin=-limit, vmax=limit, aspect="auto")
    size = 6.5 if len(phases) < 7 else 5.5
    for i, trial in enumerate(trials):
        for j, phase in enumerate(phases):
            rms, mean, counts = of.get((trial, phase), none)
            box = (j - 0.5, i - 0.5)
            if not math.isfinite(rms):
                axis.add_patch(
                    Rectangle(box, 1, 1, facecolor="#f2f2f2", edgecolor="#c4c4c4", hatch="////", linewidth=0)
                )
                continue
            red, green, blue, _ = _colours()(0.5 + 50.0 * mean / limit if math.isfinite(mean) else 0.5)
            colour = "white" if 0.299 * red + 0.587 * green + 0.114 * blue < _DARK else "black"
            axis.text(j, i, _signed(rms, mean), ha="center", va="center", fontsize=size, color=colour)
            if counts and framed:
                frame = (j - 0.46, i - 0.42)
                axis.add_patch(Rectangle(frame, 0.92, 0.84, fill=False, edgecolor="black", linewidth=1.0))
    axis.set_xticks(
        range(len(phases)), [wrapped(phase_words(p), 13, 2) for p in phases], rotation=90, fontsize=6.5, ha="center"
    )
    axis.tick_params(length=0)
    axis.spines[:].set_visible(False)
    return image


def _signed(rms: float, mean: float) -> str:
    one_way = math.isfinite(mean) and abs(mean) >= ONE_WAY * rms
    sign = ("+" if mean > 0.0 else "−") if one_way else "±"
    percent = 100.0 * rms
    # As many characters in every cell.
    return sign + (f"{percent:.2f}" if percent < 0.995 else f"{percent:.1f}" if percent < 9.95 else f"{percent:.0f}")


@cache
def _colours() -> Any:
    """Violet over white to orange, without the ends in which both are black."""
    import matplotlib as mpl

    return mpl.colors.ListedColormap(mpl.colormaps["PuOr_r"](np.linspace(0.1, 0.9, 256)))
