"""What a fit found, as plain data and as a fibre file with its provenance."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import chi2

from xb_muscle_ros import __version__
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.fit.calibration import calibrated_force, own_faults
from xb_muscle_ros.fit.cautions import cautions
from xb_muscle_ros.fit.data import FitTrial
from xb_muscle_ros.fit.ends import DATA, quadratic_ends
from xb_muscle_ros.fit.problem import Problem
from xb_muscle_ros.fit.run import Fitted
from xb_muscle_ros.fit.start import held, unfitted_nuisances
from xb_muscle_ros.fit.training import Training
from xb_muscle_ros.fit.uncertainty import correlation
from xb_muscle_ros.measurement.artefacts import ARTEFACTS
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.models.fibre_writing import write_fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.models.parameters import PARAMETERS
from xb_muscle_ros.scores.rmsd import force_rmsd
from xb_muscle_ros.trials.trial import Array

# Of intervals by the curvature where no level was asked for.
LEVEL = 0.95
# So much of the way between its bounds counts as at a bound.
_AT_BOUND = 1e-3


def trial_rows(fitted: Fitted) -> list[dict[str, Any]]:
    """RMSD (F0) of every trial, training and held-out, before the fit and after."""
    before, after = _rmsds(fitted.problem, fitted.problem.start), _rmsds(fitted.problem, fitted.best.z)
    return [
        {
            "trial": trial.name,
            "solution": trial.solution,
            "held_out": trial.held_out,
            "weight": trial.weight,
            "rmsd_before_f0": first,
            "rmsd_f0": last,
            **_calibrated(fitted, trial),
        }
        for trial, first, last in zip(fitted.problem.trials, before, after, strict=True)
    ]


def _calibrated(fitted: Fitted, trial: FitTrial) -> dict[str, Any]:
    """RMSD (F0) of a held-out trial with the faults of its own that its isometric force asks for, start and fit alike.

    Empty where the fit has no such faults; RMSDs are None where nothing tells them, or the model has no solution.
    """
    problem = fitted.problem
    if not (trial.held_out and own_faults(problem, trial)):
        return {}
    row: dict[str, Any] = {"rmsd_before_calibrated_f0": None, "rmsd_calibrated_f0": None, "own_faults": {}}
    for key, z, known in (
        ("rmsd_before_calibrated_f0", problem.start, False),
        ("rmsd_calibrated_f0", fitted.best.z, True),
    ):
        try:
            found = calibrated_force(problem, z, trial, known)
        except UserError:
            continue  # The trial's own row says so already.
        if found.own:
            row[key] = float(np.sqrt(np.mean((found.force_f0 - trial.measured_f0) ** 2)))
            row["own_faults"] = dict(found.own) if known else {}
    return row


def _rmsds(problem: Problem, z: Array) -> list[float | None]:
    """RMSD of each trial at a point, F0; None where the model has no solution there."""
    found: list[float | None] = []
    for trial in problem.trials:
        try:
            force = problem.predicted(z, [trial])[0]
        except UserError:
            found.append(None)
            continue
        everything = (float(trial.force_time_s[0]), float(trial.force_time_s[-1]))
        found.append(force_rmsd(trial.force_time_s, force, trial.measured_f0, everything))
    return found


def mean_rmsd(rows: Sequence[Mapping[str, Any]], held_out: bool, key: str) -> float | None:
    """Root mean square of the trials' RMSDs, F0; None where there are none."""
    squares = [row[key] ** 2 for row in rows if row["held_out"] == held_out and row.get(key) is not None]
    return math.sqrt(sum(squares) / len(squares)) if squares else None


def parameter_rows(fitted: Fitted) -> list[dict[str, Any]]:
    """Every coordinate with start, value, standard deviation and interval.

    The interval is that of the profile where there is one, else that of the curvature.
    """
    coordinates, shape = fitted.problem.coordinates, fitted.shape
    lower, upper = fitted.problem.bounds
    sds = np.sqrt(np.diag(shape.covariance))
    wanted = float(np.sqrt(chi2.ppf(fitted.settings.level or LEVEL, 1)))
    quadratic = quadratic_ends(coordinates, fitted.best.z, shape.covariance, shape.prior_share, shape.weak, wanted)
    rows = []
    for j, c in enumerate(coordinates):
        z = float(fitted.best.z[j])
        share = (z - lower[j]) / (upper[j] - lower[j])
        row: dict[str, Any] = {
            "name": c.name,
            "group": c.group,
            "unit": PARAMETERS[c.name].unit if c.group is None else ARTEFACTS[c.name].unit,
            "start": c.start,
            "value": c.outward(z),
            "log_scale": c.log,
            # On a logarithmic scale a share of the value.
            "sd": float(sds[j]),
            "bounds": [c.lower, c.upper],
            "prior_sd": None if math.isinf(c.prior_sd) else c.prior_sd,
            "at_bound": "lower" if share < _AT_BOUND else "upper" if share > 1.0 - _AT_BOUND else None,
        }
        sides = fitted.sides.get(j)
        ends = [(side.end, side.ended_by) for side in sides] if sides else list(quadratic[j])
        row["interval"] = [c.outward(end) for end, _ in ends]
        row["interval_closed"] = [what == DATA for _, what in ends]
        row["interval_ended_by"] = [what for _, what in ends]
        row["interval_kind"] = "profile" if sides else "curvature"
        if sides:
            row["profile"] = [[c.outward(x), root] for x, root in sorted({*sides[0].points, *sides[1].points})]
        rows.append(row)
    return rows


