"""Viscous drag: a force proportional to the fibre's velocity."""

from __future__ import annotations

from xb_muscle_ros.mechanisms.base import Parameter, Quantities
from xb_muscle_ros.mechanisms.extra import Extra
from xb_muscle_ros.mechanisms.ops import Expr

DRAG = Parameter("drag", "F0 s/L0", "viscous drag of the fibre", 0.0, 10.0, 0.0, "Ford, Huxley and Simmons 1977")


class ViscousDrag(Extra):
    """F = drag v."""

    name = "viscous_drag"
    parameters = (DRAG,)

    def force(self, q: Quantities) -> Expr:
        """See the class."""
        return q.drag * q.velocity
