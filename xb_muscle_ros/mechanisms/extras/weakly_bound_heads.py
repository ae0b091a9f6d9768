"""Weakly bound heads: a population that attaches and detaches fast and resists movement while it is attached."""

from xb_muscle_ros.mechanisms import Entry, Expr, Extra, Needs, Parameter, Quantities, State, Values

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
    entry = Entry(
        "weak_binding", "weakly bound heads",
        "heads that bind and let go quickly and hold for a moment when the fibre is stretched",
        "weak_stiffness", 20.0, {"weak_detachment": 1.0},
        tuple({"weak_stiffness": 0.02 * rate, "weak_detachment": rate} for rate in (100.0, 400.0, 1500.0)),
        reach=100.0,
    )  # fmt: skip

    def inner_force(self, q: Quantities) -> Expr:
        return q.weak_force / q.Fscale

    def inner_kinetics(self, q: Quantities) -> tuple[Expr, Expr]:
        return -q.weak_detachment * q.weak_force / q.Fscale, self._stiffness(q) / q.Fscale

    def derivatives(self, q: Quantities) -> Values:
        return {"weak_force": self._stiffness(q) * q.ce_velocity - q.weak_detachment * q.weak_force}

    def _stiffness(self, q: Quantities) -> Expr:
        """F0 per power stroke."""
        return q.weak_stiffness * q.available_sites / q.gamma
