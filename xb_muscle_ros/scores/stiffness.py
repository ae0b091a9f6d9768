"""Short-range stiffness (SRS): the slope of force against length at the start of a stretch."""

from __future__ import annotations

import numpy as np

from xb_muscle_ros.scores.estimate import Estimate, samples
from xb_muscle_ros.scores.standard_error import ForceNoise
from xb_muscle_ros.trials.trial import Array, Phase

WINDOW_S = 0.010
_FEWEST = 3


def short_range_stiffness(
    time_s: Array, length_l0: Array, force_f0: Array, onset_s: float, noise: ForceNoise | None = None
) -> Estimate:
    """Slope of a straight line through the samples of the first 10 ms after onset, F0/L0.

    Args:
        time_s, length_l0, force_f0: shape (n,), at the same times.
        onset_s: start of the stretch, s; samples after it and up to 10 ms later count (van der Zee et al. 2026).
        noise: of the force; None for simulated force.

    Returns:
        no value where fewer than 3 samples lie in the window or length does not change. The standard error is that of
        the slope under the noise: onset and lengths are taken to be exact.
    """
    inside = (time_s > onset_s + 5e-10) & (time_s <= onset_s + WINDOW_S + 5e-10)
    count = int(np.count_nonzero(inside))
    if count < _FEWEST:
        return Estimate(None, why=f"{samples(count)} in the first {1e3 * WINDOW_S:g} ms of the stretch; 3 are needed")
    length = length_l0[inside]
    if np.ptp(length) == 0.0:
        return Estimate(None, why=f"length does not change in the first {1e3 * WINDOW_S:g} ms of the stretch")
    slope = float(np.polyfit(length, force_f0[inside], 1)[0])
    if noise is None:
        return Estimate(slope)
    # The slope of a straight line is a weighted sum of forces.
    apart = length - np.mean(length)
    return Estimate(slope, noise.of_sum(apart / float(apart @ apart), time_s[inside]))


def stiffness_of_phase(
    time_s: Array, length_l0: Array, force_f0: Array, phase: Phase | None, noise: ForceNoise | None = None
) -> Estimate:
    """SRS of a stretch; no value where it is absent (of which nothing is said) or shorter than the 10 ms it takes."""
    if phase is None:
        return Estimate(None)
    lasts_s = phase.end_s - phase.start_s
    if lasts_s < WINDOW_S - 5e-10:
        return Estimate(None, why=f"the stretch lasts {1e3 * lasts_s:.3g} ms; {1e3 * WINDOW_S:g} ms are needed")
    return short_range_stiffness(time_s, length_l0, force_f0, phase.start_s, noise)
