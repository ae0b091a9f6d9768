"""Noise of trials from pieces of them, however sampled: white noise and noise that fades in time.

A first-order autoregression in continuous time with white noise on top, whitened by a Kalman filter from sample to
sample (Jones and Boadi-Boateng, Biometrics 47 (1991) 161-175), and its restricted likelihood at points of a grid.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.scores.noise.members import SILENCE, Memory
from xb_muscle_ros.scores.noise.model import LEAST_SD_F0, Source, TrialNoise
from xb_muscle_ros.scores.noise.posterior import share_of_others, spread_over
from xb_muscle_ros.scores.noise.regressions import restricted

Array = npt.NDArray[np.float64]

# Noise of real force at 1 kHz (rat soleus fibre 18Dec2017a, lag-1 correlation 0.95) fades within 20 ms; 50 times longer
# or shorter is nothing special. Where steps are much shorter, a thousandth of white noise shows.
_TAU_S, _LOG_SD = 0.02, 4.0
_LOG_TAU = np.linspace(-6.0, 6.0, 13)
_SHARE = np.array([0.05, 0.2, 0.4, 0.6, 0.8, 0.95, 0.99, 0.999])
# Points of the grid: all times with all shares.
_TAUS_S, _SHARES = (grid.ravel() for grid in np.meshgrid(_TAU_S * np.exp(_LOG_TAU), _SHARE))
_PRIOR = 0.5 * np.log(_TAUS_S / _TAU_S) ** 2 / _LOG_SD**2


class Timed:
    """A piece of a trial, and its likelihood at the points of the grid.

    Attributes:
        silent: whether there is nothing left beside the drift.
        samples: how many.
        freedom: samples less what the drift takes.
        left: squares of whitened force beside whitened drift, F0², shape (points,).
        log: log-determinants, shape (points,).
    """

    def __init__(self, time_s: Array, force_f0: Array, drift: Array) -> None:
        """Prepare a piece.

        Args:
            time_s, force_f0: shape (n,), s and F0.
            drift: what force may do beside noise, orthonormal, shape (n, columns).
        """
        force = force_f0 - drift @ (drift.T @ force_f0)
        self.silent = float(np.sqrt(np.mean(force**2))) < LEAST_SD_F0
        self.samples, self.freedom = force.size, float(force.size - drift.shape[1])
        columns, variances = _whitened(time_s, np.column_stack([force, drift]))
        self.left, of_drift = restricted(np.swapaxes(columns, -1, -2) @ columns, np.zeros((drift.shape[1],) * 2))
        self.log = np.sum(np.log(variances), axis=1) + of_drift


def _whitened(time_s: Array, columns: Array) -> tuple[Array, Array]:
    """What is new in the samples in units of its deviation, shape (points, n, columns), and its variance, (points, n).

    Of noise of variance 1 at every point of the grid.
    """
    kept = np.exp(-np.diff(time_s, prepend=-np.inf)[:, None] / _TAUS_S)
    found = np.empty((_TAUS_S.size, *columns.shape))
    variances = np.empty((_TAUS_S.size, time_s.size))
    state, spread = np.zeros((_TAUS_S.size, columns.shape[1])), np.zeros(_TAUS_S.size)
    for k, row in enumerate(columns):
        state = kept[k, :, None] * state
        spread = kept[k] ** 2 * spread + (1.0 - kept[k] ** 2) * _SHARES
        variance = spread + 1.0 - _SHARES
        new = row - state
        state = state + (spread / variance)[:, None] * new
        spread = spread * (1.0 - spread / variance)
        found[:, k] = new / np.sqrt(variance)[:, None]
        variances[:, k] = variance
    return found, variances


def by_memories(parts: Mapping[str, Sequence[Timed]], source: Source) -> dict[str, TrialNoise]:
    """Noise of trials.

    Args:
        parts: of each, at least one.
        source: what they are.
    """
    return {name: _of_trial(name, parts, source) for name in parts}


def _of_trial(name: str, parts: Mapping[str, Sequence[Timed]], source: Source) -> TrialNoise:
    own = [p for p in parts[name] if not p.silent]
    samples, freedom = (int(sum(p.samples for p in parts[name])), sum(p.freedom for p in own or parts[name]))
    if not own:
        return TrialNoise(name, source, samples, LEAST_SD_F0, freedom, SILENCE, (SILENCE,))
    others = [p for key, of in parts.items() if key != name for p in of if not p.silent]
    share = share_of_others(sum(p.freedom for p in others))
    costs = _PRIOR + _costs(own) + share * _costs(others)
    weights = np.exp(costs.min() - costs)
    sizes = np.maximum(np.sqrt(sum(p.left for p in own) / freedom), LEAST_SD_F0)
    members = tuple(Memory(float(sizes[k]), float(_SHARES[k]), float(_TAUS_S[k])) for k in spread_over(sizes, weights))
    # The middle one: a grid's most probable point may lie at its edge.
    middle = members[len(members) // 2]
    return TrialNoise(name, source, samples, middle.sd_f0, freedom, middle, members)


def _costs(parts: Sequence[Timed]) -> Array:
    """Minus the logarithm of the restricted likelihood, each part with its own size of noise, shape (points,)."""
    out = np.zeros(_TAUS_S.size)
    for p in parts:
        out += 0.5 * (p.freedom * np.log(p.left) + p.log)
    return out
