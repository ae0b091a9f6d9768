"""Standard errors of relative SRS that are pooled over pCa."""

from __future__ import annotations

import numpy as np

from xb_muscle_ros.evaluate.srs_table import SrsTable
from xb_muscle_ros.scores.activation import CLASSES
from xb_muscle_ros.scores.relative import ByClass
from xb_muscle_ros.trials.trial import Array


def pooled_error(table: SrsTable, fibre: str, kind: str, pooled: ByClass) -> Array:
    """Of a fibre's mean SRS of a class over its mean unconditioned SRS, to first order.

    Args:
        table: that has the fibre.
        fibre, kind: see `SrsTable.unconditioned`.
        pooled: the fibre by activation class.

    Returns:
        shape (classes, recovery, amplitude); NaN where an error is not known.
    """
    held = table.fibres[fibre]
    out = np.full(pooled.test.shape, np.nan)
    if held.test_se is None:
        return out
    unconditioned, below = table.unconditioned(fibre, kind)
    used = np.isfinite(held.test) & np.isfinite(unconditioned)[:, None, None]
    used &= table.sound(fibre, kind)
    classes = table.classes(fibre)
    for level in range(len(CLASSES)):
        here = used & (classes == level)[:, None, None]
        count = np.maximum(here.sum(axis=0), 1)
        of_test = np.sqrt(np.where(here, held.test_se**2, 0.0).sum(axis=0)) / count
        of_below = np.sqrt(np.where(here, below[:, None, None] ** 2, 0.0).sum(axis=0)) / count
        divisor = np.where(here.any(axis=0) & (pooled.unconditioned[level] != 0.0), pooled.unconditioned[level], np.nan)
        out[level] = np.hypot(of_test, of_below * pooled.test[level] / divisor) / np.abs(divisor)
    return out
