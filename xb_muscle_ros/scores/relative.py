"""Relative SRS by activation class, per fibre and over fibres.

Relative SRS is the SRS of the test stretch over that of an unconditioned stretch of the same fibre and class: 1 where
history leaves stiffness as it was, 0 where nothing is left of it.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.scores.conditions import CLASSES
from xb_muscle_ros.trials.trial import Array

AVERAGINGS = ("mean", "mean_of_trials", "median", "ratio_of_means")
"""Ways from fibres to one value; the paper does not say which it took where passive fibres have next to no SRS.

``mean``: per fibre the mean SRS of a class over the mean unconditioned SRS of that class, then the mean over fibres.
``mean_of_trials``: the ratio at each pCa first, then the mean over a fibre's pCa, then over fibres.
``median``: as ``mean``, but the median over fibres. ``ratio_of_means``: the mean SRS over fibres, over the mean
unconditioned SRS over fibres.
"""


class ByClass(NamedTuple):
    """One fibre, its pCa pooled by activation class; NaN where it was not tested.

    Attributes:
        test: mean SRS of test stretches, shape (classes, ...), F0/L0.
        unconditioned: mean SRS of unconditioned stretches of the same pCa, same shape, F0/L0.
        ratio: mean over pCa of the one over the other, same shape.
        se: standard error of `test` over `unconditioned`, to first order, same shape; NaN where it is not known.
    """

    test: Array
    unconditioned: Array
    ratio: Array
    se: Array


class Averaged(NamedTuple):
    """Over fibres; shape (classes, ...), NaN where no fibre was tested.

    Attributes:
        centre: relative SRS.
        sd: standard deviation of the fibres' values (n - 1); NaN for fewer than 2.
        n: fibres.
    """

    centre: Array
    sd: Array
    n: npt.NDArray[np.int64]


def by_class(
    test: Array,
    unconditioned: Array,
    classes: npt.NDArray[np.int64],
    test_se: Array | None = None,
    unconditioned_se: Array | None = None,
) -> ByClass:
    """Pool a fibre's pCa by activation class.

    Args:
        test: shape (pca, ...), SRS of test stretches, F0/L0; NaN where not measured.
        unconditioned: shape (pca,), SRS of the unconditioned stretch at each pCa, F0/L0.
        classes: shape (pca,), see `activation_class`.
        test_se, unconditioned_se: standard errors, shapes as of the values; None or NaN where not known.
    """
    column = (-1, *[1] * (test.ndim - 1))
    below = np.broadcast_to(unconditioned.reshape(column), test.shape)
    both = np.isfinite(test) & np.isfinite(below)
    errors = np.full((2, *test.shape), np.nan)
    if test_se is not None and unconditioned_se is not None:
        errors[0], errors[1] = test_se, unconditioned_se.reshape(column)
    shape = (len(CLASSES), *test.shape[1:])
    pooled = ByClass(*(np.full(shape, np.nan) for _ in ByClass._fields))
    for level in range(len(CLASSES)):
        here = classes == level
        used = np.where(both[here], 1.0, np.nan)
        pooled.test[level] = mean = nanmean(test[here] * used)
        pooled.unconditioned[level] = mean_below = nanmean(below[here] * used)
        pooled.ratio[level] = nanmean(_divided(test[here], below[here]) * used)
        count = np.maximum(np.sum(both[here], axis=0), 1)
        of_test, of_below = np.sqrt(np.where(both[here], errors[:, here] ** 2, 0.0).sum(axis=1)) / count
        divisor = np.where(mean_below != 0.0, mean_below, np.nan)
        pooled.se[level] = np.hypot(of_test, of_below * mean / divisor) / np.abs(divisor)
    return pooled


def over_fibres(fibres: Sequence[ByClass], averaging: str = "mean") -> Averaged:
    """Average relative SRS over fibres.

    Args:
        fibres: at least one, of equal shapes.
        averaging: one of `AVERAGINGS`.
    """
    test = np.array([fibre.test for fibre in fibres])
    unconditioned = np.array([fibre.unconditioned for fibre in fibres])
    each = np.array([f.ratio for f in fibres]) if averaging == "mean_of_trials" else _divided(test, unconditioned)
    n = np.sum(np.isfinite(each), axis=0)
    if averaging == "ratio_of_means":
        centre = _divided(nanmean(test), nanmean(unconditioned))
    elif averaging == "median":
        centre = nanmedian(each)
    else:
        centre = nanmean(each)
    return Averaged(centre, nansd(each), n)


class Rmsd(NamedTuple):
    """Root-mean-square difference (None where nothing is known to both), residual sum of squares, and how many."""

    value: float | None
    rss: float
    n: int


def rmsd(a: Array, b: Array, where: npt.NDArray[np.bool_]) -> Rmsd:
    """Difference over the conditions of a mask that are known to both."""
    known = where & np.isfinite(a) & np.isfinite(b)
    count = int(np.count_nonzero(known))
    rss = float(np.sum((a[known] - b[known]) ** 2))
    return Rmsd(float(np.sqrt(rss / count)) if count else None, rss, count)


def nanmean(values: Array) -> Array:
    """Mean over the first axis without NaN; NaN where nothing is left."""
    return _without_warning(np.nanmean, values)


def nanmedian(values: Array) -> Array:
    """Median over the first axis without NaN; NaN where nothing is left."""
    return _without_warning(np.nanmedian, values)


def nansd(values: Array) -> Array:
    """Standard deviation (n - 1) over the first axis without NaN; NaN for fewer than two values."""
    return _without_warning(np.nanstd, values, ddof=1)


def _without_warning(function: Any, values: Array, **more: int) -> Array:
    """NumPy warns where nothing is left."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        found: Array = function(values, axis=0, **more)
    return found


def _divided(a: Array, b: Array) -> Array:
    """Quotient; NaN where the divisor is zero or either is NaN."""
    whole = np.isfinite(a) & np.isfinite(b) & (b != 0.0)
    quotient: Array = np.where(whole, a, np.nan) / np.where(whole, b, 1.0)
    return quotient
