"""Isometric force before anything happens to the fibre: the one definition that all commands share."""

from __future__ import annotations

import numpy as np

from xb_muscle_ros.scores.estimate import Estimate
from xb_muscle_ros.scores.standard_error import ForceNoise
from xb_muscle_ros.scores.steady import steady_part
from xb_muscle_ros.trials.trial import Array, Trial


def isometric_force(trial: Trial, time_s: Array, force_f0: Array, noise: ForceNoise | None = None) -> Estimate:
    """Mean force (F0) over the steady isometric part that a trial begins with.

    Args:
        trial, time_s, force_f0: see `steady_part`.
        noise: of the force; None for simulated force.
    """
    inside, why = steady_part(trial, time_s, force_f0)
    if why:
        return Estimate(None, why=why)
    return Estimate(float(np.mean(force_f0[inside])), None if noise is None else noise.of_mean(time_s[inside]))
