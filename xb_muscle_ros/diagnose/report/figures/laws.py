"""The laws of residuals: weights of their exponentials, and how much each way of scaling describes."""

from __future__ import annotations

import math
from typing import Any

from xb_muscle_ros.diagnose.report.figures.common import WIDTH_MM, Figure, finite, quiet_rows, svg, unique
from xb_muscle_ros.diagnose.report.phrases import share
from xb_muscle_ros.diagnose.residual import ResidualLaw
from xb_muscle_ros.diagnose.result import Diagnosis
from xb_muscle_ros.diagnose.words import quantity
from xb_muscle_ros.plotting.style import MODEL, SECOND, figure

_SCALES = ("constant", "calcium", "activation", "force")


def draw_laws(d: Diagnosis) -> Figure | None:
    """Weights against time constant, shares by scaling; None where no residual follows a law."""
    laws = [] if d.base_law is None else [(d.base_law, "base model", SECOND, "o")]
    if d.residual.law is not None and d.residual.law != d.base_law:
        laws.append((d.residual.law, "answer", MODEL, "s"))
    if not laws:
        return None
    with figure(WIDTH_MM, 58.0) as made:
        left, right = made.subplots(1, 2, width_ratios=(1.6, 1.0))
        handles: list[Any] = []
        for k, (law, name, colour, mark) in enumerate(laws):
            aside = k - 0.5 * (len(laws) - 1)
            handles += _weights(left, law, name, colour, mark, 1.0 + 0.18 * aside)
            _shares(right, law, colour, mark, 0.22 * aside)
        left.axhline(0.0, color="black", linewidth=0.5)
        left.set_xscale("log")
        left.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
        left.set_xlabel("Time constant of the exponential (s)")
        left.set_ylabel("Weight (% F$_0$)")
        right.set_yticks(range(len(_SCALES)), _SCALES)
        right.set_ylim(len(_SCALES) - 0.4, -0.6)
        right.set_xlim(0.0, 1.0)
        right.set_xlabel("Explained fraction of the residual")
        right.set_title("scales with", loc="left")
        quiet_rows(right)
        made.legend(handles=unique(handles), loc="outside upper center", ncols=2, frameon=False)
        return Figure(svg(made), _caption([(law, name) for law, name, *_ in laws]), "Law of the residual")


def _caption(laws: list[tuple[ResidualLaw, str]]) -> str:
    each = "; ".join(
        f"{name}: {quantity(1e3 * law.time_constant_s, 'ms')}, scales with {law.scales_with}, "
        f"{share(law.explained_fraction)} described (fibre {law.fibre})"
        for law, name in laws
        if math.isfinite(law.time_constant_s)
    )
    return (
        "Left: weights of the exponentials (Prony series in the length change) that describe the residual. Right: "
        "fraction of the residual's mean square that they explain in held-out trials, by what they scale with; the "
        "law is filled. " + (f"{each[0].upper()}{each[1:]}." if each else "")
    )


def _weights(axis: Any, law: ResidualLaw, name: str, colour: str, mark: str, aside: float) -> list[Any]:
    known = [(t, w) for t, w in zip(law.tau_s, law.weight_f0, strict=False) if len(finite((t, w))) == 2 and t > 0.0]
    times, weights = [aside * t for t, _ in known], [100.0 * w for _, w in known]
    axis.vlines(times, 0.0, weights, color=colour, linewidth=1.6)
    look = {"markersize": 4.5, "color": colour, "markerfacecolor": "white" if mark == "o" else colour}
    handles: list[Any] = axis.plot(times, weights, mark, linestyle="none", label=name, **look)
    return handles


def _shares(axis: Any, law: ResidualLaw, colour: str, mark: str, aside: float) -> None:
    for place, name in enumerate(_SCALES):
        own = name == law.scales_with
        for x in finite([law.explained_fraction if own else law.other_scalings.get(name)]):
            face = colour if own else "white"
            axis.plot([0.0, max(x, 0.0)], [place + aside] * 2, color=colour, linewidth=1.2)
            axis.plot([max(x, 0.0)], [place + aside], mark, markersize=4.5, color=colour, markerfacecolor=face)
