"""How far the body goes after a push, what its ankles answer with, and what sway before the push takes away."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from xb_muscle_ros.plant.figure import LOOKS
from xb_muscle_ros.plant.leg.episode import Episode
from xb_muscle_ros.plant.leg.measures import STIFFNESS_AT_S, ankle_change, row, stiffness_nm_per_rad
from xb_muscle_ros.plant.leg.report import push_label, push_pairs, share
from xb_muscle_ros.plant.leg.study import ModelRuns, Pair
from xb_muscle_ros.plotting.style import SHADE, figure, save

_SHOWN_S, _FIRST_S = 0.3, 0.1
_BACKWARDS, _FORWARDS = 1, 3
_MARKERS = "osD^vP"


def draw_leg(path: Path, runs: Sequence[ModelRuns]) -> None:
    """Draw six panels; without sway the last three are left out.

    Args:
        path: PNG; a PDF goes beside it.
        runs: of all models.
    """
    swayed = len(runs[0].pairs) > 1
    with figure(190.0, 128.0 if swayed else 72.0) as made:
        # The last numbers under a panel reach beyond it, which the layout does not see.
        made.get_layout_engine().set(rect=(0.0, 0.0, 0.985, 1.0))
        panels = made.subplots(2 if swayed else 1, 3, squeeze=False)
        for axes, at in ((panels[0][0], _BACKWARDS), (panels[0][1], _FORWARDS)):
            _ways(axes, runs, at)
        _torques(panels[0][2], runs)
        handles, names = panels[0][0].get_legend_handles_labels()
        legend = {"ncols": len(names), "frameon": False, "handlelength": 3.2}
        made.legend(handles, names, loc="outside upper center", **legend)
        if swayed:
            _losses(panels[1][0], runs)
            _by_push(panels[1][1], runs[0])
            _alone(panels[1][2], runs[0])
            handles, names = panels[1][1].get_legend_handles_labels()
            made.legend(handles, names, loc="outside lower center", title=f"{runs[0].model}, before the push", **legend)
        for axes, letter in zip(panels.flat, "abcdef", strict=False):
            axes.set_title(letter, loc="left", fontweight="bold")
        save(made, path)


def _ways(axes: Any, runs: Sequence[ModelRuns], push: int) -> None:
    """Way of the centre of mass over time."""
    for one, look in zip(runs, LOOKS, strict=False):
        episode = one.pushes[push]
        _line(axes, episode, lambda e: 1e3 * e.com_m, look, one.model)
    axes.axvspan(0.0, 1e3 * _FIRST_S, color=SHADE, linewidth=0)
    axes.set_xlabel("Time (ms)")
    axes.set_ylabel(f"Centre of mass, way (mm)\nplatform {push_label(runs[0].pushes[push].platform)}")


def _line(axes: Any, episode: Episode, of: Callable[[Episode], Any], look: dict[str, Any], label: str) -> None:
    shown = episode.time_s <= _SHOWN_S + 1e-9
    axes.plot(1e3 * episode.time_s[shown], of(episode)[shown], label=label, **look)


def _changes(pair: Pair) -> Any:
    """Angle (degrees) and torque (N·m) by the push over the first 100 ms, shape (n, 2)."""
    times = np.arange(0.0, _FIRST_S + 1e-9, 0.001)
    found = [change for time_s in times if (change := ankle_change(pair, float(time_s))) is not None]
    return np.array(found) * np.array([180.0 / np.pi, 1.0])


def _torques(axes: Any, runs: Sequence[ModelRuns]) -> None:
    """Ankle torque over ankle angle after the larger push backwards, beside the stiffness that carries the body."""
    for one, look in zip(runs, LOOKS, strict=False):
        axes.plot(*_changes(push_pairs(one)[_BACKWARDS]).T, **look)
    slope = runs[0].hold.load_nm_per_rad * np.pi / 180.0
    right, top = axes.get_xlim()[1], axes.get_ylim()[1]
    axes.autoscale(False)
    axes.plot((0.0, right), (0.0, slope * right), color="black", linewidth=0.7, zorder=1.0)
    at = min(0.75 * right, 0.9 * top / slope)
    axes.annotate("m·g·h", (at, slope * at), xytext=(4, -8), textcoords="offset points", fontsize=7)
    _label_torque(axes)


def _label_torque(axes: Any) -> None:
    axes.set_xlabel("Ankle angle, change in 100 ms (°)")
    axes.set_ylabel("Ankle torque, change (N·m)")
    axes.set_facecolor(SHADE)


def _losses(axes: Any, runs: Sequence[ModelRuns]) -> None:
    """Change of stiffness by sway before, at each time, a marker for each model."""
    sways = [pair.pushed.sway for pair in runs[0].pairs[1:]]
    ticks = np.arange(len(sways), dtype=float)
    offsets = np.linspace(-0.25, 0.25, len(STIFFNESS_AT_S))
    for one, look, marker in zip(runs, LOOKS, _MARKERS, strict=False):
        for time_s, offset in zip(STIFFNESS_AT_S, offsets, strict=True):
            rest = stiffness_nm_per_rad(one.pairs[0], time_s)
            lost = [share(stiffness_nm_per_rad(pair, time_s), rest) for pair in one.pairs[1:]]
            values = [np.nan if value is None else 100.0 * value for value in lost]
            axes.plot(
                ticks + offset, values, linestyle="none", marker=marker, markersize=4.0, color=look["color"],
                markerfacecolor="white" if time_s > STIFFNESS_AT_S[0] else look["color"],
            )  # fmt: skip
    axes.axhline(0.0, color="black", linewidth=0.7)
    axes.set_xticks(ticks, [f"{100 * sway.fibre_l0:g} %\n{sway.frequency_hz:g} Hz" for sway in sways])
    times = ", ".join(f"{1000 * time_s:.0f}" for time_s in STIFFNESS_AT_S)
    axes.set_xlabel(f"Sway before; from left: at {times} ms")
    axes.set_ylabel("Stiffness, change by sway (%)")


def _sway_looks(one: ModelRuns) -> list[tuple[Pair, dict[str, Any]]]:
    return list(zip(one.pairs, LOOKS * len(one.pairs), strict=False))


def _by_push(axes: Any, one: ModelRuns) -> None:
    """Torque over angle that the push alone makes, by sway before it."""
    for pair, look in _sway_looks(one):
        axes.plot(*_changes(pair).T, label=pair.pushed.sway.label, **look)
    _label_torque(axes)
    axes.set_ylabel("Ankle torque by the push (N·m)")


def _alone(axes: Any, one: ModelRuns) -> None:
    """Way of the centre of mass that is let go after sway, without a push."""
    for pair, look in _sway_looks(one):
        _line(axes, pair.still, lambda e: 1e3 * e.com_m, look, pair.still.sway.label)
    last = [at for pair in one.pairs if (at := row(pair.still, _FIRST_S)) is not None]
    if last:
        axes.axvspan(0.0, 1e3 * _FIRST_S, color=SHADE, linewidth=0)
    axes.set_xlabel("Time (ms)")
    axes.set_ylabel("Way without a push (mm)")
