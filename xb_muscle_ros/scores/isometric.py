"""Isometric force before anything happens to the fibre."""

from __future__ import annotations

import numpy as np

from xb_muscle_ros.trials.phases import initial_isometric
from xb_muscle_ros.trials.trial import Array, Phase


def isometric_force(time_s: Array, force_f0: Array, phases: tuple[Phase, ...]) -> float | None:
    """Mean force (F0) of the isometric phase that begins a trial, without its last fifth.

    Args:
        time_s, force_f0: shape (n,), s and F0.
        phases: of the trial.

    Returns:
        None where the trial does not begin isometrically.
    """
    held = force_f0[initial_isometric(time_s, phases)]
    return float(np.mean(held)) if held.size else None
