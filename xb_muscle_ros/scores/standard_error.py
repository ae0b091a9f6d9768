"""Standard errors of what is read off a measured force.

Samples of force are not independent: hum of the mains and slow noise make neighbours resemble each other. The noise is
taken from the trial's quiet times (`scores.noise`), and the variance of an estimate that is a weighted sum of samples
from the autocovariance there, as Sum w_i w_j gamma(t_i - t_j). It allows for what stays unknown of the noise: gamma is
the mean over the models of noise that the quiet times leave possible. Noise is taken to be the same all through the
trial, and lengths and times to be without error.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from scipy.linalg import matmul_toeplitz

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.scores.estimate import rounded
from xb_muscle_ros.scores.noise.model import Source, TrialNoise
from xb_muscle_ros.scores.noise.pieces import evenly_sampled
from xb_muscle_ros.scores.noise.trials import ENOUGH, by_windows, noise_of, steady_scatter_f0
from xb_muscle_ros.scores.noise.two_rates import certain, in_a_mean, two_rates
from xb_muscle_ros.scores.noise.windows import LEAST, MOST, isometric_window
from xb_muscle_ros.trials.hum import Line, hum
from xb_muscle_ros.trials.trial import Array, Phase, Trial


class ForceNoise:
    """Noise of one trial's measured force."""

    def __init__(self, autocovariance: Callable[[Array], Array], step_s: float, lines: Sequence[Line] = ()) -> None:
        """Noise as it is known.

        Args:
            autocovariance: of the noise, hum aside: at lags in s, ascending, F0², shape (n,).
            step_s: usual time between samples, s.
            lines: the hum.
        """
        self._autocovariance, self._step_s, self._lines = autocovariance, step_s, tuple(lines)

    @classmethod
    def of_models(cls, noise: TrialNoise, step_s: float, lines: Sequence[Line] = ()) -> ForceNoise:
        """By the mean over models of a trial's noise, hum aside."""

        def autocovariance(lags_s: Array) -> Array:
            found = np.zeros(lags_s.size)
            for each in noise.members:  # one by one: a record of an hour has as many lags as samples
                found += each.at_lags(lags_s, step_s)
            return found * (certain(noise) / len(noise.members))

        return cls(autocovariance, step_s, lines)

    def autocovariance(self, time_s: Array) -> Array:
        """At lags of 0, 1, ... of the mean steps between these times, F0², shape (n,)."""
        n = time_s.size
        lags_s = np.arange(n) * (float(time_s[-1] - time_s[0]) / (n - 1) if n > 1 else self._step_s)
        total = self._autocovariance(lags_s)
        for line in self._lines:
            total += line.autocovariance(lags_s)
        return total

    def covariance(self, weights: Array, time_s: Array) -> Array:
        """Covariance of weighted sums of samples, shape (sums, sums).

        Args:
            weights: shape (n, sums).
            time_s: of the samples, shape (n,), s.
        """
        found = weights.T @ matmul_toeplitz(self.autocovariance(time_s), weights)
        return 0.5 * (found + found.T)

    def of_sum(self, weights: Array, time_s: Array) -> float:
        """Standard error of one weighted sum of samples, weights of shape (n,)."""
        return rounded(float(np.sqrt(max(float(self.covariance(weights[:, None], time_s)[0, 0]), 0.0))))

    def of_mean(self, time_s: Array) -> float:
        """Standard error of the mean of samples at these times, F0."""
        return self.of_sum(np.full(time_s.size, 1.0 / time_s.size), time_s)


def force_noise(trial: Trial) -> ForceNoise | None:
    """Noise of a trial's measured force; None where it never holds still, or moves steadily, for long enough."""
    if trial.force_time_s.size < 2:
        return None
    name, step_s = trial.facts.trial, float(np.median(np.diff(trial.force_time_s)))
    if evenly_sampled(trial.force_time_s):
        window = isometric_window(trial, in_a_mean(step_s) * MOST)
        fast = two_rates(window)
        if fast is not None:
            return ForceNoise(fast.autocovariance, step_s, fast.lines)
        if window.force_f0.size >= LEAST:
            # In fewer samples a line is no sharper than an autoregression.
            enough = window.force_f0.size >= ENOUGH
            lines, rest = hum(window.step_s, window.force_f0) if enough else ((), window.force_f0)
            return ForceNoise.of_models(by_windows([window._replace(force_f0=rest)])[name], step_s, lines)
    try:
        noise = noise_of([trial]).trials[0]
    except UserError:
        return None
    # Differences of neighbours show fast noise alone, and so do few samples, unless some of them are of steady force;
    # an estimate's error depends on the slow.
    few = noise.samples < LEAST and steady_scatter_f0(trial) == 0.0
    unfit = noise.source is Source.DIFFERENCES or few
    return None if unfit else ForceNoise.of_models(noise, step_s)


def noise_between(trial: Trial, from_s: float, to_s: float) -> ForceNoise | None:
    """Noise of a trial's measured force in one part of it, in which the muscle is at rest; None where that is short."""
    inside = (trial.force_time_s >= from_s - 5e-10) & (trial.force_time_s <= to_s + 5e-10)
    if np.count_nonzero(inside) < LEAST:
        return None
    facts = replace(trial.facts, phases=(Phase("isometric", from_s, to_s),))
    part = replace(trial, facts=facts, force_time_s=trial.force_time_s[inside], force_n=trial.force_n[inside])
    return force_noise(part)


def noise_outside(trial: Trial, moving_s: Sequence[tuple[float, float]]) -> ForceNoise | None:
    """Noise of a trial's measured force in the longest time before, between or after those in which length moves.

    Args:
        moving_s: begin and end of each, s, in order.
    """
    if not trial.force_time_s.size:
        return None
    ends = [float(trial.force_time_s[0]), *(end for _, end in moving_s)]
    begins = [*(begin for begin, _ in moving_s), float(trial.force_time_s[-1])]
    return noise_between(trial, *max(zip(ends, begins, strict=True), key=lambda part: part[1] - part[0]))


NO_NOISE_KNOWN = "standard error not known: no quiet time to take the noise from"
