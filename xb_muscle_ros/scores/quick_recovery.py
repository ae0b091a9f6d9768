"""T1 and T2 of a quick length step (Huxley and Simmons 1971; Ford, Huxley and Simmons 1977)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.optimize import curve_fit

from xb_muscle_ros.scores.estimate import Estimate, Missing, rounded, samples
from xb_muscle_ros.scores.standard_error import ForceNoise
from xb_muscle_ros.trials.trial import Array

FEWEST = 12
# Force that moves less than this within the window after the step, F0, recovers nothing.
_LEAST_F0 = 1e-6
# Two rates that are less apart than this cannot be told from one.
_APART = 2.0
# A quick phase of a smaller share of what force does in the window is the slow one's departure from an exponential.
_SMALLEST = 0.02
# Rates of the quick phase that fits begin with, over one over the window.
_STARTS = (10.0, 30.0, 100.0)


class QuickRecovery(NamedTuple):
    """Of one step.

    Attributes:
        t1_f0: force at the end of the step, F0.
        t2_f0: force to which the quick recovery alone leads, F0.
        quick_per_s, slow_per_s: rates of the two exponentials, 1/s.
        fitted: force of the curve at the samples of the window, F0.
        at_s: these samples, s from the end of the step.
    """

    t1_f0: Estimate
    t2_f0: Estimate
    quick_per_s: float
    slow_per_s: float
    at_s: Array
    fitted: Array


def quick_recovery(
    time_s: Array, force_f0: Array, start_s: float, end_s: float, window_s: float, noise: ForceNoise | None = None
) -> QuickRecovery | Missing:
    """T1, and T2 by two exponentials through the force after the step.

    T1 is the force at the end of the step. F(t) = F_end + A_q·exp(-k_q·t) + A_s·exp(-k_s·t) is fitted to the window
    after it; T2 = F_end + A_s, the slow phase taken back to the end of the step, as the tangent to the plateau is by
    Ford, Huxley and Simmons.

    Args:
        time_s, force_f0: shape (n,), s and F0.
        start_s, end_s: of the step, s.
        window_s: what is fitted, from the end of the step on, s.
        noise: of the force; None for simulated force.

    Returns:
        nothing where fewer than 12 samples lie in the window or two phases cannot be distinguished.
    """
    inside = (time_s >= end_s - 5e-10) & (time_s <= end_s + window_s + 5e-10)
    t, force = time_s[inside] - end_s, force_f0[inside]
    if t.size < FEWEST:
        return Missing(f"{samples(t.size)} in {1e3 * window_s:g} ms after the step; {FEWEST} are needed")
    if np.ptp(force) < _LEAST_F0:
        return Missing("force does not recover")
    t1 = Estimate(float(force[0]), None if noise is None else noise.of_mean(time_s[inside][:1]))
    found = _fitted(t, force)
    if found is None:
        return Missing(f"no quick phase can be told from the slow one in the {1e3 * window_s:g} ms after the step")
    end, _, slow, k_quick, k_slow = (float(value) for value in found)
    se = None
    if noise is not None:
        weights = np.linalg.pinv(_slopes(t, *found))
        se = noise.of_sum(weights[0] + weights[2], time_s[inside])
    return QuickRecovery(
        t1, Estimate(end + slow, None if se is None else rounded(se)), k_quick, k_slow, t, _curve(t, *found)
    )


def _fitted(t: Array, force: Array) -> Array | None:
    """Best of fits from several starts; None where none has two phases that are of any size."""
    span = float(t[-1])
    lower = [-np.inf, -np.inf, -np.inf, 0.1 / span, 0.01 / span]
    upper = [np.inf, np.inf, np.inf, 10.0 / float(t[1]), 30.0 / span]
    best: tuple[float, Array] | None = None
    for quick in _STARTS:
        begin = (quick / span, 2.0 / span)
        basis = np.column_stack([np.ones_like(t), *(np.exp(-rate * t) for rate in begin)])
        level = np.linalg.lstsq(basis, force, rcond=None)[0]
        try:
            found, _ = curve_fit(_curve, t, force, p0=(*level, *begin), bounds=(lower, upper), max_nfev=2000)
        except (RuntimeError, ValueError):
            continue
        rss = float(np.sum((_curve(t, *found) - force) ** 2))
        two = found[3] >= _APART * found[4] and abs(found[1]) > _SMALLEST * float(np.ptp(force))
        if two and (best is None or rss < best[0]):
            best = (rss, found)
    return None if best is None else best[1]


def _curve(t: Array, end: float, quick: float, slow: float, k_quick: float, k_slow: float) -> Array:
    force: Array = end + quick * np.exp(-k_quick * t) + slow * np.exp(-k_slow * t)
    return force


def _slopes(t: Array, end: float, quick: float, slow: float, k_quick: float, k_slow: float) -> Array:
    """Of the curve against its five numbers, shape (n, 5)."""
    fast, late = np.exp(-k_quick * t), np.exp(-k_slow * t)
    return np.column_stack([np.ones_like(t), fast, late, -t * quick * fast, -t * slow * late])
