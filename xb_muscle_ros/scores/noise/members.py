"""Models of a trial's noise: autoregressions where it is sampled evenly, an Ornstein-Uhlenbeck process where not."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.signal import lfilter, lfiltic

from xb_muscle_ros.scores.noise.model import LEAST_SD_F0
from xb_muscle_ros.trials.trial import Array

# Samples until drawn noise forgets how it began.
_BURN_IN = 400


class Regression(NamedTuple):
    """One autoregression that may have made a trial's noise.

    Attributes:
        weights: shape (order,).
        innovation_sd_f0: standard deviation of the innovations, F0.
        sd_f0: standard deviation, F0.
        autocorrelation: at lags 0, 1, ... samples, shape (order + 1,).
    """

    weights: Array
    innovation_sd_f0: float
    sd_f0: float
    autocorrelation: Array

    def draw(self, time_s: Array, factor: Array, random: np.random.Generator) -> Array:
        """See `model.Member`; samples are taken to be a step apart."""
        white = (self.innovation_sd_f0 * factor)[:, None] * random.standard_normal(
            (factor.size, time_s.size + _BURN_IN)
        )
        # Along the last axis, where samples lie side by side: three times as fast.
        return lfilter([1.0], np.concatenate([[1.0], -self.weights]), white, axis=-1)[:, _BURN_IN:]

    def variance_of_mean(self, time_s: Array) -> float:
        """See `model.Member`."""
        n = time_s.size
        gamma = self.autocovariance(n)
        return float(2.0 * (1.0 - np.arange(n) / n) @ gamma - gamma[0])

    def autocovariance(self, lags: int) -> Array:
        """At lags 0 to `lags` - 1 samples, shape (lags,), F0²."""
        known = self.sd_f0**2 * self.autocorrelation
        if lags <= known.size:
            return known[:lags]
        recursion = np.concatenate([[1.0], -self.weights])
        beyond, _ = lfilter([1.0], recursion, np.zeros(lags - known.size), zi=lfiltic([1.0], recursion, known[:0:-1]))
        return np.concatenate([known, beyond])

    def spectrum(self, frequency_hz: Array, step_s: float) -> Array:
        """Density at both signs of frequency, F0²/Hz, shape (n,); its integral to half the rate either way is `sd_f0`².

        Args:
            frequency_hz: shape (n,), Hz.
            step_s: between samples, s.
        """
        lags = np.arange(1, self.weights.size + 1)
        response = 1.0 - np.exp(-2j * np.pi * step_s * np.outer(frequency_hz, lags)) @ self.weights
        found: Array = self.innovation_sd_f0**2 * step_s / np.abs(response) ** 2
        return found

    def at_lags(self, lags_s: Array, step_s: float) -> Array:
        """See `model.Member`."""
        lags = lags_s / step_s
        gamma = self.autocovariance(int(np.ceil(lags[-1] - 1e-6)) + 1)
        return np.interp(lags, np.arange(gamma.size), gamma)

    def times(self, factor: float) -> Regression:
        """See `model.Member`."""
        return self._replace(innovation_sd_f0=self.innovation_sd_f0 * factor, sd_f0=self.sd_f0 * factor)


SILENCE = Regression(np.zeros(1), LEAST_SD_F0, LEAST_SD_F0, np.array([1.0, 0.0]))


class OrnsteinUhlenbeck(NamedTuple):
    """An Ornstein-Uhlenbeck process with white noise on top, at whatever times it is sampled.

    Attributes:
        sd_f0: standard deviation of both together, F0.
        share: of the variance that is the process's; the rest is white.
        tau_s: within which its autocorrelation decays, s.
    """

    sd_f0: float
    share: float
    tau_s: float

    def draw(self, time_s: Array, factor: Array, random: np.random.Generator) -> Array:
        """See `model.Member`."""
        process, white = random.standard_normal((2, time_s.size, factor.size))
        process[1:] *= np.sqrt(-np.expm1(-2.0 * np.diff(time_s) / self.tau_s))[:, None]
        process = recursion(time_s, process, self.tau_s)
        both = np.sqrt(self.share) * process + np.sqrt(1.0 - self.share) * white
        out: Array = (self.sd_f0 * factor)[:, None] * both.T
        return out

    def variance_of_mean(self, time_s: Array) -> float:
        """See `model.Member`."""
        earlier = float(np.sum(recursion(time_s, np.ones(time_s.size), self.tau_s) - 1.0))
        return self.sd_f0**2 * (1.0 + 2.0 * self.share * earlier / time_s.size)

    def at_lags(self, lags_s: Array, step_s: float) -> Array:
        """See `model.Member`."""
        decaying: Array = self.share * np.exp(-lags_s / self.tau_s) + (1.0 - self.share) * (lags_s == 0.0)
        return self.sd_f0**2 * decaying

    def times(self, factor: float) -> OrnsteinUhlenbeck:
        """See `model.Member`."""
        return self._replace(sd_f0=self.sd_f0 * factor)


def recursion(time_s: Array, given: Array, tau_s: float | Array) -> Array:
    """What is given at each time, and what has not yet decayed of the times before, shape of `given`.

    Args:
        time_s: shape (n,), increasing, s.
        given: shape (n, ...).
        tau_s: time constants, s, of the shape that broadcasts with `given[0]`.
    """
    out = np.array(given, dtype=np.float64)
    tau = np.asarray(tau_s, dtype=np.float64)
    decay = np.exp(-np.diff(time_s).reshape(-1, *(1,) * tau.ndim) / tau)
    for k in range(1, time_s.size):
        out[k] += decay[k - 1] * out[k - 1]
    return out
