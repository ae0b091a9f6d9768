"""Rate of force redevelopment (k_tr) after a quick release and restretch (Brenner and Eisenberg 1986)."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.optimize import OptimizeWarning, curve_fit

from xb_muscle_ros.scores.estimate import Estimate, Missing
from xb_muscle_ros.scores.standard_error import ForceNoise
from xb_muscle_ros.trials.hum import hum
from xb_muscle_ros.trials.trial import Array, Trial

# A manoeuvre: this much shorter, for at most this long, and back to within this share of the step.
SMALLEST_RELEASE_L0 = 0.05
LONGEST_RELEASE_S = 0.5
_BACK = 0.1
# The fit begins where force is lowest soon after the restretch, when heads that were still attached have let go, but
# not before the slack is taken up and the motor has come to rest.
_REST_S = 0.005
_LOWEST_WITHIN_S = 0.1
# Rate, begin and end.
_FITTED = 3
# What is over within the time waited is no redevelopment.
_FASTEST_PER_S = 1.0 / _REST_S
# Length that strays further from where it is held is a movement.
_STILL_L0 = 0.01
_SHORTEST_S = 0.2
# Force that does not fall this far leaves nothing to redevelop.
_SMALLEST_FALL = 0.1
# A straight line fitted besides is told of where it changes k_tr by so many standard errors of the change, by one of
# k_tr, and by this share of it.
_DRIFTS, _MATTERS = 2.6, 0.01
# A fit may try falls without end on its way.
_LARGEST_EXPONENT = 100.0

K_TR = "k_tr"


class Redevelopment(NamedTuple):
    """F = F_end - (F_end - F_start)·exp(-k·t).

    Attributes:
        k_per_s: k_tr, 1/s.
        se_per_s: its standard error, 1/s, from the noise behind what the curve leaves of the force.
        start_f0, end_f0: force at the begin of the fit and where it tends to, F0.
        rmsd_f0: of the force from the curve, F0.
        from_s, to_s: what was fitted, in the clock of the samples, s.
        told: how far a drift of force changes k_tr; empty where it does not, and where the noise is not known.
    """

    k_per_s: float
    se_per_s: float
    start_f0: float
    end_f0: float
    rmsd_f0: float
    from_s: float
    to_s: float
    told: str = ""


def restretch_end(time_s: Array, length_l0: Array) -> float | Missing:
    """Time (s) when the one release by at least 5 % L0 that lasted 0.5 s at most was taken back.

    Args:
        time_s, length_l0: shape (n,), s and L0.
    """
    none = Missing(
        f"there is no release by {100.0 * SMALLEST_RELEASE_L0:g} % L0 or more that is taken back within "
        f"{LONGEST_RELEASE_S:g} s"
    )
    if length_l0.size < 3:
        return none
    shortest = int(np.argmin(length_l0))
    before = float(np.median(length_l0[:shortest])) if shortest else float(length_l0[0])
    step = before - float(length_l0[shortest])
    if step < SMALLEST_RELEASE_L0:
        return none
    away = np.flatnonzero(length_l0 < before - _BACK * step)
    begins = away[np.flatnonzero(np.diff(away, prepend=-2) > 1)]
    if begins.size > 1:
        times = ", ".join(f"{time_s[k]:.4g}" for k in begins[:4]) + (" ..." if begins.size > 4 else "")
        return Missing(
            f"the fibre is released {begins.size} times, at {times} s; k_tr is that of one release: give each a trial "
            "of its own"
        )
    if away[-1] + 1 >= length_l0.size:
        return none
    end_s = float(time_s[away[-1] + 1])
    return end_s if end_s - float(time_s[away[0]]) <= LONGEST_RELEASE_S else none


def still_until(time_s: Array, length_l0: Array, restretched_s: float) -> float:
    """Time (s) until which a fibre is held where the restretch left it.

    Args:
        time_s, length_l0: shape (n,), s and L0.
        restretched_s: end of the restretch, s.
    """
    after = time_s >= restretched_s + _REST_S
    if not np.any(after):
        return float(time_s[-1])
    t, length = time_s[after], length_l0[after]
    moved = np.flatnonzero(np.abs(length - length[0]) > _STILL_L0)
    return float(t[moved[0] - 1] if moved.size else t[-1])


def redevelopment_rate(trial: Trial, time_s: Array, force_f0: Array, noise: ForceNoise | None = None) -> Estimate:
    """k_tr (1/s) of a trial's force; no value, of which nothing is said, where it is not released and restretched once.

    Args:
        time_s, force_f0, noise: see `redevelopment`.
    """
    restretched = restretch_end(trial.time_s, trial.length_change_l0)
    if isinstance(restretched, Missing):
        return Estimate(None)
    if np.ptp(trial.calcium_um) > 0.0:
        return Estimate(None, why="calcium changes, so that force does not redevelop alone")
    until = still_until(trial.time_s, trial.length_change_l0, restretched)
    found = redevelopment(time_s, force_f0, restretched, until, noise)
    if isinstance(found, Redevelopment):
        return Estimate(found.k_per_s, found.se_per_s, found.told)
    # The length of a short record ends before its force does; a movement is not its end.
    again = f" (length moves again at {until:.4g} s)" if until < float(trial.time_s[-1]) - _SHORTEST_S else ""
    return Estimate(None, why=f"{found.why}{again}")


def redevelopment(
    time_s: Array, force_f0: Array, restretched_s: float, until_s: float, noise: ForceNoise | None = None
) -> Redevelopment | Missing:
    """Fit one exponential to the force after the restretch.

    Args:
        time_s, force_f0: shape (n,), s and F0.
        restretched_s: end of the restretch, s.
        until_s: end of the isometric time after it, s.
        noise: of the force in quiet times; the standard error is that which it gives, where that is the larger one:
            a short record hides slow noise in the curve.

    Returns:
        nothing where force does not fall by a tenth of its end below it, does not rise again, is followed for less
        than 0.2 s, or rises faster than 200 1/s.
    """
    after = (time_s >= restretched_s + _REST_S - 5e-10) & (time_s <= until_s + 5e-10)
    t, force = time_s[after], force_f0[after]
    followed_s = float(t[-1] - t[0]) if t.size else 0.0
    if t.size < 5 or followed_s < _SHORTEST_S:
        return Missing(f"force is followed for {followed_s:.3g} s after the restretch; {_SHORTEST_S:g} s are needed")
    first = int(np.argmin(force[t <= t[0] + _LOWEST_WITHIN_S]))
    t, force = t[first:], force[first:]
    end = float(np.mean(force[t >= t[-1] - 0.1 * (t[-1] - t[0])]))
    if t.size < 5 or not end - force[0] > _SMALLEST_FALL * abs(end):
        return Missing("force does not fall by a tenth of its end, so that there is nothing to redevelop")
    since = t - t[0]
    half = float(since[int(np.argmax(force >= 0.5 * (force[0] + end)))])
    start = (np.log(2.0) / max(half, float(since[1])), float(force[0]), end)
    fit = _fitted(_rise, since, force, start)
    if fit is None:
        return Missing("no exponential could be fitted to the force after the restretch")
    found, covariance = fit
    if not 0.0 < found[0] < _FASTEST_PER_S or not np.all(np.isfinite(covariance)):
        return Missing(f"the exponential that fits best has a rate of {found[0]:.3g} 1/s; allowed is 0 to 200")
    residual = force - _rise(since, *found)
    se = _error_of(t, residual, noise, _slopes(since, *found))
    return Redevelopment(
        k_per_s=float(found[0]),
        se_per_s=se,
        start_f0=float(found[1]),
        end_f0=float(found[2]),
        rmsd_f0=float(np.sqrt(np.mean(residual**2))),
        from_s=float(t[0]),
        to_s=float(t[-1]),
        told="" if noise is None else _drift(t, force, tuple(found.tolist()), se, noise),
    )


def _fitted(
    curve: Callable[..., Array], since_s: Array, force: Array, start: tuple[float, ...]
) -> tuple[Array, Array] | None:
    """Parameters of a curve, and their covariance; None where none fits."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", OptimizeWarning)  # a covariance that is not finite tells the same
        try:
            found, covariance = curve_fit(curve, since_s, force, p0=start)
        except RuntimeError:
            return None
    return found, covariance


