"""How large differences between model and data are, and over how many samples one goes on into the next.

A residual of a muscle's force is anything but white: its samples resemble each other over tens of milliseconds, so that
a trial of 400 samples tells as much as ten independent ones would. Intervals that forget it are several times too
narrow.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.linalg import matmul_toeplitz, solve_toeplitz

Array = npt.NDArray[np.float64]

# Autoregression of this order catches both slow misfit and the hum of 40 to 80 Hz in real recordings at 1 kHz.
_ORDER = 6
# Far finer than any sampling of the noise matters; also where no noise was added at all.
_LEAST_SD_F0 = 1e-5


class Scale(NamedTuple):
    """Size of one standard deviation of the differences.

    Attributes:
        force_sd_f0: root-mean-square of a sample's difference, F0.
        correlation_samples: samples that tell as much as one independent one.
    """

    force_sd_f0: float
    correlation_samples: float


# Before anything is known: 1 % F0, and ten independent samples in a trial of 400.
FIRST = Scale(0.01, 40.0)


def autocovariance(residual: Array, lags: int) -> Array:
    """Autocovariance of one trial's residual at lags 0 to `lags` - 1, shape (lags,), by an autoregression."""
    n = residual.size
    order = min(_ORDER, n // 10)
    sample = np.array([float(residual[: n - k] @ residual[k:]) / n for k in range(order + 1)])
    if sample[0] <= 0.0:
        return np.zeros(lags)
    # A trace of white noise keeps the equations regular where residuals are smoother than the order.
    sample[0] *= 1.0 + 1e-6
    weights = solve_toeplitz(sample[:order], sample[1 : order + 1])
    out = np.zeros(max(lags, order + 1))
    out[: order + 1] = sample
    for k in range(order + 1, lags):
        out[k] = weights @ out[k - order : k][::-1]
    return out[:lags]


def scale_of(residuals: Sequence[Array], moved: int) -> Scale:
    """Scale of the differences that a fit left.

    Args:
        residuals: of each trial, F0.
        moved: how many coordinates the fit had to make them small.
    """
    total = sum(float(r @ r) for r in residuals)
    samples = sum(r.size for r in residuals)
    lengths = []
    for r in residuals:
        gamma = autocovariance(r, r.size)
        if gamma[0] > 0.0:
            # Sum of correlations within a trial, each lag as often as it occurs in it.
            share = 1.0 - np.arange(r.size) / r.size
            length = 2.0 * float(share @ gamma) / float(gamma[0]) - 1.0
            lengths.append((min(max(length, 1.0), 0.5 * r.size), float(r @ r)))
    if not lengths:
        return Scale(_LEAST_SD_F0, 1.0)
    # Trials with large residuals say how they hang together.
    correlation = float(np.average([x for x, _ in lengths], weights=[w for _, w in lengths]))
    independent = samples / correlation
    # What fitting took away; never more than it can have taken with a few independent samples left.
    left = max(1.0 - moved / independent, 0.1)
    return Scale(max(float(np.sqrt(total / samples / left)), _LEAST_SD_F0), correlation)


def score_covariance(slopes: Sequence[Array], residuals: Sequence[Array], p: int) -> Array:
    """Covariance of the sum of slope times residual over samples, shape (coordinates, coordinates).

    Args:
        slopes: of each trial, shape (samples, coordinates).
        residuals: of each trial, shape (samples,): their autocovariance is taken for that of the noise.
        p: number of coordinates.
    """
    total = np.zeros((p, p))
    for j, r in zip(slopes, residuals, strict=True):
        gamma = autocovariance(r, r.size)
        total += j.T @ matmul_toeplitz(gamma, j)
    symmetric: Array = 0.5 * (total + total.T)
    return symmetric
