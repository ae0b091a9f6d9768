"""An elastic tendon between fibre and bone."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

# Tendon force over strain after De Groote et al. (2016), doi 10.1007/s10439-016-1591-9: f = C1·exp(K·(l − C2)) − C3,
# with force f in F0 and length l in slack lengths.
_K, _C1, _C2, _C3 = 35.0, 0.200, 0.995, 0.250


def strain(force_f0: Array) -> Array:
    """Stretch from no force to a force in F0, in slack lengths; the inverse of the curve."""
    found: Array = np.log1p(force_f0 / _C3) / _K
    return found


class Tendon(NamedTuple):
    """Tendon of one muscle.

    Attributes:
        slack_m: length at which it begins to pull.
        rest: length in slack lengths at which it pulls as hard as the muscle does at the start.
    """

    slack_m: float
    rest: float

    def force_f0(self, stretch_m: float) -> float:
        """Pull along the tendon at a stretch beyond that of the start, F0."""
        return _C1 * math.exp(_K * (self.rest + stretch_m / self.slack_m - _C2)) - _C3

    def stiffness_f0_per_m(self, stretch_m: float) -> float:
        """Slope of `force_f0`."""
        return _K * (self.force_f0(stretch_m) + _C3) / self.slack_m


def tendon_at(force_f0: float, slack_m: float) -> Tendon:
    """The tendon that pulls with a force at the start.

    Args:
        force_f0: along the tendon, above -0.25 F0.
        slack_m: slack length.
    """
    return Tendon(slack_m, _C2 + math.log((force_f0 + _C3) / _C1) / _K)
