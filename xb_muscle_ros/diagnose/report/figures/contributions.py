"""Measured force, both models, and what each component of the answer adds to it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from xb_muscle_ros.diagnose.component import Component, Kind
from xb_muscle_ros.diagnose.report import phrases as say
from xb_muscle_ros.diagnose.report.figures.common import (
    KIND_LOOKS,
    WIDTH_MM,
    Figure,
    finite,
    key,
    plot_force,
    plot_residual,
    same_scale,
    shown_of,
    svg,
    thinned,
    trial_labels,
    unique,
    wrapped,
)
from xb_muscle_ros.diagnose.report.traces import TrialTraces
from xb_muscle_ros.diagnose.result import Diagnosis, OfTrial
from xb_muscle_ros.plotting.style import figure

_TRIALS, _PARTS = 3, 6
_LENGTH_MM, _FORCE_MM, _PART_MM, _RESIDUAL_MM = 9.0, 34.0, 13.5, 17.0


def chosen_trials(d: Diagnosis, traces: Sequence[TrialTraces]) -> list[tuple[OfTrial, TrialTraces]]:
    """Trials in which the answer takes most off the square of the error, each of another solution where it can be."""
    of = {key(t): t for t in traces}
    rows = [t for t in d.trials if key(t) in of and len(finite((t.before_rmsd_f0, t.after_rmsd_f0))) == 2]
    rows.sort(key=lambda t: (t.after_rmsd_f0**2 - t.before_rmsd_f0**2, -t.before_rmsd_f0))
    first: list[OfTrial] = []
    for t in rows:
        if t.pca not in [other.pca for other in first]:
            first.append(t)
    picked = [*first, *(t for t in rows if t not in first)][:_TRIALS]
    picked.sort(key=lambda t: (t.pca is None, -(t.pca or 0.0)))
    return [(t, of[key(t)]) for t in picked]


def draw_contributions(d: Diagnosis, traces: Sequence[TrialTraces]) -> Figure | None:
    """Columns of trials: length, force, one panel for each component, residual; None without traces."""
    chosen = chosen_trials(d, traces)
    if not chosen:
        return None
    parts = [c for c in d.components if any(c.name in t.without_f0 for _, t in chosen)]
    shown = parts[:_PARTS]
    heights = (_LENGTH_MM, _FORCE_MM, *(_PART_MM for _ in shown), _RESIDUAL_MM)
    with figure(WIDTH_MM, sum(heights) + 24.0) as made:
        axes = made.subplots(len(heights), len(chosen), squeeze=False, sharex="col", height_ratios=heights)
        handles: list[Any] = []
        labels = trial_labels(d)
        for column, (row, t) in zip(axes.T, chosen, strict=True):
            handles += _column(column, t, shown, 1 + say.changed(d))
            column[0].set_title(wrapped(labels[key(row)], 26, 1), loc="left", fontsize=7)
        same_scale(axes[2:-1])
        same_scale(axes[-1:])
        _labels(axes, shown)
        made.legend(handles=unique(handles), loc="outside upper center", ncols=3, frameon=False)
        return Figure(
            svg(made), _caption(d, shown, len(parts), len(chosen)), "Force and what each component of the answer adds"
        )


def _caption(d: Diagnosis, shown: Sequence[Component], parts: int, trials: int) -> str:
    adds = (
        " Then what each component adds: force of the answer less that with this component's effect set to nothing, "
        "all else as fitted; the same scale for all, artefacts hatched."
        if shown
        else " The answer adds no component."
    )
    several = " of any fibre" if len(d.fibres) > 1 else ""
    both = say.changed(d)
    which = "the answer takes most off the error" if both else "the error is largest"
    models = ", base model (dashed) and answer (solid)"
    if not both:
        models = " and base model (dashed), to which the answer adds nothing"
    return (
        f"Trials{several} in which {which}, fitted to all trials. Top: length change; below, measured force (grey)"
        f"{models}.{adds if both else ''} Bottom: measured less model."
        f"{shown_of(len(shown), parts, 'components', 'the most probable')}"
        f"{shown_of(trials, len(d.trials), 'trials', 'of different solutions where there are any')}"
    )


def _column(column: Sequence[Any], t: TrialTraces, shown: Sequence[Component], models: int) -> list[Any]:
    column[0].plot(*thinned(t.time_s, 100.0 * t.length_l0), color="black", linewidth=0.9)
    column[0].margins(y=0.15)
    both = (t.before_f0, t.after_f0)[:models]
    plot_residual(column[-1], t, both)
    for axis, c in zip(column[2:-1], shown, strict=True):
        axis.axhline(0.0, color="black", linewidth=0.5)
        if c.name not in t.without_f0:
            axis.text(0.5, 0.5, "not in this fibre", transform=axis.transAxes, ha="center", va="center", fontsize=7)
            continue
        time_s, adds = thinned(t.time_s, 100.0 * t.adds_f0(c.name))
        look = KIND_LOOKS[c.kind]
        axis.fill_between(time_s, 0.0, adds, alpha=0.35 if c.kind is Kind.MECHANISM else 1.0, linewidth=0.0, **look)
        axis.plot(time_s, adds, color=look["edgecolor"], linewidth=0.9)
    return plot_force(column[1], t, both)


def _labels(axes: Any, shown: Sequence[Component]) -> None:
    from matplotlib.ticker import MaxNLocator

    names = ["Length\n(% L$_0$)", "Force (F$_0$)", *(wrapped(say.title(c), 24, 3) + "\n(% F$_0$)" for c in shown)]
    for name, row in zip([*names, "Residual\n(% F$_0$)"], axes, strict=True):
        row[0].set_ylabel(name, rotation=0, ha="right", va="center", fontsize=7)
    for column in axes.T:
        for k, axis in enumerate(column):
            axis.yaxis.set_major_locator(MaxNLocator(5 if k == 1 else 2))
            axis.tick_params(length=2.5, width=0.6, pad=2, labelsize=7)
        column[-1].xaxis.set_major_locator(MaxNLocator(5))
        column[-1].set_xlabel("Time (s)")
