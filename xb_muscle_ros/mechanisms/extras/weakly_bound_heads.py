"""Weakly bound heads: a population that attaches and detaches fast and resists movement while it is attached."""

from __future__ import annotations

from collections.abc import Mapping

from xb_muscle_ros.mechanisms.base import Parameter, Quantities, State
from xb_muscle_ros.mechanisms.extra import Extra
from xb_muscle_ros.mechanisms.ops import Expr

_SOURCE = "Brenner et al. 1982; this package"
STIFFNESS = Parameter(
    "weak_stiffness", "F0/L0", "stiffness of weakly bound heads at all sites available", 0.0, 1e4, 0.0, _SOURCE
)
DETACHMENT = Parameter("weak_detachment", "1/s", "rate at which weakly bound heads let go", 1.0, 1e5, 1e3, _SOURCE)


class WeaklyBoundHeads(Extra):
    """x' = k N v - lambda x and F = x: a spring for as long as a head stays, in proportion to the available sites."""

    name = "weakly_bound_heads"
    parameters = (STIFFNESS, DETACHMENT)
    states = (State("weak_force", "F0", "force of weakly bound heads", -1e3, 1e3),)

    def force(self, q: Quantities) -> Expr:
        """See the class."""
        return q.weak_force

    def derivatives(self, q: Quantities) -> Mapping[str, Expr]:
        """See the class."""
        return {"weak_force": q.weak_stiffness * q.available_sites * q.velocity - q.weak_detachment * q.weak_force}
