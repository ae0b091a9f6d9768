"""Models of a trial's noise: autoregressions where it is sampled evenly, fading memory in time where it is not."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.signal import lfilter

from xb_muscle_ros.scores.noise.autocovariance import extended
from xb_muscle_ros.scores.noise.model import LEAST_SD_F0

Array = npt.NDArray[np.float64]

# Samples until drawn noise forgets how it began.
_BURN_IN = 400


class Regression(NamedTuple):
    """One autoregression that may have made a trial's noise.

    Attributes:
        weights: shape (order,).
        fresh_f0: standard deviation of what is new in a sample, F0.
        sd_f0: standard deviation, F0.
        colour: correlation at lags 0, 1, ... samples, shape (order + 1,).
    """

    weights: Array
    fresh_f0: float
    sd_f0: float
    colour: Array

    def draw(self, time_s: Array, factor: Array, random: np.random.Generator) -> Array:
        """See `model.Member`; samples are taken to be a step apart."""
        white = (self.fresh_f0 * factor)[:, None] * random.standard_normal((factor.size, time_s.size + _BURN_IN))
        # Along the last axis, where samples lie side by side: three times as fast.
        out: Array = lfilter([1.0], np.concatenate([[1.0], -self.weights]), white, axis=-1)[:, _BURN_IN:]
        return out

    def variance_of_mean(self, time_s: Array) -> float:
        """See `model.Member`."""
        n = time_s.size
        gamma = self.autocovariance(n)
        return float(2.0 * (1.0 - np.arange(n) / n) @ gamma - gamma[0])

    def autocovariance(self, lags: int) -> Array:
        """At lags 0 to `lags` - 1 samples, shape (lags,), F0²."""
        return extended(self.sd_f0**2 * self.colour, lags)

    def at_lags(self, lags_s: Array, step_s: float) -> Array:
        """See `model.Member`."""
        lags = lags_s / step_s
        gamma = self.autocovariance(int(np.ceil(lags[-1] - 1e-6)) + 1)
        out: Array = np.interp(lags, np.arange(gamma.size), gamma)
        return out

    def times(self, factor: float) -> Regression:
        """See `model.Member`."""
        return self._replace(fresh_f0=self.fresh_f0 * factor, sd_f0=self.sd_f0 * factor)


SILENCE = Regression(np.empty(0), LEAST_SD_F0, LEAST_SD_F0, np.array([1.0, 0.0]))


class Memory(NamedTuple):
    """White noise and noise that fades exponentially in time, at whatever times it is sampled.

    Attributes:
        sd_f0: standard deviation of both together, F0.
        share: of the variance that fades; the rest is white.
        tau_s: within which it fades, s.
    """

    sd_f0: float
    share: float
    tau_s: float

    def draw(self, time_s: Array, factor: Array, random: np.random.Generator) -> Array:
        """See `model.Member`."""
        fading, white = random.standard_normal((2, time_s.size, factor.size))
        kept = self._kept(time_s)
        fresh = np.sqrt(1.0 - kept**2)
        for k in range(1, time_s.size):
            fading[k] = kept[k - 1] * fading[k - 1] + fresh[k - 1] * fading[k]
        both = np.sqrt(self.share) * fading + np.sqrt(1.0 - self.share) * white
        out: Array = (self.sd_f0 * factor)[:, None] * both.T
        return out

    def variance_of_mean(self, time_s: Array) -> float:
        """See `model.Member`."""
        # Sum of a sample's correlations with those before it, one sample after the other.
        before, total = 0.0, 0.0
        for kept in self._kept(time_s):
            before = float(kept) * (before + 1.0)
            total += before
        return self.sd_f0**2 * (1.0 + 2.0 * self.share * total / time_s.size)

    def at_lags(self, lags_s: Array, step_s: float) -> Array:
        """See `model.Member`."""
        fading: Array = self.share * np.exp(-lags_s / self.tau_s) + (1.0 - self.share) * (lags_s == 0.0)
        return self.sd_f0**2 * fading

    def times(self, factor: float) -> Memory:
        """See `model.Member`."""
        return self._replace(sd_f0=self.sd_f0 * factor)

    def _kept(self, time_s: Array) -> Array:
        """Correlation of one sample's fading noise with the next one's, shape (n - 1,)."""
        out: Array = np.exp(-np.diff(time_s) / self.tau_s)
        return out
