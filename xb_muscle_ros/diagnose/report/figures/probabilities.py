"""How probable each component is, and what predictions lose without it."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from xb_muscle_ros.diagnose.component import NAMED, SURE, Component, HeldOutGain, Kind
from xb_muscle_ros.diagnose.report import phrases as say
from xb_muscle_ros.diagnose.report.figures.common import (
    KIND_LOOKS,
    WIDTH_MM,
    Figure,
    finite,
    quiet_rows,
    shown_of,
    svg,
    wrapped,
)
from xb_muscle_ros.diagnose.result import Diagnosis
from xb_muscle_ros.plotting.style import DATA, figure

_MOST, _ROW_MM = 14, 6.4
_PERCENT = (-200, -100, -50, -20, -10, -5, -2, -1, 0, 1, 2, 5, 10, 20, 30, 40, 50, 60, 70, 80, 90)


def draw_probabilities(d: Diagnosis) -> Figure | None:
    """Bars of inclusion probability, dots of held-out gain beside them; None without components."""
    from matplotlib.patches import Patch

    shown = d.components[:_MOST]
    if not shown:
        return None
    gains = [c.heldout_gain for c in shown]
    tried = any(g is not None and math.isfinite(g.mean) for g in gains)
    with figure(WIDTH_MM, 29.0 + _ROW_MM * len(shown)) as made:
        axes = made.subplots(1, 2 if tried else 1, squeeze=False, sharey=True, width_ratios=(1.2, 1)[: 1 + tried])[0]
        for place, c in enumerate(shown):
            _bar(axes[0], place, c)
            if tried and c.heldout_gain is not None:
                _gain(axes[1], place, c.heldout_gain, KIND_LOOKS[c.kind]["edgecolor"])
        _probability_axis(axes[0], shown)
        if tried:
            _gain_axis(axes[1])
        kinds = [
            Patch(label="mechanism", **KIND_LOOKS[Kind.MECHANISM]),
            Patch(label="measurement artefact", **KIND_LOOKS[Kind.ARTEFACT]),
        ]
        made.legend(handles=kinds, loc="outside upper center", ncols=2, frameon=False)
        return Figure(
            svg(made), _caption(d, len(shown), tried), "Inclusion probability and held-out gain of components"
        )


def _caption(d: Diagnosis, shown: int, tried: bool) -> str:
    gain = (
        " Right: held-out gain with its standard error over conditions; right of zero predictions are better with it."
        if tried
        else " No held-out gain was computed."
    )
    return (
        f"Left: inclusion probability; from {NAMED:g} (dotted) a component is named, from {SURE:g} (dashed) it is "
        f"sure.{gain}{shown_of(shown, len(d.components), 'candidates', 'the most probable')}"
    )


def _bar(axis: Any, place: int, c: Component) -> None:
    value = c.inclusion_probability
    if not math.isfinite(value):
        return
    axis.barh([place], [value], height=0.56, linewidth=0.9, **KIND_LOOKS[c.kind])
    axis.text(1.03, place, say.probability(value), ha="left", va="center", fontsize=7, clip_on=False)


def _gain(axis: Any, place: int, g: HeldOutGain, colour: str) -> None:
    if not math.isfinite(g.mean):
        return
    for se in finite([g.se]):
        axis.plot([g.mean - se, g.mean + se], [place, place], color=colour, linewidth=1.3)
    face = colour if g.beyond_error else "white"
    axis.plot([g.mean], [place], "o", markersize=4.5, markerfacecolor=face, markeredgecolor=colour)


def _probability_axis(axis: Any, shown: tuple[Component, ...]) -> None:
    axis.axvline(NAMED, color="black", linewidth=0.8, linestyle=(0, (1, 1.5)), zorder=3)
    axis.axvline(SURE, color="black", linewidth=0.8, linestyle=(0, (4, 2)), zorder=3)
    axis.set_xlim(0.0, 1.16)
    axis.set_xticks([0.0, 0.25, 0.5, 0.75, 1.0], ["0", "0.25", "0.5", "0.75", "1"])
    axis.spines["bottom"].set_bounds(0.0, 1.0)
    axis.set_xlabel("Inclusion probability", x=0.5 / 1.16)
    axis.set_yticks(range(len(shown)), [wrapped(say.title(c), 34) for c in shown], fontsize=7)
    for tick, c in zip(axis.get_yticklabels(), shown, strict=True):
        tick.set_fontweight("bold" if c.inclusion_probability >= NAMED else "normal")
    axis.set_ylim(len(shown) - 0.4, -0.6)
    quiet_rows(axis)


def _gain_axis(axis: Any) -> None:
    from matplotlib.ticker import MaxNLocator

    axis.axvline(0.0, color=DATA, linewidth=0.8, zorder=0)
    low, high = axis.get_xlim()
    axis.set_xlim(min(low, -0.02), max(high, 0.05))
    axis.xaxis.set_major_locator(MaxNLocator(5))
    axis.set_xlabel("Held-out gain (log RMSD ratio)")
    quiet_rows(axis)
    ends = axis.get_xlim()
    top = axis.secondary_xaxis("top")
    marks = [p for p in _PERCENT if ends[0] <= -math.log1p(-p / 100) <= ends[1]]
    places = [-math.log1p(-p / 100) for p in marks]
    least = (ends[1] - ends[0]) / 6.0
    kept: list[int] = []
    for k in sorted(range(len(marks)), key=lambda k: abs(marks[k])):
        if all(abs(places[k] - places[j]) >= least for j in kept):
            kept.append(k)
    kept.sort()
    top.set_xticks([places[k] for k in kept], [f"{marks[k]:g}".replace("-", "−") for k in kept])
    top.set_xlabel("Held-out RMSD lower by (%)")
    top.spines["top"].set_visible(bool(np.size(kept)))
