"""Half-sarcomere spread: a stronger and a weaker half-sarcomere in series, which move against each other."""

from xb_muscle_ros.mechanisms import Chain, Entry, Expr, InSeries, Parameter, Quantities, State, Unit, Values

_SOURCE = "Campbell et al. 2011; this package"
SPREAD = Parameter(
    "hs_spread", "1", "strength of half-sarcomeres: one part more, one less than 1", 0.0, 0.6, 0.0, _SOURCE
)
STIFFNESS = Parameter(
    "hs_stiffness", "1/power stroke", "stiffness by which half-sarcomeres keep each other from parting (titin)",
    1e-6, 1.0, 0.01, _SOURCE,
)  # fmt: skip
# Rate at which a difference in force that rounding has left dies away, 1/s.
_RESTORING = 2000.0


class HalfSarcomereSpread(InSeries):
    """Two half-sarcomeres, (1 + s) and (1 - s) as strong, bear one force; titin's stiffness k keeps them together.

    With F_i the force of each, K_i its rate by attachment and detachment, S_i its stiffness and d the difference of
    their lengths, (1 ± s) F_i ± k d/2 are equal at all times, hence the difference of their velocities. The weaker
    one's heads are carried by Gaussian moments, whatever the method of the stronger one.
    """

    name = "half_sarcomere_spread"
    parameters = (SPREAD, STIFFNESS)
    states = (State("hs_difference", "power strokes", "length of the stronger less that of the weaker one", -1e3, 1e3),)
    entry = Entry(
        "heterogeneity", "uneven half-sarcomeres",
        "stronger half-sarcomeres shorten at the cost of weaker ones in series",
        "hs_spread", 0.1, {"hs_stiffness": 1.0},
        tuple({"hs_spread": s, "hs_stiffness": k} for s, k in ((0.03, 0.0005), (0.08, 0.003), (0.1, 0.03))),
        reach=6.0, frame=True,
    )  # fmt: skip

    def apart(self, q: Quantities) -> Expr:
        return q.hs_difference / 2

    def chain(self, q: Quantities, own: Unit, other: Unit) -> Chain:
        strong, weak = 1 + q.hs_spread, 1 - q.hs_spread
        tie = q.hs_stiffness * q.hs_difference / 2
        force_a, force_b = strong * own.force + tie, weak * other.force - tie
        s_a, s_b = strong * own.stiffness, weak * other.stiffness
        k_a, k_b = strong * own.force_rate, weak * other.force_rate
        apart = s_a + s_b + 2 * q.hs_stiffness
        unequal = k_a - k_b + _RESTORING * (force_a - force_b)

        def half_difference(velocity: Expr) -> Expr:
            return -((s_a - s_b) * velocity + unequal) / apart

        def derivatives(velocity: Expr) -> Values:
            return {"hs_difference": 2 * half_difference(velocity)}

        return Chain(
            force=(force_a + force_b) / 2,
            force_rate=(k_a + k_b - (s_a - s_b) * unequal / apart) / 2,
            stiffness=(s_a + s_b - (s_a - s_b) ** 2 / apart) / 2,
            own_velocity=lambda velocity: velocity + half_difference(velocity),
            other_velocity=lambda velocity: velocity - half_difference(velocity),
            derivatives=derivatives,
        )
