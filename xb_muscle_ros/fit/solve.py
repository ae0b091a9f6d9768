"""Least squares: from one start to the nearest best point, all coordinates moving or one held."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import scipy.optimize

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.fit.noise import Scale
from xb_muscle_ros.fit.training import Training
from xb_muscle_ros.trials.trial import Array

# A point where the model has no solution counts as this far from the data, in F0 at every sample and in SD
# at every feature.
_NOWHERE_F0, _NOWHERE_SD = 10.0, 1e3


class Solution(NamedTuple):
    """Where a descent ended.

    Attributes:
        z: the point, on the moved scale.
        cost: half the sum of squares of differences and prior, in units of their standard deviations.
        rmsd_f0: root-mean-square difference over the training samples, F0.
        evaluations: points at which the model was simulated, those for slopes not counted.
        converged: whether it ended by itself.
    """

    z: Array
    cost: float
    rmsd_f0: float
    evaluations: int
    converged: bool


@dataclass(frozen=True)
class Objective:
    """Squared differences between model and training data, in standard deviations, and the prior's.

    Attributes:
        scale: how large a difference is one standard deviation.
    """

    training: Training
    scale: Scale

    def weights(self) -> Array:
        """One over the standard deviation of each sample's difference, shape (samples,)."""
        sd = self.scale.force_sd_f0 * np.sqrt(self.scale.correlation_samples)
        per_trial = [np.sqrt(t.weight) / sd for t in self.training.trials]
        return np.repeat(np.array(per_trial, dtype=np.float64), np.array(self.training.sizes, dtype=np.int64))

    def residuals(self, z: Array) -> Array:
        """Differences, features and prior, shape (samples + features + coordinates,); far off without a solution."""
        training = self.training
        try:
            difference, features = training.force(z) - training.measured, training.feature_distance(z)
        except UserError:
            difference = np.full(training.measured.size, _NOWHERE_F0)
            features = np.full(len(training.features), _NOWHERE_SD)
        difference = np.nan_to_num(difference, nan=_NOWHERE_F0, posinf=_NOWHERE_F0, neginf=-_NOWHERE_F0)
        features = np.nan_to_num(features, nan=_NOWHERE_SD, posinf=_NOWHERE_SD, neginf=-_NOWHERE_SD)
        return np.concatenate([difference * self.weights(), features, training.problem.prior(z)])

    def slopes(self, z: Array) -> Array:
        """Derivatives of `residuals`, shape (samples + features + coordinates, coordinates)."""
        prior = np.diag(np.sqrt(self.training.problem.information))
        force, features = self.training.slopes(z)
        return np.vstack([force * self.weights()[:, None], features, prior])


def descend(
    objective: Objective, z: Array, held: int | None = None, most: int = 200, tolerance: float = 1e-8
) -> Solution:
    """Walk from a point to the nearest best one within the bounds.

    Trust-region least squares (SciPy's ``trf``) with slopes by differences.

    Args:
        z: where to start; a coordinate that is held keeps its value.
        most: points to try at most.
        tolerance: relative change of the cost at which to stop.
    """
    lower, upper = objective.training.problem.bounds
    moving = np.array([j for j in range(z.size) if j != held])
    if not moving.size:
        return _solution(objective, z, float(0.5 * np.sum(objective.residuals(z) ** 2)), 1, True)

    def full(part: Array) -> Array:
        point = z.copy()
        point[moving] = part
        return point

    # The method wants to begin strictly inside.
    margin = 1e-9 * np.maximum(1.0, np.abs(upper - lower))
    inside = np.clip(z, lower + margin, upper - margin)[moving]
    # SciPy's stubs take the function for the module of the same name.
    found: Any = scipy.optimize.least_squares(  # type: ignore[operator]  # SciPy has no types
        lambda part: objective.residuals(full(part)),
        inside,
        jac=lambda part: objective.slopes(full(part))[:, moving],
        bounds=(lower[moving], upper[moving]),
        x_scale="jac",
        ftol=tolerance,
        xtol=1e-9,
        gtol=1e-10,
        max_nfev=most,
    )
    return _solution(objective, full(found.x), float(found.cost), int(found.nfev), found.status > 0)


def _solution(objective: Objective, z: Array, cost: float, evaluations: int, converged: bool) -> Solution:
    training = objective.training
    try:
        difference = training.force(z) - training.measured
        rmsd = float(np.sqrt(np.mean(difference**2))) if difference.size else 0.0
    except UserError:
        rmsd = float("inf")
    return Solution(z, cost, rmsd, evaluations, converged)
