"""Noise behind the residual of a fit: what the fit took of it is known from its slopes, and given back.

A residual of a muscle's force is anything but white: its samples resemble each other over tens of milliseconds, so that
a trial of 400 samples tells as much as ten independent ones would, and a fit takes most of its slow part away. So the
noise is an Ornstein-Uhlenbeck process with white noise, of one autocorrelation in all trials and a scale of its own in
each, and its likelihood that of the residual with the fit's coordinates integrated out (restricted likelihood, the
priors as they are). The autocorrelation is averaged over a grid,
that of `ornstein_uhlenbeck` first and then a finer one over what that leaves possible.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from xb_muscle_ros.scores.noise.members import recursion
from xb_muscle_ros.scores.noise.ornstein_uhlenbeck import SHARES, TAUS_S, Whitened, log_prior
from xb_muscle_ros.trials.trial import Array

# No recording is better known, nor is a model, F0: a third of the least noise of a measured fibre. It keeps intervals
# from being absurdly narrow where trials are simulated ones without noise.
LEAST_SD_F0 = 1e-4
# Rounds in which scales and what the fit took of each trial settle, on the grid and on the finer one.
_ROUNDS, _FINE_ROUNDS = 3, 4
# Points of the grid with less of the probability than this are left out.
_IMPROBABLE = 1e-6
# A process that decays within more than this share of a trial cannot be separated from a drift there.
_SLOWEST = 0.25
# A trial has this share of its samples left beside the fit at least.
_LEAST_LEFT = 0.1
# What neither data nor priors tell stays where it is: so little is added to the curvature, as a share of the largest.
_UNSEEN = 1e-9
# The finer grid: points along each axis, to so many standard deviations, and this far in logarithms at least.
_FINE, _WIDTH_SDS, _LEAST_WIDTH = 7, 2.5, 1.0


class ResidualNoise(NamedTuple):
    """Noise of the trials that were fitted.

    Attributes:
        times_s: of the samples of each trial, s.
        taus_s, shares: time constants and shares of the process that are possible, shape (points,), s.
        probability: of the points, shape (points,).
        variances_f0: of each trial at each point, F0², shape (trials, points).
    """

    times_s: tuple[Array, ...]
    taus_s: Array
    shares: Array
    probability: Array
    variances_f0: Array

    @property
    def variance_f0(self) -> Array:
        """Of each trial, F0², shape (trials,)."""
        return self.variances_f0 @ self.probability

    def covariance_of_sums(self, trial: int, weights: Array) -> Array:
        """Covariance of weighted sums over a trial's samples of its noise, shape (sums, sums).

        Args:
            weights: shape (samples, sums).
        """
        plain = weights.T @ weights
        at_points = self.probability * self.variances_f0[trial]
        total = float(np.sum(at_points * (1.0 - self.shares))) * plain
        for tau_s in np.unique(self.taus_s):
            of_tau = float(np.sum((at_points * self.shares)[tau_s == self.taus_s]))
            if of_tau > 0.0:
                earlier = weights.T @ recursion(self.times_s[trial], weights, tau_s)
                total += of_tau * (earlier + earlier.T - plain)
        return 0.5 * (total + total.T)

    def autocorrelation_samples(self, trial: int) -> float:
        """Integrated autocorrelation time of a trial, in samples: so many tell as much as one independent one."""
        n = self.times_s[trial].size
        of_sum = float(self.covariance_of_sums(trial, np.ones((n, 1)))[0, 0])
        return of_sum / n / float(self.variance_f0[trial])

    def around(self) -> tuple[Array, Array]:
        """Time constants (s) and shares of a finer grid over what is possible, shape (points,) each.

        Even in the logarithms of the time constant and of what the process adds in a second, in units of white noise:
        the latter shows in neighbouring samples, and is known best.
        """
        log_tau, log_rate = np.log(self.taus_s), np.log(self.shares / (1.0 - self.shares) / self.taus_s)
        axes = []
        for values in (log_tau, log_rate):
            mean = float(self.probability @ values)
            sd = float(np.sqrt(self.probability @ (values - mean) ** 2))
            axes.append(mean + max(_WIDTH_SDS * sd, _LEAST_WIDTH) * np.linspace(-1.0, 1.0, _FINE))
        tau, rate = (np.exp(grid.ravel()) for grid in np.meshgrid(*axes, indexing="ij"))
        return tau, rate * tau / (1.0 + rate * tau)


class _Trials(NamedTuple):
    """Trials of a fit, in units in which every coordinate has as much effect."""

    times_s: tuple[Array, ...]
    residuals_f0: Sequence[Array]
    slopes: Sequence[Array]
    information: Array
    pull: Array

    def noise(self, taus_s: Array, shares: Array, rounds: int) -> ResidualNoise:
        """The noise with these time constants and shares of the process."""
        count = self.pull.size
        # Of most artefacts of the measurement each trial has its own.
        own = [np.flatnonzero(np.any(j != 0.0, axis=0)) for j in self.slopes]
        data = zip(self.times_s, self.residuals_f0, self.slopes, own, strict=True)
        parts = [Whitened(t, r, j[:, o], taus_s, shares) for t, r, j, o in data]
        mean_squares = np.array([max(float(np.mean(r**2)), LEAST_SD_F0**2) for r in self.residuals_f0])
        variances = np.repeat(mean_squares.reshape(-1, 1), taus_s.size, axis=1)
        log = log_prior(taus_s)
        for _ in range(rounds):
            curvature = np.tile(self.information, (taus_s.size, 1, 1))
            score = np.tile(-self.pull, (taus_s.size, 1))
            for o, part, variance in zip(own, parts, variances, strict=True):
                curvature[:, o[:, None], o] += part.products[:, 1:, 1:] / variance[:, None, None]
                score[:, o] += part.products[:, 1:, 0] / variance[:, None]
            largest = np.max(np.diagonal(curvature, axis1=1, axis2=2), axis=1, initial=0.0)
            inverse = np.linalg.inv(curvature + _UNSEEN * largest[:, None, None] * np.eye(count))
            move = np.einsum("kij,kj->ki", inverse, score)
            log = log_prior(taus_s) + 0.5 * (np.sum(score * move, axis=1) + np.linalg.slogdet(inverse)[1])
            for i, (o, part) in enumerate(zip(own, parts, strict=True)):
                of_values, across, gram = part.products[:, 0, 0], part.products[:, 0, 1:], part.products[:, 1:, 1:]
                log = log - 0.5 * (part.samples * np.log(variances[i]) + part.log + of_values / variances[i])
                step = move[:, o]
                residual = of_values - np.sum(step * (2.0 * across - np.einsum("kij,kj->ki", gram, step)), axis=1)
                taken = np.sum(inverse[:, o[:, None], o] * gram, axis=(1, 2)) / variances[i]
                freedom = np.maximum(part.samples - taken, _LEAST_LEFT * part.samples)
                variances[i] = np.maximum(residual / freedom, LEAST_SD_F0**2)
        probability = np.exp(log - log.max())
        probability = np.where(probability > _IMPROBABLE * probability.sum(), probability, 0.0)
        return ResidualNoise(self.times_s, taus_s, shares, probability / probability.sum(), variances)


def residual_noise(
    times_s: Sequence[Array],
    residuals_f0: Sequence[Array],
    slopes: Sequence[Array],
    information: Array,
    pull: Array | None = None,
) -> ResidualNoise:
    """Noise of trials from the residual that a fit left of them.

    Args:
        times_s: of the samples of each trial, increasing, s.
        residuals_f0: measured less fitted force of each trial, F0.
        slopes: of the fitted force of each trial by the coordinates, shape (samples, coordinates) each, F0.
        information: of the priors, and of what else was fitted, shape (coordinates, coordinates).
        pull: gradient of their part of the cost where the fit ended, shape (coordinates,); None: nothing pulls.
    """
    squares = sum((np.sum(j**2, axis=0) for j in slopes), np.diag(information))
    scale = 1.0 / np.sqrt(np.maximum(squares, 1e-300))
    trials = _Trials(
        tuple(times_s),
        residuals_f0,
        [j * scale for j in slopes],
        information * scale * scale[:, None],
        np.zeros(scale.size) if pull is None else pull * scale,
    )
    slowest_s = max([float(TAUS_S.min()), *(_SLOWEST * float(t[-1] - t[0]) for t in times_s)])
    offered = np.flatnonzero(slowest_s >= TAUS_S)
    taus_s, shares = trials.noise(TAUS_S[offered], SHARES[offered], _ROUNDS).around()
    return trials.noise(np.minimum(taus_s, slowest_s), shares, _FINE_ROUNDS)