def as_json(fitted: Fitted, provenance: Mapping[str, Any], notes: Sequence[str] = ()) -> dict[str, Any]:
    """Everything, for ``fit.json``.

    Args:
        notes: lines on what was taken for granted before it began.
    """
    rows = trial_rows(fitted)
    problem, parameters = fitted.problem, parameter_rows(fitted)
    training = Training(problem)
    return {
        "version": __version__,
        "fibre": problem.fibre.name,
        "model": problem.fibre.model,
        "method": problem.fibre.method,
        "provenance": dict(provenance),
        "seed": fitted.settings.seed,
        "level": fitted.settings.level,
        "cost": fitted.best.cost,
        "converged": fitted.best.converged,
        "settled": fitted.settled,
        "mismatch_f0": fitted.mismatch_f0,
        "method_settled": fitted.method_settled,
        "scale": fitted.scale._asdict(),
        "train_rmsd_f0": mean_rmsd(rows, False, "rmsd_f0"),
        "heldout_rmsd_f0": mean_rmsd(rows, True, "rmsd_f0"),
        "heldout_rmsd_calibrated_f0": mean_rmsd(rows, True, "rmsd_calibrated_f0"),
        "before": {
            "train_rmsd_f0": mean_rmsd(rows, False, "rmsd_before_f0"),
            "heldout_rmsd_f0": mean_rmsd(rows, True, "rmsd_before_f0"),
            "heldout_rmsd_calibrated_f0": mean_rmsd(rows, True, "rmsd_before_calibrated_f0"),
        },
        "trials": rows,
        "features": [
            {**f.__dict__, "model": f.value + float(d) * f.sd}
            for f, d in zip(training.features, training.feature_distance(fitted.best.z), strict=True)
        ],
        "parameters": parameters,
        "ties": dict(problem.ties),
        "held": held(problem),
        "nuisances_not_fitted": unfitted_nuisances(problem),
        "notes": list(notes),
        "correlation": {
            "names": [c.label for c in problem.coordinates],
            "matrix": correlation(fitted.shape.covariance).tolist(),
        },
        "starts": [
            None if s is None else {"cost": s.cost, "rmsd_f0": s.rmsd_f0, "evaluations": s.evaluations}
            for s in fitted.starts
        ],
        "warnings": cautions(fitted, parameters, rows),
    }


def write_fitted(path: Path, fitted: Fitted, found: Mapping[str, Any]) -> Fibre:
    """Write the fitted fibre; the file tells data, split, seed and cost.

    Raises:
        UserError: see `write_fibre`.
    """
    fibre = fitted.problem.fibre_at(fitted.best.z)
    data = found["provenance"]
    where = f", RMSD {100.0 * found['train_rmsd_f0']:.3f} % F0" if found["train_rmsd_f0"] is not None else ""
    features = len(Training(fitted.problem).features)
    training = [row["trial"] for row in found["trials"] if not row["held_out"] and row["weight"] > 0.0]
    held = [row["trial"] for row in found["trials"] if row["held_out"]]
    source = (
        f"fitted with xb_muscle {__version__} to {len(training)} trials and {features} features of "
        f"{data['fibre_of_trials']}{where}; started from {data['start']}"
    )
    fibre = replace(fibre, source=source, path=None)
    constants = f"reference_length_m {fibre.reference_length_m:g}, f0_n {fibre.f0_n:g}"
    moved = zip(fitted.problem.coordinates, fitted.best.z.tolist(), strict=True)
    faults = [f"{c.label} {c.outward(z):.4g}" for c, z in moved if c.group is not None]
    comments = [
        f"Fibre {fibre.name}, model {fibre.model}, method {fibre.method}; everything on the fit is in {data['json']}.",
        f"Trials fitted: {', '.join(training)}.",
        f"Trials held out: {', '.join(held) or 'none'}.",
        f"Seed {fitted.settings.seed}, {fitted.settings.starts} starts, cost {found['cost']:.6g}.",
        f"Faults of the measurement that were fitted beside: {', '.join(faults) or 'none'}.",
        f"Constants ({constants}) are those of the {'trials' if fitted.problem.trials else 'start file'}.",
        f"Parameters held at their values: {', '.join(found['held']) or 'none'}.",
    ]
    write_fibre(path, fibre, comments)
    # Validate what a user will load, with its own parameters compiled.
    Muscle(fibre)
    return fibre
