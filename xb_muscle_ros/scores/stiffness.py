"""Short-range stiffness (SRS): the slope of force against length at the start of a stretch."""

from __future__ import annotations

import numpy as np

from xb_muscle_ros.trials.trial import Array, Phase

WINDOW_S = 0.010
_FEWEST = 3


def short_range_stiffness(time_s: Array, length_l0: Array, force_f0: Array, onset_s: float) -> float | None:
    """Slope of a straight line through the samples of the first 10 ms after onset, F0/L0.

    Args:
        time_s, length_l0, force_f0: shape (n,), at the same times.
        onset_s: start of the stretch, s; samples after it and up to 10 ms later count (van der Zee et al. 2026).

    Returns:
        None where fewer than 3 samples lie in the window or length does not change.
    """
    inside = (time_s > onset_s + 5e-10) & (time_s <= onset_s + WINDOW_S + 5e-10)
    if np.count_nonzero(inside) < _FEWEST or np.ptp(length_l0[inside]) == 0.0:
        return None
    return float(np.polyfit(length_l0[inside], force_f0[inside], 1)[0])


def stiffness_of_phase(time_s: Array, length_l0: Array, force_f0: Array, phase: Phase | None) -> float | None:
    """SRS of a stretch; None where it is absent or shorter than the 10 ms it takes."""
    if phase is None or phase.end_s - phase.start_s < WINDOW_S - 5e-10:
        return None
    return short_range_stiffness(time_s, length_l0, force_f0, phase.start_s)


def ratio(value: float | None, reference: float | None) -> float | None:
    """Relative SRS; None where either is missing or the reference is zero."""
    return None if value is None or not reference else value / reference
