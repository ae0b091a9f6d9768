"""Non-linear cross-bridges: a head's force bends away from its strain."""

from xb_muscle_ros.mechanisms import Entry, Expr, Extra, Moments, Needs, Parameter, Quantities

CURVATURE = Parameter(
    "head_curvature", "1", "curvature of a head's force over strain: stiffer stretched, softer compressed", -0.3, 0.5,
    0.0, "Kaya and Higuchi 2010; this package",
)  # fmt: skip


class NonlinearCrossbridge(Extra):
    """A head at strain x bears (1 + x) + epsilon (1 + x)²; all heads Q0 + Q1 + epsilon (Q0 + 2 Q1 + Q2).

    Where quick shortening takes heads past the turning point of that parabola, x = -1 - 1/(2 epsilon), they have no
    stiffness left; the velocity of the contractile element counts it as 0 there, not as less.
    """

    name = "nonlinear_crossbridge"
    needs = Needs.HEADS
    parameters = (CURVATURE,)
    entry = Entry(
        "heads_under_strain", "non-linear cross-bridges",
        "the stiffness of a head changes with how far it is stretched",
        "head_curvature", 0.1, starts=({"head_curvature": 0.05},), reach=5.0,
    )  # fmt: skip

    def head_force(self, q: Quantities, m: Moments) -> Expr:
        return q.head_curvature * (m.m0 + 2 * m.m1 + m.m2)
