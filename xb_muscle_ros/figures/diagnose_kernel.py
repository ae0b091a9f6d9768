"""How what is left remembers the speed of length change: weight against time constant."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from xb_muscle_ros.diagnose.words import quantity
from xb_muscle_ros.figures.diagnose_common import svg
from xb_muscle_ros.figures.style import DATA, MODEL, SECOND, figure


def draw_kernel(facts: Mapping[str, Any]) -> list[str]:
    """Weights of the exponentials against their time constants, as SVG; none where no kernel was found."""
    kernel = facts["kernel"] or {}
    pairs = zip(kernel.get("tau_s") or (), kernel.get("weight_f0") or (), strict=False)
    known = [(1e3 * t, 100.0 * w) for t, w in pairs if t is not None and w is not None]
    if not known:
        return []
    tau, weight = map(list, zip(*known, strict=True))
    with figure(120.0, 56.0) as made:
        axes = made.add_subplot()
        axes.axhline(0.0, color="black", linewidth=0.5)
        axes.vlines(tau, 0.0, weight, color=MODEL, linewidth=1.6)
        for t, w in zip(tau, weight, strict=True):
            axes.plot([t], [w], "o", markersize=4 if w else 2.5, color=MODEL if w else DATA)
        if kernel["time_constant_s"] is not None:
            at = 1e3 * float(kernel["time_constant_s"])
            axes.axvline(at, color=SECOND, linewidth=0.9, linestyle=(0, (4, 2)))
            axes.text(
                at, 1.01, quantity(at, "ms"), color=SECOND, fontsize=7.5, ha="center", va="bottom",
                transform=axes.get_xaxis_transform(),
            )  # fmt: skip
        axes.set_xscale("log")
        axes.set_xlim(min(tau) / 1.5, max(tau) * 1.5)
        axes.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
        axes.set_xlabel("Time constant (ms)")
        axes.set_ylabel("Weight (% F$_0$)")
        return [svg(made)]
