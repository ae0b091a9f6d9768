"""What ends an interval: the data, or only a prior, or a bound, be it one of another parameter.

An interval that a bound ends says how far the fit was allowed to go, and nothing of what the data know.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.fit.coordinates import Coordinate
from xb_muscle_ros.fit.solve import Objective, Solution
from xb_muscle_ros.trials.trial import Array

DATA, PRIOR, BOUND, UNSEEN, UNSETTLED = "data", "prior", "bound", "nothing", "search"
"""Ends of an interval; a bound of others is ``bound of k21``. Only data close one."""

# So much of the way between its bounds counts as at one while others are profiled: descents stop a little inside.
_NEAR = 0.02
# A bound that matters shortens an interval by more than such a share of it.
_MATTERS = 0.9


def profile_end(
    objective: Objective, best: Solution, end: Solution, index: int, inflation: float, wanted: float
) -> str:
    """What ends a profile at a point where the likelihood ratio reaches its limit.

    Args:
        best: its best point.
        end: the best point with the coordinate held at the end of its interval.
        inflation: of its variance, see `uncertainty.Curvature`.
        wanted: limit of the root of the likelihood ratio.
    """
    coordinates = objective.training.problem.coordinates
    slopes, residual = objective.slopes(end.z), objective.residuals(end.z)
    stopped = [j for j in _pushed(objective, end.z, slopes.T @ residual) if j != index]
    if stopped:
        # Were the bounds not there: to first order, at the end and at the best point alike.
        others = [j for j in range(end.z.size) if j != index]
        ratio = 2.0 * (end.cost - _gain(slopes[:, others], residual))
        ratio -= 2.0 * (best.cost - _gain(objective.slopes(best.z), objective.residuals(best.z)))
        if np.sqrt(max(ratio / inflation, 0.0)) < _MATTERS * wanted:
            return bound_of([coordinates[j] for j in stopped])
    return PRIOR if _prior(objective, end.z) - _prior(objective, best.z) > 0.5 * (end.cost - best.cost) else DATA


def bound_of(coordinates: list[Coordinate]) -> str:
    """An end that bounds of other coordinates make."""
    return f"{BOUND} of {', '.join(c.label for c in coordinates)}"


def of_parameters(coordinates: tuple[Coordinate, ...]) -> Array:
    """Precision of the priors of model parameters, shape (coordinates,).

    Those of measurement artefacts are left out: how large these are is known from elsewhere.
    """
    return np.array([c.prior_sd**-2.0 if c.group is None else 0.0 for c in coordinates])


def _prior(objective: Objective, z: Array) -> float:
    """The model parameters' priors' part of the cost."""
    coordinates = objective.training.problem.coordinates
    means = np.array([c.prior_mean for c in coordinates])
    return 0.5 * float(np.sum(of_parameters(coordinates) * (z - means) ** 2))


def _pushed(objective: Objective, z: Array, gradient: Array) -> list[int]:
    """Coordinates at a bound beyond which the cost would fall."""
    lower, upper = objective.training.problem.bounds
    margin = _NEAR * (upper - lower)
    out = ((z > upper - margin) & (gradient < 0.0)) | ((z < lower + margin) & (gradient > 0.0))
    return [int(j) for j in np.flatnonzero(out)]


def _gain(slopes: Array, residual: Array) -> float:
    """By how much the cost would fall with no bounds, the residuals taken as linear."""
    step = np.linalg.lstsq(slopes, residual, rcond=1e-6)[0]
    return 0.5 * float(residual @ residual - np.sum((residual - slopes @ step) ** 2))


def quadratic_ends(
    coordinates: tuple[Coordinate, ...],
    z: Array,
    covariance: Array,
    prior_share: Array,
    weak: npt.NDArray[np.bool_],
    wanted: float,
) -> list[tuple[tuple[float, str], tuple[float, str]]]:
    """Both ends of each coordinate's interval by the curvature at the best point, and what ends them.

    Args:
        z: its best point, on the moved scale.
        covariance, prior_share, weak: see `uncertainty.Curvature`.
        wanted: half width, in standard deviations.

    Returns:
        for each coordinate, downward and upward: end on the moved scale, and what ends it.
    """
    bounds = [(c.inward(c.lower), c.inward(c.upper)) for c in coordinates]
    sds = np.sqrt(np.diag(covariance))
    found = []
    for i in range(z.size):
        ends = []
        for sign in (-1.0, 1.0):
            end, bound = z[i] + sign * wanted * sds[i], bounds[i][0 if sign < 0.0 else 1]
            stopped = [
                coordinates[j]
                for j in range(z.size)
                if j != i and sds[i] > 0.0 and sds[j] > 0.0
                and _cut(covariance[i, j] / (sds[i] * sds[j]), sign, z[j], bounds[j], sds[j], wanted)
            ]  # fmt: skip
            if weak[i] or not sds[i] > 0.0:
                ends.append((bound, UNSEEN))
            elif sign * (end - bound) >= 0.0:
                ends.append((bound, BOUND))
            elif stopped:
                ends.append((float(end), bound_of(stopped)))
            else:
                ends.append((float(end), PRIOR if prior_share[i] > 0.5 else DATA))
        found.append((ends[0], ends[1]))
    return found


def _cut(correlation: float, sign: float, z: float, bounds: tuple[float, float], sd: float, wanted: float) -> bool:
    """Whether another coordinate's bound would cut an interval short: it follows as far as its bound, then stops."""
    along = sign * correlation
    room = (bounds[1] - z if along > 0.0 else z - bounds[0]) / sd
    strength = abs(along)
    if strength * wanted <= room:
        return False
    reached = strength * room + np.sqrt(max(wanted**2 - room**2, 0.0) * (1.0 - strength**2))
    return bool(reached < _MATTERS * wanted)
