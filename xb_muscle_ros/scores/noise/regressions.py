"""Autoregressions of force in evenly sampled parts of a recording, and their restricted likelihood.

It leaves out what a drift of the part could have done, and is, other than sample correlations, hardly biased when a
part of 80 samples holds a few independent ones (Cooper and Thompson, Biometrika 64 (1977) 625-628).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from xb_muscle_ros.scores.noise.model import LEAST_SD_F0
from xb_muscle_ros.trials.trial import Array

ORDER = 6


class Part:
    """An evenly sampled part of a trial, and what its likelihood needs of it.

    Attributes:
        step_s: between samples, s.
        silent: whether there is nothing left beside the drift.
        freedom: samples less what the drift takes.
        empty: ones on the diagonal for columns of drift that there are not, shape (width, width).
        begin: first samples of force and drift, shape (1 + width, order).
        products: of all columns at all lags, shape ((order + 1)², (1 + width)²).
    """

    def __init__(self, step_s: float, force_f0: Array, drift: Array, width: int) -> None:
        """Prepare a part.

        Args:
            step_s: between samples, s.
            force_f0: shape (n,), F0.
            drift: what force may do beside noise, orthonormal, shape (n, columns).
            width: columns that drift has at most, in all parts that are looked at together.
        """
        self.step_s = step_s
        n, count = drift.shape
        residual = force_f0 - drift @ (drift.T @ force_f0)
        self.silent = float(np.sqrt(np.mean(residual**2))) < LEAST_SD_F0
        self.samples, self.freedom = n, float(n - count)
        # Force first, then the columns of drift, the last of them perhaps empty: all are whitened together.
        columns = np.zeros((1 + width, n))
        columns[0], columns[1 : 1 + count] = residual, drift.T
        self.empty = np.diag(np.where(np.arange(width) < count, 0.0, 1.0))
        self.begin = columns[:, :ORDER]
        # Products of all columns at all lags: what is new in the samples is a sum over them, however long the part.
        lagged = np.stack([columns[:, ORDER - k : n - k] for k in range(ORDER + 1)])
        self.products = np.einsum("ict,jdt->ijcd", lagged, lagged, optimize=True).reshape((ORDER + 1) ** 2, -1)


class Regressions(NamedTuple):
    """Autoregressions of order 0, 1, ... of partial correlations, shape (many, ...).

    Attributes:
        filters: row k gives the innovation of sample k, shape (many, order + 1, order + 1); the last row holds
            for all later samples.
        sizes: variance of the innovations, in units of the last, shape (many, order + 1).
    """

    filters: Array
    sizes: Array


def regressions(z: Array) -> Regressions:
    """Of partial correlations tanh(z), shape (many, order), by the recursion of Levinson and Durbin."""
    partial = np.tanh(z)
    filters = np.zeros((z.shape[0], ORDER + 1, ORDER + 1))
    filters[:, 0, 0] = 1.0
    for k in range(1, ORDER + 1):
        last, tanh = filters[:, k - 1, :k], partial[:, k - 1, None]
        filters[:, k, 1 : k + 1] = last
        filters[:, k, :k] -= tanh * last[:, ::-1]
    innovation = np.cumprod(1.0 - partial**2, axis=1)
    sizes = np.concatenate([np.ones((z.shape[0], 1)), innovation], axis=1)
    return Regressions(filters, sizes / sizes[:, -1:])


def squares(parts: Sequence[Part], of: Regressions) -> tuple[Array, Array]:
    """Sums of squared innovations, drift taken out, F0², and log-determinants, shape (many, parts)."""
    width = parts[0].empty.shape[0]
    last = of.filters[:, -1, ::-1]
    pairs = (last[:, :, None] * last[:, None, :]).reshape(last.shape[0], -1)
    products = np.stack([p.products for p in parts])
    gram = np.swapaxes(pairs @ products, 0, 1).reshape(-1, len(parts), 1 + width, 1 + width)
    rows = of.filters[:, :ORDER, :ORDER] / np.sqrt(of.sizes[:, :ORDER, None])
    begin = np.stack([p.begin for p in parts]) @ np.swapaxes(rows, -1, -2)[:, None]
    gram = gram + begin @ np.swapaxes(begin, -1, -2)
    residual, log_drift = restricted(gram, np.stack([p.empty for p in parts]))
    return residual, np.sum(np.log(of.sizes), axis=1)[:, None] + log_drift


def restricted(gram: Array, empty: Array) -> tuple[Array, Array]:
    """Residual sum of squares of whitened force beside whitened drift, and the log-determinant of drift's own.

    Args:
        gram: products of force, first, and drift, shape (..., 1 + width, 1 + width).
        empty: ones on the diagonal for columns of drift that there are not, shape (..., width, width).
    """
    drift, across = gram[..., 1:, 1:], gram[..., 1:, :1]
    trace = np.trace(drift, axis1=-1, axis2=-2)[..., None, None]
    drift = drift + 1e-12 * trace * np.eye(drift.shape[-1]) + empty
    residual = gram[..., 0, 0] - np.sum(across * np.linalg.solve(drift, across), axis=(-1, -2))
    return np.maximum(residual, 1e-300), np.linalg.slogdet(drift)[1]


def correlation(filters: Array) -> Array:
    """Correlation at lags 0 to the order, from the rows of `Regressions`."""
    found = [1.0]
    for k in range(1, ORDER + 1):
        # What is new in sample k has nothing to do with sample 0 (Yule and Walker).
        found.append(-float(filters[k, :k] @ found))
    return np.array(found)
