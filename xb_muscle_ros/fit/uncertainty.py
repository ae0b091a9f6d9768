"""How well a fit knows its coordinates: covariance, correlation, and profile likelihood intervals.

Samples count as correlated (see `scores.noise.residual`): the covariance is the sandwich H^-1 V H^-1 of curvature H and
covariance V of the score, and a profile's threshold is scaled by what this makes of the coordinate's variance, as for
composite likelihoods (Varin, Reid and Firth, Statistica Sinica 21 (2011) 5-42). Where model and data differ by more
than noise the residuals are larger and slower, and so the intervals wider; but no interval knows of an error that all
trials share.
"""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.stats import chi2

from xb_muscle_ros.fit.ends import BOUND, UNSETTLED, of_parameters, profile_end
from xb_muscle_ros.fit.linear_fit import LinearFit
from xb_muscle_ros.fit.noise import noise_at
from xb_muscle_ros.fit.solve import Objective, Solution, descend
from xb_muscle_ros.trials.trial import Array

# Points on one side of a profile at most; the search converges on the root of the likelihood ratio in four or five.
_POINTS = 9
# Root of the likelihood ratio within which the end of an interval is found.
_CLOSE = 0.05


class Curvature(NamedTuple):
    """Shape of the objective at its best point.

    Attributes:
        covariance: of the coordinates on the moved scale, shape (p, p).
        inflation: variance over what the curvature alone would say, shape (p,).
        weak: coordinates whose direction the data hardly see, shape (p,).
        prior_share: share of what is known of a coordinate that model parameters' priors tell, shape (p,).
    """

    covariance: Array
    inflation: Array
    weak: npt.NDArray[np.bool_]
    prior_share: Array


def curvature(objective: Objective, z: Array) -> Curvature:
    """Curvature and covariance at a point."""
    training = objective.training
    slopes = of_force, of_features = training.slopes(z)
    # Features and priors are taken at their word: independent, with the standard deviations they come with.
    certain = of_features.T @ of_features + np.diag(training.problem.information)
    fit = LinearFit(of_force, objective.weights(), certain)
    noise = noise_at(training, z, slopes)
    v = certain + sum(noise.covariance_of_sums(i, fit.score[s]) for i, s in enumerate(training.slices()))
    inverse, weak = fit.inverse, fit.weak
    covariance = inverse @ v @ inverse
    inflation = np.diag(covariance) / np.maximum(np.diag(inverse), 1e-300)
    # Along the direction in which a coordinate's profile goes.
    along = inverse / np.sqrt(np.maximum(np.diag(inverse), 1e-300))
    share = np.sum(of_parameters(training.problem.coordinates)[:, None] * along**2, axis=0)
    return Curvature(covariance, np.where(weak, 1.0, inflation), weak, share)


class ProfileEnd(NamedTuple):
    """One end of an interval.

    Attributes:
        end: on the moved scale; where nothing ends the interval before, the coordinate's own bound.
        ended_by: see `ends`; only data close an interval.
        points: pairs of coordinate and root of the likelihood ratio, in order of computing.
        better: a point better than the one the profile started from, or None.
    """

    end: float
    ended_by: str
    points: list[tuple[float, float]]
    better: list[float] | None


def profile_side(
    objective: Objective, best: Solution, index: int, up: bool, shape: Curvature, level: float = 0.95
) -> ProfileEnd:
    """Follow one coordinate from the best point, all others moving along, to where the likelihood ratio ends it."""
    lower, upper = objective.training.problem.bounds
    bound = float(upper[index] if up else lower[index])
    wanted = float(np.sqrt(chi2.ppf(level, 1)))
    sd = float(np.sqrt(shape.covariance[index, index]))
    # The others follow as the covariance says; where it says nothing they start from where they were.
    along = shape.covariance[:, index] / max(sd * sd, 1e-300)
    origin, points = float(best.z[index]), [(float(best.z[index]), 0.0)]
    inflation = float(shape.inflation[index])
    reaches: dict[float, Solution] = {}

    def ended(target: float) -> ProfileEnd:
        what = profile_end(objective, best, reaches[target], index, inflation, wanted)
        return ProfileEnd(target, what, points, None)

    distance = wanted * sd if 0.0 < sd < 1e3 else 0.5
    reached = origin
    for _ in range(_POINTS):
        target = origin + distance if up else origin - distance
        at_bound = target >= bound if up else target <= bound
        target = bound if at_bound else target
        guess = np.clip(best.z + along * (target - origin), lower, upper)
        guess[index] = target
        found = descend(objective, guess, held=index, most=30, tolerance=1e-4)
        gain = 2.0 * (found.cost - best.cost) / inflation
        if gain < -0.02:
            return ProfileEnd(target, UNSETTLED, points, found.z.tolist())
        root = float(np.sqrt(max(gain, 0.0)))
        points.append((target, root))
        reaches[target] = found
        reached = target
        if abs(root - wanted) < _CLOSE:
            return ended(target)
        if at_bound and root < wanted:
            return ProfileEnd(bound, BOUND, points, None)
        distance = _next_distance(points, origin, wanted)
    inside = [p for p in points if p[1] >= wanted]
    # The search did not settle: the nearest point that is out, if there is one.
    if inside:
        return ended(min(inside, key=lambda p: abs(p[0] - origin))[0])
    return ProfileEnd(reached, UNSETTLED, points, None)


def _next_distance(points: list[tuple[float, float]], origin: float, wanted: float) -> float:
    """Where to look next: between the nearest points on either side of the wanted root, or further out."""
    known = sorted((abs(x - origin), root) for x, root in points)
    for (near, low), (far, high) in itertools.pairwise(known):
        if low <= wanted <= high and high > low:
            share = (wanted - low) / (high - low)
            return near + (far - near) * min(max(share, 0.1), 0.9)
    far, high = known[-1]
    return far * min(max(1.1 * wanted / max(high, 1e-3), 1.3), 4.0)


def correlation(covariance: Array) -> Array:
    """Correlation matrix of a covariance; 0 beside a coordinate without variance."""
    sd = np.sqrt(np.diag(covariance))
    scale = np.where(sd > 0.0, sd, np.inf)
    matrix = covariance / np.outer(scale, scale)
    np.fill_diagonal(matrix, 1.0)
    return matrix
