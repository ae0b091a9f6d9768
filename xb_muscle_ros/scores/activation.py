"""Activation classes: how hard a fibre works at a pCa, by its isometric force."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.trials.trial import Array

CLASSES = ("passive", "low", "intermediate", "high")
BOUNDS_F0 = (0.05, 0.30, 0.70)
UNKNOWN = -1


def activation_class(isometric_f0: Array) -> npt.NDArray[np.int64]:
    """Index into `CLASSES` for each isometric force, `UNKNOWN` where the force is not known.

    Passive below 5 %, low from 5 to below 30 %, intermediate from 30 to 70 %, high above 70 % of F0
    (van der Zee et al. 2026).

    Args:
        isometric_f0: any shape, F0; NaN where not measured.
    """
    force = np.asarray(isometric_f0, dtype=np.float64)
    low, middle, high = BOUNDS_F0
    level = (force >= low).astype(np.int64) + (force >= middle) + (force > high)
    return np.where(np.isfinite(force), level, UNKNOWN)