def _drift(t: Array, force: Array, alone: tuple[float, ...], se: float, noise: ForceNoise) -> str:
    """How far k_tr changes where force drifts besides; empty where it surely does not."""
    since = t - t[0]
    fit = _fitted(_rise_and_drift, since, force, (*alone, 0.0))
    if fit is None or not np.all(np.isfinite(fit[1])) or not 0.0 < fit[0][0] < _FASTEST_PER_S:
        return ""
    k, start, end, slope = fit[0].tolist()
    slopes = np.column_stack([_slopes(since, k, start, end), since])
    residual = force - _rise_and_drift(since, k, start, end, slope)
    alone_too = np.column_stack([_slopes(since, *alone), np.zeros(since.size)])
    change, least = k - alone[0], max(se, _MATTERS * alone[0])
    if abs(change) < max(least, _DRIFTS * _error_of(t, residual, noise, slopes, alone_too)):
        return ""
    own = _error_of(t, residual, noise, slopes)
    return (
        f"force drifts by {slope:.2g} F0/s besides, or rises in two steps: with a straight line k_tr is {k:.3g} ± "
        f"{own:.2g} 1/s, and {alone[0]:.3g} ± {se:.2g} without"
    )


def _error_of(t: Array, residual: Array, noise: ForceNoise | None, slopes: Array, less: Array | None = None) -> float:
    """Standard error of the first parameter of a curve, 1/s; or of its difference from that of another one.

    Args:
        residual: what the curve leaves, F0.
        noise: see `redevelopment`.
        slopes: of the curve against its parameters, shape (n, parameters).
        less: those of the other curve.
    """
    # How the rate answers to the force at each sample.
    weights = np.linalg.pinv(slopes)[0] - (0.0 if less is None else np.linalg.pinv(less)[0])
    step_s = float(np.mean(np.diff(t)))
    lines, rest = hum(step_s, residual)
    se = ForceNoise(lambda lags_s: _autocovariance(rest, lags_s / step_s), step_s, lines).of_sum(weights, t)
    return se if noise is None else max(se, noise.of_sum(weights, t) * _borne_out(noise, slopes, t, residual))


