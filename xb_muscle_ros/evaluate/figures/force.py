"""Force RMSD in the manner of the paper's figure 5: bars over fibres, fibres as dots."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from xb_muscle_ros.evaluate.figures.look import look, shade
from xb_muscle_ros.evaluate.force_scores import ForceScores, Slice, Spread
from xb_muscle_ros.models.titles import title_of
from xb_muscle_ros.plotting.style import figure, save

_WINDOWS = {"whole": "Whole protocol", "conditioning": "Conditioning stretch", "test": "Test stretch"}
_VARIED = {"pca": "pCa", "amplitude_l0": "amplitude", "recovery_s": "recovery time"}
# Before the level, how it is written, and what it is multiplied by.
_UNITS = {
    "pca": ("pCa ", "{:g}", 1.0),
    "amplitude_l0": ("", "{:.3g} % L$_0$", 100.0),
    "recovery_s": ("", "{:g} s", 1.0),
}
_MOST_LEVELS = 8
# A column is wide enough for its title, mm.
_COLUMN_MM = 44.0


def draw_force(path: Path, scores: ForceScores) -> None:
    """Draw force RMSD; PNG, and PDF beside it.

    Rows are the three windows. The first column is over all trials; the others vary one of pCa, amplitude and recovery
    time, as far as the recordings do, darker for lower pCa, larger amplitude and longer recovery.
    """
    models = list(scores.overall)
    slices = {name: _thinned(entries) for name, entries in scores.slices.items() if len(entries) > 1}
    # Slanting names reach to the left of the first column and below the last row.
    longest = max(len(title_of(name)) for name in models)
    columns = max(_COLUMN_MM, 26.0 + 4.0 * len(models)) * (1 + len(slices))
    with figure(max(24.0, 1.2 * longest) + columns, 126.0 + 0.9 * longest) as made:
        axes = made.subplots(3, 1 + len(slices), squeeze=False, sharey="row")
        for row, (window, title) in enumerate(_WINDOWS.items()):
            _overall(axes[row][0], scores, models, window)
            axes[row][0].set_ylabel(f"{title}\nforce RMSD (% F$_0$)")
            for column, (varied, entries) in enumerate(slices.items(), start=1):
                _slice(axes[row][column], varied, entries, models, window)
            axes[row][0].set_ylim(bottom=0.0)
        axes[0][0].set_title("A  all trials\n", loc="left", fontweight="bold")
        for column, (varied, entries) in enumerate(slices.items(), start=1):
            axes[0][column].set_title(f"{'ABCD'[column]}  effect of {_VARIED[varied]}\n", loc="left", fontweight="bold")
            axes[0][column].text(0.0, 1.03, _ends(varied, entries), transform=axes[0][column].transAxes, fontsize=7)
        for axis in axes[-1]:
            axis.set_xticks(range(len(models)), [title_of(name) for name in models], rotation=35, ha="right")
        for axis in axes[:-1].flat:
            axis.set_xticks(range(len(models)), [""] * len(models))
        save(made, path)


def _overall(axis: Any, scores: ForceScores, models: Sequence[str], window: str) -> None:
    top = 0.0
    for k, name in enumerate(models):
        top = max(top, _bar(axis, k, 0.6, scores.overall[name][window], look(name).colour, look(name).hollow))
    axis.set_xlim(-0.6, len(models) - 0.4)
    if top == 0.0 and not any(scores.overall[name][window] for name in models):
        axis.text(0.5, 0.5, "no such stretch", transform=axis.transAxes, ha="center", va="center")
    height = top
    for test in scores.paired_t_tests.comparisons:
        if test.window == window and test.significant:
            height += 0.08 * top
            ends = [models.index(test.first), models.index(test.second)]
            axis.plot(ends, [height, height], color="black", linewidth=0.8)
            axis.text(float(np.mean(ends)), height, "*", ha="center", va="bottom", fontsize=9)


def _slice(axis: Any, varied: str, entries: Sequence[Slice], models: Sequence[str], window: str) -> None:
    axis.set_xlim(-0.6, len(models) - 0.4)
    width = 0.84 / len(entries)
    ordered = _ordered(varied, entries)
    for k, name in enumerate(models):
        for j, entry in enumerate(ordered):
            depth = 0.25 + 0.75 * j / max(1, len(ordered) - 1)
            at = k - 0.42 + width * (j + 0.5)
            held = entry.models[name][window]
            _bar(axis, at, 0.92 * width, held, shade(look(name).colour, depth), look(name).hollow, small=True)


def _ordered(varied: str, entries: Sequence[Slice]) -> list[Slice]:
    """From light to dark: falling pCa, growing amplitude, longer recovery."""
    return sorted(entries, key=lambda e: e.level, reverse=varied == "pca")


def _ends(varied: str, entries: Sequence[Slice]) -> str:
    before, form, factor = _UNITS[varied]
    ordered = _ordered(varied, entries)
    light, dark = (before + form.format(factor * entry.level) for entry in (ordered[0], ordered[-1]))
    return f"light {light} … dark {dark}"


def _bar(
    axis: Any, at: float, width: float, held: Spread | None, colour: Any, hollow: bool, small: bool = False
) -> float:
    """One bar in % F0 with s.d. and a dot for each fibre; returns how high it reaches."""
    if held is None:
        return 0.0
    mean, sd = 100.0 * held.mean, 100.0 * (held.sd or 0.0)
    axis.bar(at, mean, width, color=colour, edgecolor="black", linewidth=0.4, hatch="////" if hollow else None)
    if held.sd is not None:
        axis.errorbar(at, mean, sd, color="black", linewidth=0.6, capsize=0.0 if small else 2.0)
    dots = 100.0 * np.array(list(held.fibres.values()))
    spread = np.linspace(-0.25, 0.25, dots.size) * width if dots.size > 1 else np.zeros(1)
    size = 2.0 if small else 7.0
    axis.scatter(at + spread, dots, s=size, color="white", edgecolor="black", linewidth=0.4, zorder=3)
    return float(max(mean + sd, dots.max()))


def _thinned(entries: Sequence[Slice]) -> list[Slice]:
    """At most eight levels, the ends among them."""
    if len(entries) <= _MOST_LEVELS:
        return list(entries)
    chosen = np.unique(np.linspace(0, len(entries) - 1, _MOST_LEVELS).round().astype(int))
    return [entries[i] for i in chosen]
