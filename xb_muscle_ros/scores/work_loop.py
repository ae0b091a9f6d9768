"""Work of a muscle over a cycle of length (Josephson 1985), with standard errors.

Work is -∫ F dL: positive while the muscle shortens and does work on what moves it, negative while it is lengthened.
Over a closed cycle it is the area of the loop of force against length, positive where the loop is run through
counter-clockwise with length to the right and force upwards. Force and length are straight between samples, and ends of
a cycle may lie between them; so all work is a weighted sum of samples of force.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.scores.estimate import Estimate
from xb_muscle_ros.scores.local import FEWEST, extreme, narrowest
from xb_muscle_ros.scores.standard_error import ForceNoise
from xb_muscle_ros.trials.trial import Array

# The parabola that reads the largest force of a cycle is at most as wide as this share of it.
_PEAK = 0.1
# ... and so wide until its standard error is this share of the force: the largest of several is too large by about one.
_SURE = 0.0025


class Work(NamedTuple):
    """Of one cycle.

    Attributes:
        net: F0·L0; positive: done by the muscle.
        shortening, lengthening: their parts while length falls (as a rule positive) and rises (as a rule negative).
        peak_f0: largest force, F0: of a noisy one that of parabolas as wide as its noise asks for.
        mean_f0: mean over time, F0.
        excursion_l0: longest less shortest length, L0.
        left_l0: length at the end less that at the begin, L0: 0 where the loop is closed.
    """

    net: Estimate
    shortening: Estimate
    lengthening: Estimate
    peak_f0: Estimate
    mean_f0: float
    excursion_l0: float
    left_l0: float

    @property
    def turned_over(self) -> float:
        """Work done by and on the muscle, both counted upwards, F0·L0."""
        return abs(self.shortening.value or 0.0) + abs(self.lengthening.value or 0.0)


def work_of(
    time_s: Array, length_l0: Array, force_f0: Array, begin_s: float, end_s: float, noise: ForceNoise | None = None
) -> Work:
    """Work between two times within the samples.

    Args:
        time_s, length_l0, force_f0: shape (n,), s, L0 and F0.
        noise: of a measured force.
    """
    # The samples in between and one beyond either end.
    first = max(int(np.searchsorted(time_s, begin_s, side="right")) - 1, 0)
    last = min(int(np.searchsorted(time_s, end_s, side="left")), time_s.size - 1)
    inside = slice(first, last + 1)
    time, length, force = time_s[inside], length_l0[inside], force_f0[inside]
    at_s = np.concatenate([[begin_s], time[(time > begin_s) & (time < end_s)], [end_s]])
    at, met = np.interp(at_s, time, length), np.interp(at_s, time, force)
    rise = np.diff(at)
    # Force in the middle of each step times its shortening.
    falling = _falling(at)
    parts = []
    for moving in (falling, ~falling):
        half = np.where(moving, -0.5 * rise, 0.0)
        parts.append(_on_samples(time, at_s, np.append(half, 0.0) + np.append(0.0, half)))
    weights = np.column_stack([parts[0] + parts[1], *parts])
    values = weights.T @ force
    errors = [None] * 3 if noise is None else [noise.of_sum(weight, time) for weight in weights.T]
    made = [Estimate(float(value), error) for value, error in zip(values, errors, strict=True)]
    peak = Estimate(float(met.max())) if noise is None else _peak(time_s, force_f0, (begin_s, end_s), noise)
    mean = float(np.sum(np.diff(at_s) * 0.5 * (met[:-1] + met[1:])) / (end_s - begin_s))
    return Work(made[0], made[1], made[2], peak, mean, float(np.ptp(at)), float(at[-1] - at[0]))


def _peak(time_s: Array, force_f0: Array, between_s: tuple[float, float], noise: ForceNoise) -> Estimate:
    """The largest force of a cycle without what noise adds to the largest of many samples, F0."""
    if time_s.size < FEWEST:
        return Estimate(None, why=f"a parabola through its force needs {FEWEST} samples")
    widest_s = _PEAK * (between_s[1] - between_s[0])
    widest = extreme(time_s, force_f0, between_s, widest_s, 1.0, noise)
    # Where the widest has its top: the largest of many narrow ones is that of the noise again.
    top_s = widest.at_s.value or 0.0
    near_s = max(between_s[0], top_s - 0.25 * widest_s), min(between_s[1], top_s + 0.25 * widest_s)
    return narrowest(
        lambda width_s: (extreme(time_s, force_f0, near_s, width_s, 1.0, noise).value,), widest_s, sure=_SURE
    )[0]


def _falling(length_l0: Array) -> npt.NDArray[np.bool_]:
    """Steps between the longest and the next shortest length of a cycle, shape (n - 1,), whatever noise does."""
    longest, shortest = int(np.argmax(length_l0)), int(np.argmin(length_l0))
    step = np.arange(length_l0.size - 1)
    if longest <= shortest:
        return (step >= longest) & (step < shortest)
    return (step >= longest) | (step < shortest)


def repeats_from(works: list[Work], share: float) -> int | None:
    """The first cycle, counted from 1, from which on net work stays what it is in the last; None: not before the last.

    Args:
        works: of consecutive cycles.
        share: of the work turned over in the last cycle by which net work may differ; 3 standard errors may too.
    """
    last = works[-1]
    allowed = max(share * last.turned_over, 3.0 * (last.net.se or 0.0))
    apart = [abs((work.net.value or 0.0) - (last.net.value or 0.0)) > allowed for work in works]
    begin = len(works) - apart[::-1].index(True) if any(apart) else 0
    return begin + 1 if begin < len(works) - 1 else None


def _on_samples(time_s: Array, at_s: Array, weights: Array) -> Array:
    """Weights of force at some times as weights of the samples that it is interpolated from, shape (samples,)."""
    right = np.clip(np.searchsorted(time_s, at_s, side="left"), 1, time_s.size - 1)
    share = (at_s - time_s[right - 1]) / (time_s[right] - time_s[right - 1])
    made: Array = np.zeros(time_s.size)
    made += np.bincount(right - 1, weights * (1.0 - share), time_s.size)
    made += np.bincount(right, weights * share, time_s.size)
    return made
