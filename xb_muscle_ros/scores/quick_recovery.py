"""T1 and T2 of a quick length step (Huxley and Simmons 1971; Ford, Huxley and Simmons 1977)."""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

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
# Rates of both phases that fits begin with, over one over the window.
_STARTS, _SLOW_STARTS = (10.0, 30.0, 100.0), (0.3, 3.0)
# Slowest and fastest slow phase over one over the window; where it is the slowest, and so no phase, a quick phase is
# at least so fast.
_SLOW, _QUICK_ALONE = (0.01, 30.0), 10.0
# Force may come to T1 so long after length has come to its end, s, or as long as the step takes; it is known to do so
# where it goes on by so many standard errors of a sample, and by this share of its change.
_MOST_LAG_S, _SURE_LAG, _LEAST_LAG = 5e-4, 5.0, 0.01
# The amplitude of a quick phase of a measured force is at least so many standard errors: its rate is not known before.
_SURE = 4.0


class QuickRecovery(NamedTuple):
    """Of one step.

    Attributes:
        t2_f0: force to which the quick recovery alone leads, F0.
        quick_per_s, slow_per_s: rates of the two exponentials, 1/s.
        fitted: force of the curve at the samples of the window, F0.
        at_s: these samples, s from the end of the step.
    """

    t2_f0: Estimate
    quick_per_s: Estimate
    slow_per_s: Estimate
    at_s: Array
    fitted: Array


def quick_recovery(
    time_s: Array, force_f0: Array, end_s: float, window_s: float, size_l0: float, noise: ForceNoise | None = None
) -> QuickRecovery | Missing:
    """T2 by two exponentials through the force after the step.

    F(t) = F_end + A_q·exp(-k_q·t) + A_s·exp(-k_s·t) is fitted to the window
    after it; T2 = F_end + A_s, the slow phase taken back to the end of the step, as the tangent to the plateau is by
    Ford, Huxley and Simmons.

    Args:
        time_s, force_f0: shape (n,), s and F0.
        end_s: of the step, s.
        window_s: what is fitted, from the end of the step on, s.
        size_l0: of the step: what recovers quickly goes back from where it led.
        noise: of the force; None for simulated force.

    Returns:
        nothing where fewer than 12 samples lie in the window, two phases cannot be distinguished, or the quick one is
        within its errors.
    """
    inside = (time_s >= end_s - 5e-10) & (time_s <= end_s + window_s + 5e-10)
    t, force = time_s[inside] - end_s, force_f0[inside]
    if t.size < FEWEST:
        return Missing(f"{samples(t.size)} in {1e3 * window_s:g} ms after the step; {FEWEST} are needed")
    if np.ptp(force) < _LEAST_F0:
        return Missing("force does not recover")
    none = f"no quick phase can be told from the slow one in the {1e3 * window_s:g} ms after the step"
    found = _fitted(t, force)
    if found is None or found[1] * size_l0 <= 0.0:
        return Missing(none)
    end, quick, slow, k_quick, k_slow = (float(value) for value in found)
    errors: list[float | None] = [None] * 3
    if noise is not None:
        # Of the quick phase's amplitude, of T2, and of both rates.
        weights = np.linalg.pinv(_slopes(t, *found))
        sums = weights[1], weights[0] + weights[2], weights[3], weights[4]
        of_quick, *known = (noise.of_sum(each, time_s[inside]) for each in sums)
        errors = [rounded(each) for each in known]
        if abs(quick) < _SURE * of_quick:
            return Missing(f"{none} (amplitude {quick:.2g} ± {of_quick:.1g} F0)")
    t2, of_quick_rate, of_slow_rate = map(Estimate, (end + slow, k_quick, k_slow), errors)
    return QuickRecovery(t2, of_quick_rate, of_slow_rate, t, _curve(t, *found))


class FirstTension(NamedTuple):
    """T1 of a step.

    Attributes:
        t1_f0: F0.
        sample: number of the sample whose force that is.
        lag_s: how long after the end of the length step that is, where a measured force comes to it at another time;
            else 0.
    """

    t1_f0: Estimate
    sample: int
    lag_s: float


