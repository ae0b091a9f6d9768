"""Figures of a fit: force and residual of every trial, profiles of the parameters, and their correlations."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.fit.figures.profiles import draw_profiles
from xb_muscle_ros.fit.problem import Problem
from xb_muscle_ros.fit.run import Fitted
from xb_muscle_ros.plotting.style import DATA, DATA_LINE, MODEL, SECOND, figure, save
from xb_muscle_ros.plotting.trial_pages import Look, draw_pages

_PER_PAGE = 12
_LOOK = Look((3, 1), 0.08, "Force (F$_0$)", "Residual\n(% F$_0$)", row_mm=62.0, extra_mm=14.0)
# Room above what is shown; the smallest residual that fills its axis, % F0.
_HEADROOM, _LEAST_RESIDUAL_PERCENT = 1.15, 0.1
# Letters over one panel.
_LONGEST_NAME = 34
# Up to so many coordinates a correlation matrix has room for small numbers too.
_FEW = 10
# An error of the measurement bears on a parameter from this correlation on.
_BEARS = 0.3
_KINDS = {
    "isometric_force": ("Isometric force", "F$_0$"),
    "srs_conditioning": ("SRS, unconditioned", "F$_0$/L$_0$"),
    "srs_test": ("SRS, test stretch", "F$_0$/L$_0$"),
}


def draw(folder: Path, fitted: Fitted, found: Mapping[str, Any]) -> list[Path]:
    """Draw all figures of a fit into a folder.

    Args:
        folder: where ``trials.png``, ``profiles.png`` and ``correlation.png`` go, each with a PDF beside it.

    Returns:
        paths of the PNG files.
    """
    made = _trials(folder / "trials.png", fitted)
    if len(found["features"]) > 1:
        made.append(_features(folder / "features.png", found))
    if any("profile" in row for row in found["parameters"]):
        made.append(draw_profiles(folder / "profiles.png", found))
    if len(found["parameters"]) > 1:
        made.append(_correlation(folder / "correlation.png", found))
    return made


def _trials(path: Path, fitted: Fitted) -> list[Path]:
    """Pages of at most twelve trials: measured force, the start's and the fitted model's, and what is left between."""
    trials = fitted.problem.trials

    def draw(upper: Any, lower: Any, i: int) -> list[Any]:
        return _panel(upper, lower, fitted, trials[i])

    return draw_pages(path, len(trials), _PER_PAGE, _LOOK, draw, 2)


def _panel(upper: Any, lower: Any, fitted: Fitted, trial: Any) -> list[Any]:
    time, problem = trial.force_time_s, fitted.problem
    measured = trial.measured_f0
    lines = upper.plot(time, measured, **DATA_LINE)
    start = _force(problem, problem.start, trial)
    if start is not None:
        lines += upper.plot(time, start, color=SECOND, linestyle=(0, (4, 2)), linewidth=0.9, label="start")
        lower.plot(time, 100.0 * (measured - start), color=SECOND, linestyle=(0, (4, 2)), linewidth=0.9)
    force = _force(problem, fitted.best.z, trial)
    shown = measured
    if force is not None:
        lines += upper.plot(time, force, color=MODEL, linewidth=0.9, label=f"fitted ({problem.fibre.model})")
        lower.plot(time, 100.0 * (measured - force), color=MODEL, linewidth=0.9)
        # What the fit left is to be seen, however far off the start was.
        most = _HEADROOM * max(100.0 * float(np.max(np.abs(measured - force))), _LEAST_RESIDUAL_PERCENT)
        lower.set_ylim(-most, most)
        shown = np.concatenate([measured, force])
    lower.axhline(0.0, color="black", linewidth=0.5)
    upper.tick_params(labelbottom=False)
    role = "held out" if trial.held_out else "training"
    upper.set_title(f"{_short(trial.name)}\n{trial.solution}, {role}", loc="left", fontsize=7.0)
    low, high = min(0.0, float(np.min(shown))), float(np.max(shown))
    span = (high - low) or 1.0
    upper.set_ylim(low - 0.05 * span if low < 0.0 else 0.0, low + _HEADROOM * span)
    handles: list[Any] = lines
    return handles


def _short(name: str) -> str:
    """A trial's name as far as it goes over one panel; the middle of a longer one is left out."""
    half = (_LONGEST_NAME - 1) // 2
    return name if len(name) <= _LONGEST_NAME else f"{name[:half]}…{name[-half:]}"


