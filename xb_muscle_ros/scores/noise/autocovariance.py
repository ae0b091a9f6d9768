"""Autocovariance of evenly sampled noise, from its samples and beyond the lags at which these tell it."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy.linalg import matmul_toeplitz, solve_toeplitz
from scipy.signal import lfilter, lfiltic

Array = npt.NDArray[np.float64]

# Autoregression of this order catches both slow misfit and the hum of 40 to 80 Hz in real recordings at 1 kHz.
ORDER = 6


def sample_autocovariance(residual: Array, order: int) -> Array:
    """Mean product of samples at lags 0 to `order` of the last axis, shape (..., order + 1)."""
    n = residual.shape[-1]
    products = [np.sum(residual[..., : n - k] * residual[..., k:], axis=-1) / n for k in range(order + 1)]
    return np.stack(products, axis=-1)


def yule_walker(sample: Array) -> Array:
    """Weights of the autoregression with this autocovariance; a trace of white noise keeps the equations regular."""
    regular = sample.copy()
    regular[0] *= 1.0 + 1e-6
    weights: Array = solve_toeplitz(regular[:-1], regular[1:])
    return weights


def extended(sample: Array, lags: int) -> Array:
    """Autocovariance at lags 0 to `lags` - 1 of the autoregression that begins with this one, shape (lags,)."""
    if sample[0] <= 0.0 or sample.size >= lags:
        return np.zeros(lags) if sample[0] <= 0.0 else sample[:lags].copy()
    recursion = np.concatenate([[1.0], -yule_walker(sample)])
    begin = lfiltic([1.0], recursion, sample[:0:-1])
    beyond, _ = lfilter([1.0], recursion, np.zeros(lags - sample.size), zi=begin)
    return np.concatenate([sample, beyond])


def autocovariance(residual: Array, lags: int) -> Array:
    """Autocovariance of one trial's residual at lags 0 to `lags` - 1, shape (lags,), by an autoregression."""
    return extended(sample_autocovariance(residual, min(ORDER, residual.size // 10)), lags)


def covariance_of_sums(weights: Array, gamma: Array) -> Array:
    """Covariance of weighted sums over samples of noise, shape (sums, sums).

    Args:
        weights: shape (samples, sums).
        gamma: autocovariance of the noise, shape (samples,).
    """
    found = weights.T @ matmul_toeplitz(gamma, weights)
    symmetric: Array = 0.5 * (found + found.T)
    return symmetric
