"""Passive viscoelasticity: springs that forget, as titin's unfolding domains make them."""

from xb_muscle_ros.mechanisms import Entry, Expr, Extra, Parameter, Quantities, State, Values

_SOURCE = "Minajeva et al. 2001; this package"
STIFFNESS = Parameter("pv_stiffness", "F0/L0", "stiffness of the fastest viscoelastic arm", 0.0, 1e3, 0.0, _SOURCE)
TAU = Parameter("pv_tau", "s", "time constant of the fastest viscoelastic arm", 1e-4, 1e3, 0.1, _SOURCE)
RATIO = Parameter(
    "pv_ratio", "1", "stiffness of an arm over that of the one ten times faster; 0: one arm alone", 0.0, 10.0, 0.0,
    _SOURCE,
)  # fmt: skip
_ARMS = 3


class PassiveViscoelasticity(Extra):
    """Three Maxwell arms, x_i' = v - x_i/tau_i and F = sum of k_i x_i, with tau_i = 10^i tau and k_i = ratio^i k.

    A constant ratio over decades of time is a power law of relaxation, which is what passive muscle shows.
    """

    name = "passive_viscoelasticity"
    parameters = (STIFFNESS, TAU, RATIO)
    states = tuple(State(f"pv_{i}", "L0", "stretch of a viscoelastic arm", -100.0, 100.0) for i in range(_ARMS))
    entry = Entry(
        "parallel_viscoelasticity", "passive viscoelasticity",
        "springs with dashpots beside the cross-bridges; force decays after a stretch",
        "pv_stiffness", 2.0, {"pv_tau": 1.5, "pv_ratio": 0.7},
        tuple({"pv_stiffness": 0.5, "pv_tau": tau, "pv_ratio": 0.3} for tau in (0.005, 0.03, 0.2, 1.0)),
    )  # fmt: skip

    def force(self, q: Quantities) -> Expr:
        return q.pv_stiffness * (q.pv_0 + q.pv_ratio * (q.pv_1 + q.pv_ratio * q.pv_2))

    def derivatives(self, q: Quantities) -> Values:
        stretches = (q.pv_0, q.pv_1, q.pv_2)
        return {f"pv_{i}": q.velocity - x / (10**i * q.pv_tau) for i, x in enumerate(stretches)}