def _force(problem: Problem, z: Any, trial: Any) -> Any:
    """Recorded force of one trial, or None where the model has no solution."""
    try:
        return problem.predicted(z, [trial])[0]
    except UserError:
        return None


def _features(path: Path, found: Mapping[str, Any]) -> Path:
    """Every feature of the model against the measured one, a panel for each kind."""
    kinds = [k for k in _KINDS if any(f["kind"] == k for f in found["features"])]
    with figure(15.0 + 60.0 * len(kinds), 65.0) as made:
        for i, kind in enumerate(kinds):
            axes = made.add_subplot(1, len(kinds), i + 1)
            rows = [f for f in found["features"] if f["kind"] == kind]
            x, y = [f["value"] for f in rows], [f["model"] for f in rows]
            limit = [min(0.0, *x, *y), 1.05 * max(*x, *y, 1e-3)]
            axes.plot(limit, limit, color="black", linewidth=0.6)
            axes.errorbar(x, y, xerr=[f["sd"] for f in rows], fmt="none", ecolor=DATA, elinewidth=0.8)
            axes.plot(x, y, "o", color=MODEL, markersize=3, fillstyle="none")
            axes.set_xlim(limit)
            axes.set_ylim(limit)
            axes.set_aspect("equal")
            axes.set_title(_KINDS[kind][0], loc="left")
            axes.set_xlabel(f"measured ({_KINDS[kind][1]})")
            axes.set_ylabel(f"fitted ({_KINDS[kind][1]})")
        save(made, path)
    return path


def _correlation(path: Path, found: Mapping[str, Any]) -> Path:
    """Correlation matrix, with numbers where they matter.

    Errors of the measurement have a place where they bear on a parameter, or where nothing else was fitted.
    """
    matrix = np.array(found["correlation"]["matrix"])
    parameters = np.array([row["group"] is None for row in found["parameters"]])
    bearing = np.max(np.abs(matrix[:, parameters]), axis=1, initial=0.0 if parameters.any() else 1.0) >= _BEARS
    shown = np.flatnonzero(parameters | bearing)
    names, matrix = [found["correlation"]["names"][j] for j in shown], matrix[np.ix_(shown, shown)]
    n, left = len(names), parameters.size - len(names)
    with figure(45.0 + 6.5 * n, 35.0 + 6.5 * n) as made:
        axes = made.add_subplot()
        image = axes.imshow(matrix, cmap="PuOr", vmin=-1.0, vmax=1.0)
        axes.set_xticks(range(n), names, rotation=90, fontsize=6.5)
        axes.set_yticks(range(n), names, fontsize=6.5)
        for i in range(n):
            for j in range(n):
                # Numbers carry the sign, which hues alone would lose in grey.
                if i != j and abs(matrix[i, j]) >= (0.1 if n <= _FEW else 0.5):
                    axes.text(
                        j, i, _number(matrix[i, j]), ha="center", va="center", fontsize=5.5,
                        color="white" if abs(matrix[i, j]) > 0.7 else "black",
                    )  # fmt: skip
        axes.spines[:].set_visible(False)
        made.colorbar(image, ax=axes, shrink=0.7, label="Correlation of estimates")
        if left:
            axes.set_xlabel(f"not shown: {left} errors of the measurement, below {_BEARS:g} with every parameter")
        save(made, path)
    return path


def _number(value: float) -> str:
    """Two decimals, never rounded up to 1."""
    shown = min(abs(value), 0.99) if abs(value) < 1.0 else 1.0
    return f"{'−' if value < 0.0 else ''}{shown:.2f}".replace("0.", ".", 1)
