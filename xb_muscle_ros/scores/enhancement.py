"""Residual force enhancement: what an active stretch leaves behind, beside the isometric force at the final length."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from xb_muscle_ros.trials.trial import Array

AFTER_S = 3.0
WINDOW_S = 0.1


class Enhancement(NamedTuple):
    """Forces at one time after the end of the stretch.

    Attributes:
        stretched_f0, isometric_f0: forces of the two trials, means over the window, F0.
        enhancement_f0: their difference, F0.
        relative: difference over the isometric force; None where that is zero.
    """

    stretched_f0: float
    isometric_f0: float
    enhancement_f0: float
    relative: float | None


def enhancement(
    stretched_time_s: Array, stretched_f0: Array, isometric_time_s: Array, isometric_f0: Array, at_s: float
) -> Enhancement | None:
    """Residual force enhancement (Herzog and Leonard 2002) at a time of both trials' clock.

    Args:
        stretched_time_s, stretched_f0: trial that was stretched while active, shape (n,), s and F0.
        isometric_time_s, isometric_f0: trial at the final length throughout, activated at the same time, shape (m,).
        at_s: middle of the window of 0.1 s whose means are compared, s.

    Returns:
        None where a trial has no sample in the window.
    """
    a = _mean_about(stretched_time_s, stretched_f0, at_s)
    b = _mean_about(isometric_time_s, isometric_f0, at_s)
    if a is None or b is None:
        return None
    return Enhancement(a, b, a - b, (a - b) / b if b else None)


def _mean_about(time_s: Array, force: Array, at_s: float) -> float | None:
    inside = np.abs(time_s - at_s) <= 0.5 * WINDOW_S + 5e-10
    return float(np.mean(force[inside])) if np.any(inside) else None
