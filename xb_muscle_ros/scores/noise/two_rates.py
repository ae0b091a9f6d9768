"""Noise of force that is sampled fast: slow noise from means of neighbours, fast noise from the samples themselves.

An autoregression of six samples at 20 kHz looks back 0.3 ms, and a thousand samples are 50 ms: of noise that fades in
20 ms they tell next to nothing. Means of a millisecond over a second of quiet time do. Below a quarter of their rate
the spectrum is that of the means' autoregressions, above it that of the samples'.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from xb_muscle_ros.scores.noise.members import Regression
from xb_muscle_ros.scores.noise.model import TrialNoise
from xb_muscle_ros.scores.noise.trials import by_windows
from xb_muscle_ros.scores.noise.windows import MOST, Window
from xb_muscle_ros.trials.hum import Line, hum
from xb_muscle_ros.trials.trial import Array

# Means are of as many samples as come within this, s, where these are two at least.
MEAN_S = 1e-3
# So many means overrule the expectation of persistent noise where noise is white; a shorter window has shorter means.
_LEAST_MEANS = 200
# Part of the means' rate at which one spectrum takes over from the other, and how far below and above that it does.
_CROSSING, _WIDTH = 0.25, 1.5
# Points of the spectrum; its lags go to half of that.
_POINTS = 1 << 14


def in_a_mean(step_s: float) -> int:
    """How many samples a mean is of; 1 where samples are not fast."""
    return max(int(MEAN_S / step_s + 1e-6), 1)


class TwoRates(NamedTuple):
    """Noise of one trial.

    Attributes:
        slow: of means over so many samples, hum aside.
        averaged: samples in a mean.
        step_s: between samples, s.
        lines: hum.
        beside: see `_beside`.
    """

    slow: TrialNoise
    averaged: int
    step_s: float
    lines: tuple[Line, ...]
    beside: Array

    def autocovariance(self, lags_s: Array) -> Array:
        """At lags (s, ascending), without hum, F0², shape (n,)."""
        mean_step_s = self.averaged * self.step_s
        total = np.zeros(lags_s.size)
        for each in self.slow.members:
            total += each.at_lags(lags_s, mean_step_s)
        total *= certain(self.slow) / len(self.slow.members)
        total += np.interp(lags_s / self.step_s, np.arange(self.beside.size), self.beside, right=0.0)
        return total


def two_rates(window: Window) -> TwoRates | None:
    """Noise of a trial whose force is sampled fast; None where it is not, or the window is short."""
    if window.force_f0.size < 2 * _LEAST_MEANS:
        return None
    count = min(in_a_mean(window.step_s), window.force_f0.size // _LEAST_MEANS)
    if count < 2:
        return None
    force = window.force_f0[window.force_f0.size % count :]
    lines, rest = hum(count * window.step_s, force.reshape(-1, count).mean(axis=1))
    slow = by_windows([Window(window.trial, count * window.step_s, rest)])[window.trial]
    fast = by_windows([window._replace(force_f0=force[-MOST:])])[window.trial]
    return TwoRates(slow, count, window.step_s, lines, _beside(slow, fast, window.step_s, count * window.step_s))


def _beside(slow: TrialNoise, fast: TrialNoise, step_s: float, mean_step_s: float) -> Array:
    """What samples have beside the means' autocovariance, straight between its lags; at lags of a step, F0²."""
    frequency_hz = np.fft.rfftfreq(_POINTS, step_s)
    below = _spectrum(slow, frequency_hz, mean_step_s)
    straight = below * np.sinc(frequency_hz * mean_step_s) ** 2
    # From all of the one to all of the other.
    octaves = np.log(np.maximum(frequency_hz, 1e-9) * mean_step_s / _CROSSING) / np.log(_WIDTH)
    share = np.sin(0.25 * np.pi * (np.clip(octaves, -1.0, 1.0) + 1.0)) ** 2
    above = np.maximum(_spectrum(fast, frequency_hz, step_s), straight)
    beside: Array = np.fft.irfft((1.0 - share) * below + share * above - straight)[: _POINTS // 2] / step_s
    return beside


def certain(noise: TrialNoise) -> float:
    """What the variance of noise is multiplied by, as its size is an estimate of so many degrees of freedom."""
    return noise.freedom / max(noise.freedom - 2.0, 1.0)


def _spectrum(noise: TrialNoise, frequency_hz: Array, step_s: float) -> Array:
    members = [member.spectrum(frequency_hz, step_s) for member in noise.members if isinstance(member, Regression)]
    found: Array = certain(noise) * np.mean(members, axis=0)
    return found