def first_tension(
    time_s: Array,
    force_f0: Array,
    step_s: tuple[float, float],
    size_l0: float,
    noise: ForceNoise | None = None,
    measured: bool = False,
) -> FirstTension:
    """T1: force of the first sample at the end of a step or after it.

    A measured force may lag length, by a filter or a channel read later, and noise of length may hide where the step
    ends. Then T1 is the extreme of force about that time (Ford, Huxley and Simmons 1977).

    Args:
        time_s, force_f0: shape (n,), s and F0.
        step_s: begin and end of the length step, s.
        size_l0: of the step.
        noise: of a measured force, where that is known.
        measured: force may lag.

    Returns:
        without a value where force still goes on when it should have come to its extreme.
    """
    start_s, end_s = step_s
    first = min(int(np.searchsorted(time_s, end_s - 5e-10)), time_s.size - 1)
    one = None if noise is None else noise.of_mean(time_s[first : first + 1])
    if not measured:
        return FirstTension(Estimate(float(force_f0[first]), one), first, 0.0)
    reach_s = max(end_s - start_s, _MOST_LAG_S)
    last = max(int(np.searchsorted(time_s, end_s + reach_s + 5e-10, side="right")), first + 1)
    earliest = min(int(np.searchsorted(time_s, 0.5 * (start_s + end_s))), first)
    away = np.sign(size_l0) * (force_f0[earliest:last] - force_f0[first])
    k = earliest + int(np.argmax(away))
    # Force before the step, of which the last sample may lie within it.
    begin = max(int(np.searchsorted(time_s, start_s + 5e-10)) - 1, 0)
    least = max(_SURE_LAG * (one or 0.0), _LEAST_LAG * abs(float(force_f0[k] - force_f0[begin])))
    if k == first or float(away[k - earliest]) <= least:
        return FirstTension(Estimate(float(force_f0[first]), one), first, 0.0)
    lag_s = float(time_s[k]) - end_s
    if k == last - 1:
        why = f"force still goes on {1e3 * lag_s:.2g} ms after the step: it lags length by more, or is no stiffness"
        return FirstTension(Estimate(None, why=why), k, lag_s)
    return FirstTension(Estimate(float(force_f0[k]), one), k, lag_s)


def _fitted(t: Array, force: Array) -> Array | None:
    """Best of fits from several starts; None where it has no two phases that are of any size.

    Level and amplitudes follow from the rates (variable projection: Golub and Pereyra 1973).
    """
    span = float(t[-1])
    # Of what is over within two samples nothing is known.
    fastest = max(0.5 / float(np.median(np.diff(t))), 0.2 / span)
    lower = np.log([0.1 / span, _SLOW[0] / span])
    upper = np.log([fastest, _SLOW[1] / span])

    def amplitudes(rates: Array) -> Array:
        found: Array = np.linalg.lstsq(_basis(t, *np.exp(rates)), force, rcond=None)[0]
        return found

    def left(rates: Array) -> Array:
        rest: Array = _basis(t, *np.exp(rates)) @ amplitudes(rates) - force
        return rest

    best: tuple[float, Array] | None = None
    for quick, slow in itertools.product(_STARTS, _SLOW_STARTS):
        start = np.clip(np.log([quick / span, slow / span]), lower + 1e-6, upper - 1e-6)
        fit = least_squares(  # type: ignore[operator]  # the stubs take the module of this name for it
            left, start, bounds=(lower, upper), xtol=1e-13, ftol=1e-13, gtol=1e-15, max_nfev=60
        )
        if best is None or fit.cost < best[0]:
            best = (float(fit.cost), fit.x)
    assert best is not None
    k_quick, k_slow = np.exp(best[1])
    found = np.array([*amplitudes(best[1]), k_quick, k_slow])
    two = k_quick >= _APART * k_slow and abs(found[1]) > _SMALLEST * float(np.ptp(force))
    alone = best[1][1] < lower[1] + 0.01
    two &= best[1][0] < upper[0] - 0.01  # else it is over before two samples have come
    return found if two and (not alone or k_quick >= _QUICK_ALONE / span) else None


def _basis(t: Array, k_quick: float, k_slow: float) -> Array:
    return np.column_stack([np.ones_like(t), np.exp(-k_quick * t), np.exp(-k_slow * t)])


def _curve(t: Array, end: float, quick: float, slow: float, k_quick: float, k_slow: float) -> Array:
    force: Array = end + quick * np.exp(-k_quick * t) + slow * np.exp(-k_slow * t)
    return force


def _slopes(t: Array, end: float, quick: float, slow: float, k_quick: float, k_slow: float) -> Array:
    """Of the curve against its five numbers, shape (n, 5)."""
    fast, late = np.exp(-k_quick * t), np.exp(-k_slow * t)
    return np.column_stack([np.ones_like(t), fast, late, -t * quick * fast, -t * slow * late])
