"""Friction that bound heads make: elastic for a short way, then filaments slide at a constant force."""

from __future__ import annotations

from collections.abc import Mapping

from xb_muscle_ros.mechanisms.base import Parameter, Quantities, State
from xb_muscle_ros.mechanisms.extra import Extra, Needs
from xb_muscle_ros.mechanisms.ops import Expr

_SOURCE = "Brunello et al. 2007 (PNAS 104:20114), second heads that resist stretch; Bouc-Wen form: this package"
FORCE = Parameter("friction_force", "F0", "friction if all heads were bound", 0.0, 10.0, 0.0, _SOURCE)
WAY = Parameter("friction_way", "L0", "length change after which it slides", 1e-5, 1.0, 0.01, _SOURCE)
RELEASE = Parameter("friction_release", "1/s", "rate at which held friction lets go at rest", 0.0, 1e4, 10.0, _SOURCE)


class FilamentFriction(Extra):
    """F = A Q0 y with y' = (v - (|v| y³ + v y⁴)/2)/d - release y, Q0 the bound heads.

    y follows length as a spring does, up to 1 at d or so in stretch and down to -1 in shortening, whatever the
    velocity: a drag grows with velocity, this one does not. Second heads of bound myosins that hold on at once and slip
    to the next site do this; so would any bond that lets go after a short way. By measured force (rat soleus) it scales
    with bound heads; in proportion to available sites it explains less.
    """

    name = "filament_friction"
    needs = Needs.HEADS
    parameters = (FORCE, WAY, RELEASE)
    states = (State("friction", "1", "friction over its largest value", -10.0, 10.0),)

    def force(self, q: Quantities) -> Expr:
        """See the class."""
        return q.friction_force * q.q0 * q.friction

    def derivatives(self, q: Quantities) -> Mapping[str, Expr]:
        """See the class."""
        v, y = q.velocity, q.friction
        speed = q.positive(v) + q.positive(-v)
        return {"friction": (v - (speed * y**3 + v * y**4) / 2) / q.friction_way - q.friction_release * y}
