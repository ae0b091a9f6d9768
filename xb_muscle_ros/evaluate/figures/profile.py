"""Relative SRS along activation, amplitude or recovery, for figures."""

from __future__ import annotations

import numpy as np

from xb_muscle_ros.evaluate.srs_scores import READINGS
from xb_muscle_ros.evaluate.srs_table import SrsTable, place
from xb_muscle_ros.scores.conditions import CLASSES, COMMON_AMPLITUDE_L0, COMMON_CLASS, COMMON_RECOVERY_S
from xb_muscle_ros.scores.relative import nanmean, nansd
from xb_muscle_ros.trials.trial import Array

_READING = READINGS["released"]


class Profile:
    """Relative SRS along one axis, one thing varied at a time (reading ``released``).

    Attributes:
        x: isometric force (F0), amplitude (% L0) or recovery time (s), shape (fibres, points).
        y, se: relative SRS and standard errors, NaN where not known, same shape.
    """

    def __init__(self, table: SrsTable, along: str) -> None:
        """Take it from a table; `along` is ``activation``, ``amplitude`` or ``recovery``."""
        pooled = table.pooled(_READING.unconditioned)
        each = np.array([p.test / np.where(p.unconditioned == 0.0, np.nan, p.unconditioned) for p in pooled.values()])
        error = np.array([p.se for p in pooled.values()])
        j, k = place(table.recovery_s, COMMON_RECOVERY_S), place(table.amplitude_l0, COMMON_AMPLITUDE_L0)
        level = CLASSES.index(COMMON_CLASS)
        empty = np.empty((each.shape[0], 0))
        if along == "activation":
            self.y, self.se = (empty if j is None or k is None else of[:, :, j, k] for of in (each, error))
            self.x = np.array([_class_force(table, name) for name in table.fibres])[:, : self.y.shape[1]]
        elif along == "amplitude":
            moved = table.amplitude_l0 > 0.0
            self.y, self.se = (
                empty if j is None or not moved.any() else of[:, level, j, moved] for of in (each, error)
            )
            self.x = 100.0 * table.amplitude_l0[moved]
        else:
            self.y, self.se = (empty if k is None else of[:, level, :, k] for of in (each, error))
            self.x = table.recovery_s
        if self.x.ndim == 1:
            self.x = np.broadcast_to(self.x[: self.y.shape[1]], self.y.shape)

    def means(self) -> tuple[Array, Array, Array]:
        """x, y and s.d. of y over fibres at the points that were tested."""
        y, sd = nanmean(self.y), nansd(self.y)
        some = np.isfinite(y)
        x = nanmean(np.where(np.isfinite(self.y), self.x, np.nan))
        return x[some], y[some], sd[some]


def _class_force(table: SrsTable, fibre: str) -> Array:
    """Mean isometric force of a fibre in each class, F0, shape (classes,)."""
    force, classes = table.isometric_f0(fibre), table.classes(fibre)
    return np.array([nanmean(force[classes == level][:, None])[0] for level in range(len(CLASSES))])