def _borne_out(noise: ForceNoise, slopes: Array, time_s: Array, residual: Array) -> float:
    """How large the residual is beside what the noise would leave of itself around a fitted curve; 1 at most.

    A short quiet time cannot rule slow noise out; a longer record without it can.
    """
    fitted, _ = np.linalg.qr(slopes)
    gamma = noise.autocovariance(time_s)[0]
    left = gamma - float(np.trace(noise.covariance(fitted, time_s))) / time_s.size
    return float(min(1.0, np.sqrt(np.mean(residual**2) / left))) if left > 0.0 else 1.0


def _autocovariance(rest: Array, lags: Array) -> Array:
    """Of what the curve leaves, at lags in samples, F0²: as it is there, up to where it is forgotten.

    What one exponential misses of a muscle's rise is smooth. A model of noise takes that for noise that is never
    forgotten; here it counts for as long as it resembles itself.
    """
    n = rest.size
    spectrum = np.abs(np.fft.rfft(rest - np.mean(rest), 2 * n)) ** 2
    gamma = np.fft.irfft(spectrum)[:n] / max(n - _FITTED, 1)
    gone = np.flatnonzero(gamma <= 0.0)
    # Bartlett's window, which leaves no sum with a variance below zero.
    reach = 2 * int(gone[0]) if gone.size else n
    found: Array = np.interp(lags, np.arange(n), gamma * np.maximum(1.0 - np.arange(n) / reach, 0.0))
    return found


def _rise(since_s: Array, k: float, start: float, end: float) -> Array:
    curve: Array = end - (end - start) * np.exp(np.minimum(-k * since_s, _LARGEST_EXPONENT))
    return curve


def _rise_and_drift(since_s: Array, k: float, start: float, end: float, slope_per_s: float) -> Array:
    return _rise(since_s, k, start, end) + slope_per_s * since_s


def _slopes(since_s: Array, k: float, start: float, end: float) -> Array:
    """Of the curve against rate, begin and end, shape (n, 3)."""
    fading = np.exp(-k * since_s)
    return np.column_stack([(end - start) * since_s * fading, fading, 1.0 - fading])
