"""Figures of a fit: force and residual of every trial, profiles of the parameters, and their correlations."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import chi2

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.figures.style import DATA, MODEL, SECOND, figure, save
from xb_muscle_ros.figures.trial_pages import Look, pages_of, panels, size_mm
from xb_muscle_ros.fit.problem import Problem
from xb_muscle_ros.fit.run import Fitted

_PER_PAGE = 12
_LOOK = Look((3, 1), 0.08, "Force (F$_0$)", "Residual\n(% F$_0$)", row_mm=60.0, extra_mm=14.0)
_KINDS = {
    "isometric_force": ("Isometric force", "F$_0$"),
    "srs_conditioning": ("SRS, unconditioned", "F$_0$/L$_0$"),
    "srs_test": ("SRS, test stretch", "F$_0$/L$_0$"),
}


def draw(folder: Path, fitted: Fitted, found: Mapping[str, Any]) -> list[Path]:
    """Draw all figures of a fit into a folder.

    Args:
        folder: where ``trials.png``, ``profiles.png`` and ``correlation.png`` go, each with a PDF beside it.
        fitted: the fit.
        found: of `fit.report.as_json`.

    Returns:
        paths of the PNG files.
    """
    made = _trials(folder / "trials.png", fitted)
    if len(found["features"]) > 1:
        made.append(_features(folder / "features.png", found))
    if any("profile" in row for row in found["parameters"]):
        made.append(_profiles(folder / "profiles.png", found))
    if len(found["parameters"]) > 1:
        made.append(_correlation(folder / "correlation.png", found))
    return made


def _trials(path: Path, fitted: Fitted) -> list[Path]:
    """Pages of at most twelve trials: measured force, the start's and the fitted model's, and what is left between."""
    trials = fitted.problem.trials
    pages = []
    for here, chosen in pages_of(path, len(trials), _PER_PAGE):
        shown = trials[chosen]
        with figure(*size_mm(len(shown), _LOOK)) as made:
            handles: list[Any] = []
            for (upper, lower), trial in zip(panels(made, len(shown), _LOOK), shown, strict=True):
                handles = _panel(upper, lower, fitted, trial)
            made.legend(handles=handles, loc="outside upper center", ncols=len(handles), frameon=False)
            save(made, here)
        pages.append(here)
    return pages


def _panel(upper: Any, lower: Any, fitted: Fitted, trial: Any) -> list[Any]:
    time, problem = trial.force_time_s, fitted.problem
    lines = upper.plot(time, trial.measured_f0, color=DATA, linewidth=3.0, label="measured")
    start = _force(problem, problem.start, trial)
    if start is not None:
        lines += upper.plot(time, start, color=SECOND, linestyle=(0, (4, 2)), linewidth=0.9, label="start")
        lower.plot(time, 100.0 * (trial.measured_f0 - start), color=SECOND, linestyle=(0, (4, 2)), linewidth=0.9)
    force = _force(problem, fitted.best.z, trial)
    if force is not None:
        lines += upper.plot(time, force, color=MODEL, label=f"fitted ({problem.fibre.model})")
        lower.plot(time, 100.0 * (trial.measured_f0 - force), color=MODEL)
    lower.axhline(0.0, color="black", linewidth=0.5)
    upper.tick_params(labelbottom=False)
    role = "held out" if trial.held_out else "training"
    upper.set_title(f"{trial.name} ({trial.solution}, {role})", loc="left", fontsize=7.0)
    upper.set_ylim(bottom=min(0.0, upper.get_ylim()[0]))
    shown: list[Any] = lines
    return shown


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


def _profiles(path: Path, found: Mapping[str, Any]) -> Path:
    """Likelihood ratio against each parameter, with the interval it makes."""
    rows = [row for row in found["parameters"] if "profile" in row]
    columns = min(4, len(rows))
    limit = float(np.sqrt(chi2.ppf(found["level"], 1)))
    with figure(12.0 + 42.0 * columns, 10.0 + 38.0 * -(-len(rows) // columns)) as made:
        for i, row in enumerate(rows):
            axes = made.add_subplot(-(-len(rows) // columns), columns, i + 1)
            x, root = np.array(row["profile"]).T
            axes.plot(x, root, color=MODEL, marker="o", markersize=3)
            axes.axhline(limit, color="black", linewidth=0.6, linestyle=":")
            for end, closed in zip(row["interval"], row["interval_closed"], strict=True):
                axes.axvline(end, color=SECOND, linewidth=0.8, linestyle="-" if closed else "--")
            axes.plot([row["start"]], [0.0], marker="^", color=DATA, markersize=6, clip_on=False, zorder=1)
            if row["log_scale"]:
                axes.set_xscale("log")
                axes.minorticks_off()
                axes.set_xticks(_ticks(x))
                axes.set_xticklabels([f"{t:.3g}" for t in _ticks(x)])
            axes.set_ylim(-0.1, max(3.0, 1.2 * limit))
            unit = "" if row["unit"] == "1" else f" ({row['unit']})"
            axes.set_xlabel(f"{row['name']}{unit}")
            if i % columns == 0:
                axes.set_ylabel("√(likelihood ratio)")
        percent = f"{100.0 * found['level']:g}"
        made.suptitle(
            f"Profiles; dotted: {percent} % limit, upright: interval (dashed: open), triangle: start", fontsize=8
        )
        save(made, path)
    return path


def _ticks(x: Any) -> list[float]:
    """Three round-ish ticks over the range of a logarithmic axis."""
    low, high = float(np.min(x)), float(np.max(x))
    return [float(f"{v:.2g}") for v in np.geomspace(low, high, 3)]


def _correlation(path: Path, found: Mapping[str, Any]) -> Path:
    """Correlation matrix, with numbers where they matter."""
    names, matrix = found["correlation"]["names"], np.array(found["correlation"]["matrix"])
    n = len(names)
    with figure(45.0 + 6.5 * n, 35.0 + 6.5 * n) as made:
        axes = made.add_subplot()
        image = axes.imshow(matrix, cmap="PuOr", vmin=-1.0, vmax=1.0)
        axes.set_xticks(range(n), names, rotation=90, fontsize=6.5)
        axes.set_yticks(range(n), names, fontsize=6.5)
        for i in range(n):
            for j in range(n):
                if i != j and abs(matrix[i, j]) >= 0.5:
                    dark = abs(matrix[i, j]) > 0.7
                    axes.text(
                        j, i, f"{matrix[i, j]:.1f}".replace("0.", "."), ha="center", va="center", fontsize=5.5,
                        color="white" if dark else "black",
                    )  # fmt: skip
        axes.spines[:].set_visible(False)
        made.colorbar(image, ax=axes, shrink=0.7, label="Correlation of estimates")
        save(made, path)
    return path
