"""Static stiffness: a spring that calcium, not force, makes stiff."""

from __future__ import annotations

from xb_muscle_ros.mechanisms.base import Parameter, Quantities
from xb_muscle_ros.mechanisms.extra import Extra
from xb_muscle_ros.mechanisms.ops import Expr

_SOURCE = "Bagni et al. 1994; this package"
STIFFNESS = Parameter("calcium_stiffness", "F0/L0", "static stiffness at full calcium", 0.0, 100.0, 0.0, _SOURCE)
HALF = Parameter("stiffness_calcium", "µM", "calcium at which half of it is there", 1e-3, 1e3, 1.0, _SOURCE)
HILL = Parameter("stiffness_hill", "1", "steepness with which calcium makes it", 0.5, 20.0, 2.0, _SOURCE)


class StaticCalciumStiffness(Extra):
    """F = k ΔL/(1 + (Ca_half/Ca)^hill)."""

    name = "static_calcium_stiffness"
    parameters = (STIFFNESS, HALF, HILL)

    def force(self, q: Quantities) -> Expr:
        """See the class."""
        return q.calcium_stiffness * q.length_change / (1 + (q.stiffness_calcium / q.calcium) ** q.stiffness_hill)
