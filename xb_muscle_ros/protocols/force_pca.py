"""Isometric force against pCa, with Hill's equation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from scipy.stats import t as student

from xb_muscle_ros.protocols.base import Cell, Column, Curve, Found, Number, Option, Planned, Protocol, Run, Settings
from xb_muscle_ros.protocols.figures import legend, lettered, looks
from xb_muscle_ros.protocols.inputs import pca_option, planned_at_each_pca, rate_option
from xb_muscle_ros.scores.estimate import Missing, notes_of
from xb_muscle_ros.scores.force_pca import fit_force_pca, hill_curve
from xb_muscle_ros.scores.readout import isometric_force
from xb_muscle_ros.trials.protocol import ALLOWED

# Parameters of Hill's equation as it is fitted here.
_FITTED = 4


class ForcePca(Protocol):
    """One isometric trial at each pCa."""

    name = "force-pca"
    title = "isometric force against pCa: pCa50 and Hill coefficient"
    options = (
        pca_option(4.5, 5.0, 5.4, 5.6, 5.8, 6.0, 6.1, 6.2, 6.3, 6.4, 6.6, 6.8, 7.0, 9.0),
        Option("duration", (1.0,), ALLOWED["hold_s"], "of each trial, s", many=False),
        rate_option(1000.0),
    )
    columns: Mapping[str, Column] = {
        "trial": Column("trial"),
        "pca": Column("pCa", form="g"),
        "force_f0": Column("isometric force", "F0", ".4f"),
    }
    numbers: Mapping[str, Column] = {
        "pca50": Column("pCa50", "", ".3f"),
        "n_hill": Column("Hill coefficient", "", ".2f"),
        "passive_f0": Column("passive force", "F0", ".4f"),
        "maximal_f0": Column("maximal force", "F0", ".4f"),
        "rmsd_f0": Column("RMSD of the points from the curve", "F0", ".4f"),
    }
    source = "Hill's equation"

    def plan(self, fibre: str, settings: Settings) -> list[Planned]:
        """One trial for each pCa."""
        steps = [("isometric", settings["duration"][0], 0.0)]
        return planned_at_each_pca(self.name, fibre, "force", steps, settings)

    def analyse(self, fibre: str, of: str, runs: Sequence[Run]) -> Found:
        """Mean steady force of each trial, and Hill's equation through the means of each pCa."""
        rows: list[Mapping[str, Cell]] = []
        notes: list[tuple[str, str]] = []
        for run in runs:
            steady = isometric_force(run.trial, run.time_s, run.force_f0, run.noise)
            rows.append({"trial": run.trial.facts.trial, "pca": run.trial.facts.pca, "force_f0": steady})
            if steady.why:
                notes.append((run.trial.facts.trial, f"isometric force: {steady.why}"))
        lines = notes_of(notes)
        found = Found(fibre, of, tuple(rows), runs=tuple(runs))
        pca, force = found.column("pca"), found.column("force_f0")
        levels = np.unique(np.round(pca[np.isfinite(pca) & np.isfinite(force)], 6))
        means = np.array([float(np.nanmean(force[np.isclose(pca, level)])) for level in levels])
        fit = fit_force_pca(levels, means)
        if isinstance(fit, Missing):
            numbers = {key: Number(None, why=fit.why) for key in self.numbers}
            return Found(
                fibre, of, tuple(rows), numbers, runs=tuple(runs), notes=(*lines, f"Hill's equation: {fit.why}")
            )
        width = float(student.ppf(0.975, max(levels.size - _FITTED, 1)))
        numbers = {
            "pca50": _number(fit.pca50, fit.pca50_se, width),
            "n_hill": _number(fit.n_hill, fit.n_hill_se, width),
            "passive_f0": Number(fit.passive_f0),
            "maximal_f0": Number(fit.maximal_f0),
            "rmsd_f0": Number(fit.rmsd_f0),
        }
        x = np.linspace(float(levels[0]), float(levels[-1]), 300)
        curve = Curve(x, hill_curve(x, fit.pca50, fit.n_hill, fit.passive_f0, fit.maximal_f0))
        return Found(fibre, of, tuple(rows), numbers, {"hill": curve}, tuple(runs), tuple(lines))

    def draw(self, figure: Any, found: Sequence[Found]) -> None:
        """Force against pCa, high calcium to the right as is usual, and where the curve leaves the points."""
        axis, rest = figure.subplots(1, 2, width_ratios=(1.6, 1.0))
        for look, each in looks(found):
            pca, force = each.column("pca"), each.column("force_f0")
            axis.errorbar(pca, force, each.errors("force_f0"), **look.points, elinewidth=0.8)
            if "hill" in each.curves:
                curve = each.curves["hill"]
                axis.plot(curve.x, curve.y, **look.curve)
                rest.plot(pca, force - np.interp(pca, curve.x, curve.y), **look.points)
        rest.axhline(0.0, color="black", linewidth=0.6)
        for each in (axis, rest):
            each.set_xlabel("pCa")
            each.invert_xaxis()
        axis.set_ylabel("isometric force (F$_0$)")
        rest.set_ylabel("force less Hill's equation (F$_0$)")
        legend(axis)
        lettered([axis, rest])


def _number(value: float, se: float | None, width: float) -> Number:
    if se is None:
        return Number(value, why="too few levels of pCa for a standard error")
    return Number(value, se, value - width * se, value + width * se)
