"""Figure of work loops."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from xb_muscle_ros.protocols.base import Cell, Found
from xb_muscle_ros.protocols.figures import lettered, looks, spread
from xb_muscle_ros.trials.trial import Array

# What trials may differ by: label of an axis, factor, and unit behind a number.
_VARIED = {
    "frequency_hz": ("cycle frequency (Hz)", 1.0, " Hz"),
    "amplitude_l0": ("amplitude (% L$_0$)", 100.0, " % L$_0$"),
    "phase": ("begin of stimulation (share of cycle)", 1.0, " phase"),
    "duty": ("duty (share of cycle)", 1.0, " duty"),
}
# A list has room for so many trials.
_MOST_NAMED = 20


def draw(figure: Any, found: Sequence[Found]) -> None:
    """Last loop of each trial with its direction, power against what varies, net work from cycle to cycle.

    Trials that differ by several things have numbers, and a list of what they are.
    """
    from matplotlib.lines import Line2D

    loops, power, cycles = figure.subplots(1, 3, width_ratios=(1.4, 1.0, 1.0))
    varied = _varied(found[0])
    names, key = _names(found[0], varied)
    at_peaks, at_points, at_ends = [], [], []
    across = next((key for key in varied if np.all(np.isfinite(found[0].column(key)))), "frequency_hz")
    for first, (look, each) in enumerate(looks(found)):
        for k in range(1, len(each.rows) + 1):
            length, force = each.curves[f"loop {k}"]
            loops.plot(100.0 * length, force, **{**look.trace, "label": "_"})
            _arrows(loops, 100.0 * length, force, look.trace["color"])
            if first == 0:
                # Loops of other models are near.
                top = int(np.argmax(force))
                at = length.max() if length[top] > 0.8 * length.max() else length[top]
                at_peaks.append((100.0 * float(at), float(force[top]), names[k - 1]))
            x, net = each.curves[f"net work {k}"]
            if first == 0 and len(each.rows) > 1:
                at_ends.append((float(x[-1]), 1e3 * float(net[-1]), names[k - 1]))
            cycles.plot(x, 1e3 * net, **{**look.trace, "label": "_"}, marker=look.points["marker"], markersize=2.5)
        errors = each.errors("power_f0_l0_per_s")
        if first == 0 and key:
            at = _VARIED[across][1] * each.column(across), 1e3 * each.column("power_f0_l0_per_s")
            at_points = [(float(x), float(y), name) for x, y, name in zip(*at, names, strict=True) if np.isfinite(x)]
        power.errorbar(
            _VARIED[across][1] * each.column(across), 1e3 * each.column("power_f0_l0_per_s"), 1e3 * errors,
            **look.points, elinewidth=0.8,
        )  # fmt: skip
    power.axhline(0.0, color="black", linewidth=0.6)
    cycles.axhline(0.0, color="black", linewidth=0.6)
    loops.margins(x=0.12)
    cycles.xaxis.get_major_locator().set_params(integer=True)
    loops.set(xlabel="length change (% L$_0$)", ylabel="force (F$_0$)")
    power.set(xlabel=_VARIED[across][0], ylabel="power (10$^{-3}$ F$_0$·L$_0$/s)")
    cycles.set(xlabel="cycle", ylabel="net work (10$^{-3}$ F$_0$·L$_0$)")
    power.margins(y=0.2)
    # Points may lie anywhere in the axes.
    drawn = power.get_legend_handles_labels()
    figure.legend(*drawn, loc="outside upper center", ncols=len(found), frameon=False, handlelength=1.8)
    lettered([loops, power, cycles])
    if key:
        figure.legend(
            [Line2D([], [], linestyle="none")] * len(key), key, loc="outside right upper", fontsize=6.5, frameon=False,
            handlelength=0.0, handletextpad=0.0, labelspacing=0.2,
        )  # fmt: skip
    spread(loops, at_peaks, True)
    spread(power, at_points, True)
    spread(cycles, at_ends, True)


def _names(found: Found, varied: Sequence[str]) -> tuple[list[str], list[str]]:
    """What each trial is called in the figure, and lines that tell what numbers stand for, where they have numbers."""
    texts = [", ".join(dict.fromkeys(_labelled(key, row) for key in varied)) for row in found.rows]
    if len(varied) == 1:
        return texts, []
    numbers = [f"{k}" for k in range(1, len(texts) + 1)]
    if len(texts) > _MOST_NAMED:
        return numbers, ["numbers: rows", "of the table"]
    return numbers, [f"{number}: {text}" for number, text in zip(numbers, texts, strict=True)]


def _varied(found: Found) -> list[str]:
    """What differs among the trials, of `_VARIED`; the frequency where nothing does."""
    keys = []
    for key in _VARIED:
        values = found.column(key)
        known = values[np.isfinite(values)]
        # Amplitudes are read off samples.
        if known.size and (known.size < values.size or np.ptp(known) > 0.01 * np.max(np.abs(known))):
            keys.append(key)
    return keys or ["frequency_hz"]


def _labelled(key: str, row: Mapping[str, Cell]) -> str:
    """A trial's number by which its loop is known from others."""
    value = row.get(key)
    _, factor, unit = _VARIED[key]
    return f"{factor * value:.3g}{unit}" if isinstance(value, float) else "constant Ca"


def _arrows(axis: Any, x: Array, y: Array, colour: str) -> None:
    """Two arrows along a loop."""
    for share in (0.05, 0.4):
        k = int(share * x.size)
        ahead = min(k + max(2, x.size // 40), x.size - 1)
        arrow = {"arrowstyle": "-|>", "color": colour, "linewidth": 0.9, "shrinkA": 0.0, "shrinkB": 0.0}
        axis.annotate("", (x[ahead], y[ahead]), (x[k], y[k]), arrowprops=arrow)
