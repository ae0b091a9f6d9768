"""Residual force enhancement: what an active stretch leaves behind, beside the isometric force at the final length."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from xb_muscle_ros.scores.estimate import Estimate, Missing, quotient, rounded
from xb_muscle_ros.scores.standard_error import ForceNoise
from xb_muscle_ros.trials.trial import Array

AFTER_S = 3.0
WINDOW_S = 0.1


class Enhancement(NamedTuple):
    """Forces at one time after the end of the stretch.

    Standard errors are those of the noise; what the muscle itself does otherwise from one trial to the next is not in
    them. None for simulated forces.

    Attributes:
        stretched_f0, isometric_f0: forces of the two trials, means over the window, F0.
        enhancement_f0: their difference, F0.
        relative: difference over the isometric force; None where that is not above its standard error.
        enhancement_se_f0, relative_se: standard errors of these; None where not known.
    """

    stretched_f0: float
    isometric_f0: float
    enhancement_f0: float
    relative: float | None
    enhancement_se_f0: float | None = None
    relative_se: float | None = None


class Side(NamedTuple):
    """One of the two trials that are compared.

    Attributes:
        time_s, force_f0: shape (n,), s and F0.
        noise: of the force; None where it is simulated or its noise not known.
    """

    time_s: Array
    force_f0: Array
    noise: ForceNoise | None = None


def enhancement(stretched: Side, isometric: Side, at_s: float) -> Enhancement | Missing:
    """Residual force enhancement (Herzog and Leonard 2002) at a time of both trials' clock.

    Args:
        stretched: trial that was stretched while active.
        isometric: trial at the final length throughout, activated at the same time.
        at_s: middle of the window of 0.1 s whose means are compared, s.
    """
    a, b = (_mean_about(side, at_s) for side in (stretched, isometric))
    if a.value is None or b.value is None:
        which = "stretched" if a.value is None else "isometric"
        return Missing(f"the {which} trial has no force within {0.5 * WINDOW_S:g} s of {at_s:.4g} s")
    over = quotient(a, b)
    difference = a.value - b.value
    relative = None if over.value is None else difference / b.value
    se = None if a.se is None or b.se is None else rounded(math.hypot(a.se, b.se))
    # The relative enhancement is the quotient of the forces less one, with the same error.
    return Enhancement(a.value, b.value, difference, relative, se, over.se)


def _mean_about(side: Side, at_s: float) -> Estimate:
    inside = np.abs(side.time_s - at_s) <= 0.5 * WINDOW_S + 5e-10
    if not np.any(inside):
        return Estimate(None)
    se = None if side.noise is None else side.noise.of_mean(side.time_s[inside])
    return Estimate(float(np.mean(side.force_f0[inside])), se)
