"""Static stiffness: a spring that calcium, not force, makes stiff."""

from __future__ import annotations

from xb_muscle_ros.mechanisms.base import Parameter, Quantities
from xb_muscle_ros.mechanisms.extra import Extra
from xb_muscle_ros.mechanisms.ops import Expr

_SOURCE = "Bagni et al. 1994; this package"
STIFFNESS = Parameter("calcium_stiffness", "F0/L0", "static stiffness at full calcium", 0.0, 100.0, 0.0, _SOURCE)
HALF = Parameter("stiffness_calcium", "µM", "calcium at which half of it is there", 1e-3, 1e3, 1.0, _SOURCE)


class StaticCalciumStiffness(Extra):
    """F = k Ca/(Ca + Ca_half) ΔL."""

    name = "static_calcium_stiffness"
    parameters = (STIFFNESS, HALF)

    def force(self, q: Quantities) -> Expr:
        """See the class."""
        return q.calcium_stiffness * q.calcium / (q.calcium + q.stiffness_calcium) * q.length_change
