"""Values, slopes and extremes of force by parabolas through neighbouring samples, with standard errors.

A single sample has all of its noise, and the difference of two all the more: the largest of many is too large.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple, TypeVar

import numpy as np

from xb_muscle_ros.scores.estimate import Estimate, rounded
from xb_muscle_ros.scores.standard_error import ForceNoise
from xb_muscle_ros.trials.trial import Array

FEWEST = 5
# Parts in which the extreme of a stretch of time is looked for first, and steps from there to the vertex.
_PARTS, _STEPS = 400, 4
# Steps from there to where a parabola crosses a level. What lies above it by so many standard errors of a mean is not
# taken for below; such means there are so many of at least.
_CROSSING_STEPS, _CERTAIN, _FEWEST_MEANS = 5, 4.0, 10
# Parabolas are as wide as noise asks for: until standard errors are this share of the number.
_SURE = 0.01
_WIDTHS = (0.0, 0.125, 0.25, 0.5, 1.0)

_Estimates = TypeVar("_Estimates", bound=tuple[Estimate, ...])


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
    while last - first < FEWEST:
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
    best = _best(time_s, force_f0, between_s, width_s, sign * force_f0, lambda each: sign * each.value)
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
) -> Extreme:
    """The largest (sign 1) or smallest (sign -1) slope of parabolas between two times, F0/s."""
    slopes = sign * np.gradient(force_f0, time_s)
    best = _best(time_s, force_f0, between_s, width_s, slopes, lambda each: sign * each.slope)
    return Extreme(Estimate(best.slope, best.error(np.array([0.0, 1.0, 0.0]), noise)), Estimate(best.at_s))


def crossing(
    time_s: Array, force_f0: Array, level: Estimate, from_s: float, share: float, noise: ForceNoise | None
) -> Estimate:
    """When force that lies above a level first falls through it, by parabolas, s; without a value where it does not.

    Args:
        level: F0, and its standard error.
        from_s: force is looked at from there on, s.
        share: of the time from there until the crossing that a parabola may be wide.
    """
    late = time_s > from_s
    if level.value is None or np.count_nonzero(late) < FEWEST:
        return Estimate(None)
    t, force, at_level = time_s[late], force_f0[late], level.value
    first = _first_below(t, force, at_level, noise)
    if first is None:
        return Estimate(None)

    def through(width_s: float) -> tuple[Estimate]:
        # From a first guess, the parabola's own crossing is a few steps away.
        at_s = next_s = first
        for _ in range(_CROSSING_STEPS):
            here = local(time_s, force_f0, at_s, width_s)
            if here.slope >= 0.0:
                return (Estimate(None),)
            next_s = at_s + (at_level - here.value) / here.slope
            at_s = float(np.clip(next_s, from_s, t[-1]))
        if next_s > t[-1] + 5e-10:  # samples are so low by their noise alone
            return (Estimate(None),)
        se = here.error(np.array([1.0, 0.0, 0.0]) / here.slope, noise)
        return (Estimate(at_s, None if se is None else rounded(float(np.hypot(se, (level.se or 0.0) / here.slope)))),)

    # What has to be sure is the time from there on.
    def since(width_s: float) -> tuple[Estimate]:
        (found,) = through(width_s)
        return (found if found.value is None else found._replace(value=found.value - from_s),)

    (found,) = narrowest(since, share * max(first - from_s, 0.0))
    return found if found.value is None else found._replace(value=found.value + from_s)


def _first_below(t: Array, force: Array, level: float, noise: ForceNoise | None) -> float | None:
    """When force first falls below a level, s: of a noisy force the mean of so many samples as noise asks for."""
    count = 1
    if noise is not None:
        above = float(np.max(force[:FEWEST])) - level
        while 2 * count < t.size // _FEWEST_MEANS and _CERTAIN * noise.of_mean(t[:count]) > above:
            count *= 2
    means = np.convolve(force, np.full(count, 1.0 / count), "valid")
    below = np.flatnonzero(means <= level)
    return float(np.mean(t[below[0] : below[0] + count])) if below.size else None


def widths(most_s: float) -> Iterator[float]:
    """Widths of parabolas that are tried, from that of five samples up to the widest, s."""
    return (share * most_s for share in _WIDTHS)


def is_sure(found: Estimate, least: float = 0.0, share: float = _SURE) -> bool:
    """Whether a number's standard error is so small that its parabola need not be wider.

    Args:
        least: the error of a smaller number may be that of this one.
        share: of the number that the error may be.
    """
    return found.value is not None and (found.se or 0.0) <= share * max(abs(found.value), least)


def narrowest(
    make: Callable[[float], _Estimates], most_s: float, least: float = 0.0, sure: float = _SURE
) -> _Estimates:
    """Of estimates by parabolas, those by the narrowest that are sure; else those by the widest.

    Args:
        make: estimates by parabolas of a width, s.
        most_s: the widest, s.
        least, sure: see `is_sure`.
    """
    for width_s in widths(most_s):
        found = make(width_s)
        if all(is_sure(each, least, sure) for each in found):
            break
    return found


def _best(
    time_s: Array,
    force_f0: Array,
    between_s: tuple[float, float],
    width_s: float,
    promise: Array,
    how_far: Callable[[Local], float],
) -> Local:
    """The parabola that goes furthest between two times: of long stretches first one of each part, then all nearby.

    Args:
        promise: of each sample, by which the one of its part is chosen, shape (n,).
    """

    def furthest(times: Array) -> Local:
        return max((local(time_s, force_f0, at, width_s) for at in times.tolist()), key=how_far)

    inside = np.flatnonzero((time_s > between_s[0]) & (time_s < between_s[1]))
    every = max(inside.size // _PARTS, 1)
    chosen = [inside[k : k + every][np.argmax(promise[inside[k : k + every]])] for k in range(0, inside.size, every)]
    best = furthest(np.concatenate([[between_s[0]], time_s[chosen], [between_s[1]]]))
    if every == 1:
        return best
    around = int(np.searchsorted(time_s[inside], best.at_s))
    return furthest(np.append(time_s[inside[max(around - every, 0) : around + every + 1]], best.at_s))
