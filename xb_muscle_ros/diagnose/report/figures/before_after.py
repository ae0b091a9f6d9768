"""Before and after on trials that the fits did not see: forces of three of them, and the error of every trial."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from xb_muscle_ros.diagnose.report.figures.common import (
    DOTS,
    WIDTH_MM,
    Figure,
    by_activation,
    finite,
    key,
    plot_force,
    plot_residual,
    quiet_rows,
    same_scale,
    shown_of,
    svg,
    trial_labels,
    unique,
    wrapped,
)
from xb_muscle_ros.diagnose.report.phrases import changed, force
from xb_muscle_ros.diagnose.report.traces import TrialTraces
from xb_muscle_ros.diagnose.result import Diagnosis, OfTrial
from xb_muscle_ros.diagnose.words import joined
from xb_muscle_ros.plotting.style import DATA, MODEL, SECOND, figure
from xb_muscle_ros.trials.trial import Array

_TRIALS, _ROWS = 3, 24
_TOP_MM, _ROW_MM, _SCATTER_MM = 68.0, 4.3, 70.0
_DOTTED: Any = {
    "color": MODEL, "linewidth": 0.9, "linestyle": (0, (1, 1.5)), "zorder": 0, "label": "benchmark",
}  # fmt: skip
# Fibres beyond these share the last mark.
_MARKS = ("o", "s", "^", "D", "v", "P", "X", "<", ">", "*")


def held_out(d: Diagnosis) -> bool:
    """Whether anything was left out and predicted."""
    return any(None not in (t.heldout_before_f0, t.heldout_after_f0) for t in d.trials)


def errors(d: Diagnosis, t: OfTrial) -> tuple[float | None, float | None]:
    """RMSD of base and answer, F0: held out, or fitted where nothing was held out."""
    return (t.heldout_before_f0, t.heldout_after_f0) if held_out(d) else (t.before_rmsd_f0, t.after_rmsd_f0)


def telling(d: Diagnosis, rows: Sequence[OfTrial]) -> list[OfTrial]:
    """Trials with the largest, the median and the least fall of the error's square; of the error, if none changed."""
    falls = []
    for t in rows:
        known = finite(errors(d, t))
        if len(known) == 2:
            falls.append((known[0] ** 2 - (known[1] ** 2 if changed(d) else 0.0), t))
    falls.sort(key=lambda pair: -pair[0])
    places = dict.fromkeys((0, len(falls) // 2, len(falls) - 1))
    return [falls[k][1] for k in places if 0 <= k < len(falls)][:_TRIALS]


def draw_before_after(d: Diagnosis, traces: Sequence[TrialTraces]) -> Figure | None:
    """The figure; None where no trial has both errors."""
    of = {key(t): t for t in traces}
    rows = [t for t in by_activation(d.trials) if len(finite(errors(d, t))) == 2]
    chosen = telling(d, [t for t in rows if key(t) in of and _predicted(d, of[key(t)]) is not None])
    if not rows:
        return None
    many, total = changed(d) and len(rows) > _ROWS, len(rows)
    if not many:
        largest = sorted(rows, key=lambda t: -(errors(d, t)[0] or 0.0))[:_ROWS]
        rows = [t for t in rows if t in largest]
    bottom_mm = _SCATTER_MM if many else 18.0 + _ROW_MM * (len(rows) + 1)
    top_mm = _TOP_MM if chosen else 0.0
    with figure(WIDTH_MM, top_mm + bottom_mm) as made:
        parts = made.subfigures(2, 1, height_ratios=(top_mm, bottom_mm)) if chosen else [None, made]
        if chosen:
            _forces(parts[0], d, chosen, of)
        if many:
            _scatter(parts[1], d, rows)
        else:
            _pairs(parts[1], d, rows)
        hidden = "" if many else shown_of(len(rows), total, "trials", "those with the largest error")
        return Figure(svg(made), _caption(d, chosen, many) + hidden, "Force and its error before and after")


def _caption(d: Diagnosis, chosen: Sequence[OfTrial], many: bool) -> str:
    unseen = held_out(d)
    what = "predicted by fits that did not see their condition" if unseen else "fitted; nothing was held out"
    which = ["largest", "median", "smallest"] if len(chosen) > 2 else ["largest", "smallest"][: len(chosen)]
    models = "both models (base dashed, answer solid)"
    if not changed(d):
        models = "the base model (dashed), to which the answer adds nothing"
    top = (
        f"Top: measured force (grey) and {models}, {what}, in trials with the {joined(which)} "
        f"{'fall of the error' if changed(d) else 'error'}; below, measured less model. "
        if chosen
        else ""
    )
    dotted = " Dotted: non-parametric discrepancy benchmark." if _benchmark(d) else ""
    if many:
        marks = "; marks are fibres" if len(d.fibres) > 1 else ""
        return (
            f"{top}Bottom: force RMSD of every trial, base against answer{marks}. Below the dashed line the answer "
            f"{'predicts' if unseen else 'fits'} better.{dotted}"
        )
    both = "base (open) and answer (filled)" if changed(d) else "base model"
    return f"{top}Bottom: force RMSD of every trial, {both}; bars are the trial's noise.{dotted}"


def _benchmark(d: Diagnosis) -> list[float]:
    return finite([d.benchmark_rmsd_f0]) if held_out(d) else []


def _predicted(d: Diagnosis, t: TrialTraces) -> tuple[Array, Array] | None:
    if not held_out(d):
        return t.before_f0, t.after_f0
    if t.heldout_before_f0 is None or t.heldout_after_f0 is None:
        return None
    return t.heldout_before_f0, t.heldout_after_f0


def _forces(part: Any, d: Diagnosis, chosen: Sequence[OfTrial], of: dict[Any, TrialTraces]) -> None:
    from matplotlib.ticker import MaxNLocator

    axes = part.subplots(2, len(chosen), squeeze=False, sharex="col", height_ratios=(2.6, 1.3))
    labels, handles, count = trial_labels(d), [], 1 + changed(d)
    for (top, bottom), row in zip(axes.T, chosen, strict=True):
        t = of[key(row)]
        models = (_predicted(d, t) or ())[:count]
        handles += plot_force(top, t, models)
        plot_residual(bottom, t, models)
        rmsd = " → ".join(force(value, "") for value in errors(d, row)[:count])
        top.set_title(f"{wrapped(labels[key(row)], 30, 1)}\nRMSD {rmsd} % F$_0$", loc="left", fontsize=7)
        top.yaxis.set_major_locator(MaxNLocator(4))
        bottom.yaxis.set_major_locator(MaxNLocator(3))
        bottom.xaxis.set_major_locator(MaxNLocator(5))
        bottom.set_xlabel("Time (s)")
    same_scale(axes[1], 0.33)
    axes[0][0].set_ylabel("Force (F$_0$)")
    axes[1][0].set_ylabel("Residual\n(% F$_0$)")
    part.legend(handles=unique(handles), loc="outside upper center", ncols=3, frameon=False)


def _pairs(part: Any, d: Diagnosis, rows: Sequence[OfTrial]) -> None:
    axis = part.subplots()
    unseen, labels, count = held_out(d), trial_labels(d), 1 + changed(d)
    whole = (d.before, d.after)
    total = [s.heldout_rmsd_f0 if unseen else s.train_rmsd_f0 for s in whole]
    handles: list[Any] = []
    for place, pair in enumerate([total, *(errors(d, t) for t in rows)]):
        size = 6.0 if place == 0 else 4.5
        known = [100.0 * v for v in finite(pair)]
        if len(known) == 2:
            axis.plot(known, [place, place], color=DATA, linewidth=1.2, zorder=1)
        for value, look in zip(pair[:count], DOTS[:count], strict=True):
            for x in finite([value]):
                handles += axis.plot([100.0 * x], [place], markersize=size, **look)
    for place, t in enumerate(rows, start=1):
        for x in finite([t.noise_sd_f0]):
            handles += axis.plot(100.0 * x, place, "|", color="black", markersize=6, linestyle="none", label="noise")
    handles += [axis.axvline(100.0 * x, **_DOTTED) for x in _benchmark(d)]
    axis.set_yticks(range(len(rows) + 1), ["all trials", *(labels[key(t)] for t in rows)], fontsize=7)
    axis.get_yticklabels()[0].set_fontweight("bold")
    axis.set_ylim(len(rows) + 0.6, -0.6)
    axis.set_xlim(0.0, 1.06 * axis.get_xlim()[1])
    axis.set_xlabel(f"{'Held-out force' if unseen else 'Force'} RMSD (% F$_0$)")
    quiet_rows(axis)
    part.legend(handles=unique(handles), loc="outside upper center", ncols=4, frameon=False)


def _scatter(part: Any, d: Diagnosis, rows: Sequence[OfTrial]) -> None:
    from matplotlib.ticker import MaxNLocator

    axis = part.subplots()
    names, handles = list(dict.fromkeys(t.fibre for t in rows)), []
    several = len(d.fibres) > 1
    pairs = np.array([finite(errors(d, t)) for t in rows]) * 100.0
    for k, name in enumerate(names):
        own = [i for i, t in enumerate(rows) if t.fibre == name]
        last = len(_MARKS) - 1
        label = wrapped(name, 20, 1) if k < last or len(names) == last + 1 else f"{len(names) - last} more fibres"
        label = label if several else "trial"
        handles += axis.plot(
            pairs[own, 0], pairs[own, 1], _MARKS[min(k, last)], markersize=4, linestyle="none", markeredgewidth=0.8,
            markerfacecolor=MODEL if k % 2 == 0 else "white", markeredgecolor=MODEL, label=label,
        )  # fmt: skip
    limit = 1.05 * float(pairs.max())
    handles += axis.plot([0.0, limit], [0.0, limit], color=SECOND, linestyle=(0, (4, 1.6)), label="no change")
    handles += [axis.axhline(100.0 * y, **_DOTTED) for y in _benchmark(d)]
    axis.set_xlim(0.0, limit)
    axis.set_ylim(0.0, limit)
    axis.set_aspect("equal")
    for one in (axis.xaxis, axis.yaxis):
        one.set_major_locator(MaxNLocator(6))
    word = "Held-out force RMSD" if held_out(d) else "Force RMSD"
    axis.set_xlabel(f"{word}, base model (% F$_0$)")
    axis.set_ylabel(f"{word}, answer (% F$_0$)")
    part.legend(handles=unique(handles), loc="outside right center", frameon=False)
