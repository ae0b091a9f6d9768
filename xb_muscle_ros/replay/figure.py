"""Measured against simulated force, a panel for each trial, with the fibre's length above."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from xb_muscle_ros.plotting.style import DATA_LINE, MODEL, SECOND, SHADE
from xb_muscle_ros.plotting.thinned import thinned
from xb_muscle_ros.plotting.trial_pages import Look, draw_pages
from xb_muscle_ros.trials.simulated import Simulated
from xb_muscle_ros.trials.trial import Array, Trial

_PER_PAGE = 9
# Wide lines would show more noise than there is, points.
_LINE = 0.8
# Lengths that are held would fill their panel with noise, % L0.
_LEAST_RANGE = 2.0
_LOOK = Look((1, 3), 0.05, "ΔL (% L$_0$)", "Force (F$_0$)", row_mm=58.0, extra_mm=12.0)


def draw_replay(
    path: Path,
    trials: Sequence[Trial],
    simulated: Sequence[Simulated],
    label: str,
    live: Sequence[Simulated] | None = None,
) -> list[Path]:
    """Draw all trials, nine to a page.

    Args:
        path: of the first page, PNG; a PDF goes beside it. Further pages are called ``<name>_2`` and so on.
        trials: with or without measured force.
        live: force that came from a node, drawn as dashes on top.

    Returns:
        paths of the pages.
    """

    def draw(upper: Any, lower: Any, i: int) -> list[Any]:
        return _panel(upper, lower, trials[i], simulated[i], label, None if live is None else live[i])

    return draw_pages(path, len(trials), _PER_PAGE, _LOOK, draw, 2 if live is None else 3)


def _panel(upper: Any, lower: Any, trial: Trial, simulated: Simulated, label: str, live: Simulated | None) -> list[Any]:
    facts = trial.facts
    shown = thinned(trial.time_s, trial.length_m)
    change = trial.length_m[shown] / facts.reference_length_m - 1.0
    upper.plot(trial.time_s[shown], 100.0 * change, color="black", linewidth=_LINE)
    upper.tick_params(labelbottom=False)
    _at_least(upper, _LEAST_RANGE)
    title = facts.trial if facts.pca is None else f"{facts.trial}  (pCa {facts.pca:.3g})"
    upper.set_title(title, loc="left", fontsize=7.5)
    for phase in facts.phases:
        if "stretch" in phase.name:
            for axes in (upper, lower):
                axes.axvspan(phase.start_s, phase.end_s, color=SHADE, linewidth=0)
    lines = []
    if trial.force_time_s.size:
        line = _force(trial.force_time_s, trial.force_n, facts.f0_n)
        lines += lower.plot(*line, **{**DATA_LINE, "linewidth": _LINE})
    line = _force(simulated.time_s, simulated.force_n, facts.f0_n)
    lines += lower.plot(*line, color=MODEL, linewidth=_LINE, label=label)
    if live is not None:
        lines += lower.plot(
            *_force(live.time_s, live.force_n, facts.f0_n), color=SECOND, linestyle=(0, (1, 3)), linewidth=1.8,
            label="through muscle_node",
        )  # fmt: skip
    lower.set_ylim(bottom=min(0.0, lower.get_ylim()[0]))
    return lines


def _force(time_s: Array, force_n: Array, f0_n: float) -> tuple[Array, Array]:
    """What to draw of a force: s, F0."""
    shown = thinned(time_s, force_n)
    return time_s[shown], force_n[shown] / f0_n


def _at_least(axis: Any, least: float) -> None:
    """Widen an axis that shows less."""
    low, high = axis.get_ylim()
    if high - low < least:
        axis.set_ylim(0.5 * (low + high - least), 0.5 * (low + high + least))
