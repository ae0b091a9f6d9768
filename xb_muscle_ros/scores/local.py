"""Values, slopes and extremes of force by parabolas through neighbouring samples, with standard errors.

A single sample has all of its noise, and the difference of two all the more: the largest of many is too large.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from xb_muscle_ros.scores.estimate import Estimate
from xb_muscle_ros.scores.standard_error import ForceNoise
from xb_muscle_ros.trials.trial import Array

_FEWEST = 5
# Times at which the extreme of a stretch of time is looked for, and steps from there to the vertex.
_TRIED, _STEPS = 400, 4


class Local(NamedTuple):
    """A parabola around a time.

    Attributes:
        at_s: that time, s.
        value, slope, curvature: there: F0, F0/s, F0/s² (the second derivative).
        weights: of the samples in the three, shape (3, samples).
        time_s: of these samples, shape (samples,), s.
    """

    at_s: float
    value: float
    slope: float
    curvature: float
    weights: Array
    time_s: Array

    def error(self, weights: Array, noise: ForceNoise | None) -> float | None:
        """Standard error of a sum of the three with these weights, shape (3,)."""
        return None if noise is None else noise.of_sum(weights @ self.weights, self.time_s)


def local(time_s: Array, force_f0: Array, at_s: float, width_s: float) -> Local:
    """A parabola through the samples within half a width either way, five at least.

    Args:
        time_s, force_f0: shape (n,), increasing, s and F0; n is 5 at least.
    """
    first, last = np.searchsorted(time_s, [at_s - 0.5 * width_s - 5e-10, at_s + 0.5 * width_s + 5e-10])
    while last - first < _FEWEST:
        # The nearer one is taken next.
        left = at_s - time_s[first - 1] if first > 0 else np.inf
        right = time_s[last] - at_s if last < time_s.size else np.inf
        first, last = (first - 1, last) if left <= right else (first, last + 1)
    since = time_s[first:last] - at_s
    scale = float(np.max(np.abs(since)))
    basis = np.vander(since / scale, 3, increasing=True)
    weights = np.linalg.pinv(basis) / np.array([[1.0], [scale], [0.5 * scale**2]])
    value, slope, curvature = (float(each) for each in weights @ force_f0[first:last])
    return Local(at_s, value, slope, curvature, weights, time_s[first:last])


class Extreme(NamedTuple):
    """The largest or smallest value within a stretch of time."""

    value: Estimate
    at_s: Estimate


def extreme(
    time_s: Array,
    force_f0: Array,
    between_s: tuple[float, float],
    width_s: float,
    sign: float,
    noise: ForceNoise | None,
) -> Extreme:
    """The largest (sign 1) or smallest (sign -1) value of parabolas between two times."""
    tried = [local(time_s, force_f0, at, width_s) for at in _times(time_s, between_s)]
    best = max(tried, key=lambda each: sign * each.value)
    for _ in range(_STEPS):
        # To the vertex, where it is within reach; else the extreme is at an end.
        away = -best.slope / best.curvature if sign * best.curvature < 0.0 else np.inf
        reach = 0.5 * float(best.time_s[-1] - best.time_s[0])
        if abs(away) > reach or not between_s[0] <= best.at_s + away <= between_s[1]:
            return Extreme(Estimate(best.value, best.error(np.array([1.0, 0.0, 0.0]), noise)), Estimate(best.at_s))
        vertex = Extreme(
            Estimate(best.value + 0.5 * best.slope * away, best.error(np.array([1.0, away, 0.5 * away**2]), noise)),
            Estimate(best.at_s + away, best.error(np.array([0.0, -1.0, -away]) / best.curvature, noise)),
        )
        best = local(time_s, force_f0, best.at_s + away, width_s)
    return vertex


def steepest(
    time_s: Array,
    force_f0: Array,
    between_s: tuple[float, float],
    width_s: float,
    sign: float,
    noise: ForceNoise | None,
) -> Estimate:
    """The largest (sign 1) or smallest (sign -1) slope of parabolas between two times, F0/s."""
    tried = [local(time_s, force_f0, at, width_s) for at in _times(time_s, between_s)]
    best = max(tried, key=lambda each: sign * each.slope)
    return Estimate(best.slope, best.error(np.array([0.0, 1.0, 0.0]), noise))


def _times(time_s: Array, between_s: tuple[float, float]) -> Array:
    """Times of samples between two times, ends included; of many some."""
    inside = time_s[(time_s > between_s[0]) & (time_s < between_s[1])]
    every = max(inside.size // _TRIED, 1)
    return np.concatenate([[between_s[0]], inside[every // 2 :: every], [between_s[1]]])
