"""Noise at any times: an Ornstein-Uhlenbeck process and white noise, by restricted likelihood on a grid.

White noise and noise that decays exponentially in time are whitened together by a Kalman filter from sample to sample
(Jones and Boadi-Boateng, Biometrics 47 (1991) 161-175). The likelihood is restricted: it leaves out what drift, or a
fit, takes out of the noise (Patterson and Thompson, Biometrika 58 (1971) 545-554).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from xb_muscle_ros.scores.noise.members import SILENCE, OrnsteinUhlenbeck
from xb_muscle_ros.scores.noise.model import LEAST_SD_F0, Source, TrialNoise
from xb_muscle_ros.scores.noise.posterior import share_of_others, spread_over
from xb_muscle_ros.scores.noise.regressions import restricted
from xb_muscle_ros.trials.trial import Array

# Noise of real force at 1 kHz (rat soleus fibre 18Dec2017a, lag-1 correlation 0.95) decays within 20 ms; 50 times
# longer or shorter is nothing special. Where steps are much shorter, a thousandth of white noise shows.
_TAU_S, _LOG_SD = 0.02, 4.0
_LOG_TAU = np.linspace(-6.0, 6.0, 13)
_SHARE = np.array([0.05, 0.2, 0.4, 0.6, 0.8, 0.95, 0.99, 0.999])
# Points of the grid: all times with all shares.
TAUS_S, SHARES = (grid.ravel() for grid in np.meshgrid(_TAU_S * np.exp(_LOG_TAU), _SHARE))
# Whitened samples that are held at a time.
_BLOCK = 512


def log_prior(taus_s: Array) -> Array:
    """Logarithm of the prior of time constants, but for a constant."""
    out: Array = -0.5 * (np.log(taus_s / _TAU_S) / _LOG_SD) ** 2
    return out


class Whitened:
    """Samples and regressors, whitened for noise of variance 1 at every point of a grid.

    Attributes:
        products: of whitened columns with each other, the samples' first, shape (points, 1 + columns, 1 + columns).
        log: log-determinant of the noise's covariance, shape (points,).
    """

    def __init__(
        self, time_s: Array, values_f0: Array, regressors: Array, taus_s: Array = TAUS_S, shares: Array = SHARES
    ) -> None:
        """Whiten.

        Args:
            time_s, values_f0: shape (n,), increasing, s and F0.
            regressors: what may be in the values beside noise, shape (n, columns).
            taus_s, shares: time constants and shares of the process, shape (points,), s.
        """
        columns = np.column_stack([values_f0, regressors])
        self.samples = int(time_s.size)
        self.products = np.zeros((taus_s.size, columns.shape[1], columns.shape[1]))
        self.log = np.zeros(taus_s.size)
        decay = np.exp(-np.diff(time_s, prepend=-np.inf)[:, None] / taus_s)
        state, variance = np.zeros((taus_s.size, columns.shape[1])), np.zeros(taus_s.size)
        for begin in range(0, self.samples, _BLOCK):
            block = columns[begin : begin + _BLOCK]
            innovations = np.empty((block.shape[0], *state.shape))
            variances = np.empty((block.shape[0], taus_s.size))
            for k, kept in enumerate(decay[begin : begin + _BLOCK]):
                state *= kept[:, None]
                variance = kept**2 * variance + (1.0 - kept**2) * shares
                variances[k] = variance + 1.0 - shares
                gain = variance / variances[k]
                np.subtract(block[k], state, out=innovations[k])
                state += gain[:, None] * innovations[k]
                variance *= 1.0 - gain
            self.log += np.sum(np.log(variances), axis=0)
            innovations /= np.sqrt(variances)[:, :, None]
            self.products += innovations.transpose(1, 2, 0) @ innovations.transpose(1, 0, 2)


class Part:
    """A part of a trial, and its restricted likelihood at the points of the grid.

    Attributes:
        silent: whether there is nothing left beside the drift.
        freedom: samples less what the drift takes.
        squares: sum of squares of whitened force beside whitened drift, F0², shape (points,).
        log: log-determinants, shape (points,).
    """

    def __init__(self, time_s: Array, force_f0: Array, drift: Array) -> None:
        """Prepare a part.

        Args:
            time_s, force_f0: shape (n,), s and F0.
            drift: what force may do beside noise, orthonormal, shape (n, columns).
        """
        force = force_f0 - drift @ (drift.T @ force_f0)
        self.silent = float(np.sqrt(np.mean(force**2))) < LEAST_SD_F0
        self.samples, self.freedom = force.size, float(force.size - drift.shape[1])
        whitened = Whitened(time_s, force, drift)
        self.squares, of_drift = restricted(whitened.products, np.zeros((drift.shape[1],) * 2))
        self.log = whitened.log + of_drift


def of_trial(name: str, parts: Mapping[str, Sequence[Part]], source: Source) -> TrialNoise:
    """Noise of one of the trials whose parts are given, at least one of each."""
    own = [p for p in parts[name] if not p.silent]
    samples, freedom = (int(sum(p.samples for p in parts[name])), sum(p.freedom for p in own or parts[name]))
    if not own:
        return TrialNoise(name, source, samples, LEAST_SD_F0, freedom, SILENCE, (SILENCE,))
    others = [p for key, of in parts.items() if key != name for p in of if not p.silent]
    share = share_of_others(sum(p.freedom for p in others))
    log = log_prior(TAUS_S) + _log_likelihood(own) + share * _log_likelihood(others)
    weights = np.exp(log - log.max())
    sizes = np.maximum(np.sqrt(sum(p.squares for p in own) / freedom), LEAST_SD_F0)
    members = tuple(
        OrnsteinUhlenbeck(float(sizes[k]), float(SHARES[k]), float(TAUS_S[k])) for k in spread_over(sizes, weights)
    )
    # The middle one: a grid's most probable point may lie at its edge.
    middle = members[len(members) // 2]
    return TrialNoise(name, source, samples, middle.sd_f0, freedom, middle, members)


def _log_likelihood(parts: Sequence[Part]) -> Array:
    """Logarithm of the restricted likelihood, each part with its own scale of noise, shape (points,)."""
    out = np.zeros(TAUS_S.size)
    for p in parts:
        out -= 0.5 * (p.freedom * np.log(p.squares) + p.log)
    return out
