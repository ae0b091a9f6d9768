"""Descents as work: plain data in, plain data out, so that they run anywhere and are kept in a journal."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.fit.noise import Scale, scale_of
from xb_muscle_ros.fit.problem import Problem
from xb_muscle_ros.fit.solve import Objective, Solution, descend
from xb_muscle_ros.fit.training import Training
from xb_muscle_ros.work import Options, run

Array = npt.NDArray[np.float64]

# Of finding how much of the measurement's errors priors hold.
_ROUNDS = 2


def start_task(task: Mapping[str, Any]) -> dict[str, Any]:
    """One descent; ``lost``, why, where the model has no solution at its start, from where nothing tells the way."""
    objective = Objective(Training(Problem.from_json(task["problem"])), Scale(*task["scale"]))
    z = np.array(task["z"])
    try:
        objective.training.force(z)
        objective.training.feature_distance(z)
    except UserError as error:
        return {"lost": str(error)}
    return solution_to_json(descend(objective, z))


def scale_at(problem: Problem, z: Array) -> Scale:
    """Scale that the residuals at a point turn out to have.

    Each parameter counts as one of what the fit had to make them small, an error of the measurement as the share of it
    that the data tell and not its prior: dozens of them are held by their priors, and take nothing away.
    """
    training = Training(problem)
    residual = training.force(z) - training.measured
    parts = [residual[s] for s in training.slices()]
    scale = scale_of(parts, z.size)
    faults = [j for j, c in enumerate(problem.coordinates) if c.group is not None]
    if not faults:
        return scale
    slopes = training.slopes(z)
    # How much the data tell depends on the scale, a little.
    for _ in range(_ROUNDS):
        shares = _prior_shares(Objective(training, scale), *slopes)
        scale = scale_of(parts, z.size - float(np.sum(shares[faults])))
    return scale


def _prior_shares(objective: Objective, of_force: Array, of_features: Array) -> Array:
    """Share of what is known of each coordinate that its own prior tells, shape (coordinates,).

    Args:
        objective: of the fit.
        of_force, of_features: see `Training.slopes`.
    """
    sds = np.array([c.prior_sd for c in objective.training.problem.coordinates])
    prior = np.where(np.isfinite(sds), sds**-2.0, 0.0)
    weighted = of_force * objective.weights()[:, None]
    h = weighted.T @ weighted + of_features.T @ of_features + np.diag(prior)
    unit = np.sqrt(np.maximum(np.diag(h), 1e-12))
    inverse = np.linalg.pinv(h / np.outer(unit, unit), hermitian=True)
    shares: Array = np.clip(prior * np.diag(inverse) / unit**2, 0.0, 1.0)
    return shares


def descended(problem: Problem, best: Solution, scale: Scale, options: Options) -> Solution:
    """Where one descent from a point ends; the point itself where the model has no solution there."""
    task = {"problem": problem.to_json(), "z": best.z.tolist(), "scale": list(scale)}
    row = run(start_task, [task], nearby(options, "polish"))[0]
    return best if "lost" in row else solution_from_json(row)


def nearby(options: Options, label: str) -> Options:
    """Options for a second's work: in this process, since others take as long to start, unless there is a cluster."""
    return replace(options, label=label, processes=0 if options.scheduler is None else None)


def solution_to_json(s: Solution) -> dict[str, Any]:
    """Plain data."""
    return {**s._asdict(), "z": s.z.tolist()}


def solution_from_json(row: Mapping[str, Any]) -> Solution:
    """A solution from plain data."""
    return Solution(**{**row, "z": np.array(row["z"])})
