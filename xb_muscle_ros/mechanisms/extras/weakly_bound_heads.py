"""Weakly bound heads: a population that attaches and detaches fast and resists movement while it is attached."""

from __future__ import annotations

from collections.abc import Mapping

from xb_muscle_ros.mechanisms.base import Parameter, Quantities, State
from xb_muscle_ros.mechanisms.extra import Extra, Needs
from xb_muscle_ros.mechanisms.ops import Expr

_SOURCE = "Brenner et al. 1982; this package"
STIFFNESS = Parameter(
    "weak_stiffness", "F0/L0", "stiffness of weakly bound heads at all sites available", 0.0, 1e4, 0.0, _SOURCE
)
DETACHMENT = Parameter("weak_detachment", "1/s", "rate at which weakly bound heads let go", 1.0, 1e5, 1e3, _SOURCE)


class WeaklyBoundHeads(Extra):
    """x' = k N u - lambda x beside the other heads: a spring for as long as a head stays, N of them, moved at u.

    Like the others they pull on the series element; without one u is the fibre's velocity.
    """

    name = "weakly_bound_heads"
    needs = Needs.HEADS
    parameters = (STIFFNESS, DETACHMENT)
    states = (State("weak_force", "F0", "force of weakly bound heads", -1e3, 1e3),)

    def inner_force(self, q: Quantities) -> Expr:
        """See the class."""
        return q.weak_force / q.Fscale

    def inner_kinetics(self, q: Quantities) -> tuple[Expr, Expr]:
        """See the class."""
        return -q.weak_detachment * q.weak_force / q.Fscale, self._stiffness(q) / q.Fscale

    def derivatives(self, q: Quantities) -> Mapping[str, Expr]:
        """See the class."""
        return {"weak_force": self._stiffness(q) * q.ce_velocity - q.weak_detachment * q.weak_force}

    def _stiffness(self, q: Quantities) -> Expr:
        """F0 per power stroke."""
        return q.weak_stiffness * q.available_sites / q.gamma
