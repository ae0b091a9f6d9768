"""Exponential series spring."""

from typing import ClassVar

from xb_muscle_ros.mechanisms import Balance, Contractile, Entry, Expr, Parameter, Quantities, Series, State, ops

KSE = Parameter("kse", "1/power stroke", "exponent of the series spring", 1e-4, 100.0, None, "van der Zee et al. 2026")
KSE0 = Parameter(
    "kse0", "1", "force scale of the series spring (cross-bridge force)", 1e-6, 1e3, None, "van der Zee et al. 2026"
)


EXTENSION = State("l_se", "power strokes", "length of the series element beyond slack", -1e5, 1e5)
SMOOTH_STIFFNESS = Parameter(
    "smooth_stiffness", "1",
    "1 where the released set also smoothed the heads' stiffness in the velocity constraint (v3), 0 where not", 0.0,
    1.0, 0.0, "as released",
)  # fmt: skip


class ExponentialSeries(Series):
    """F_xb = kse0 (exp(kse l_se) - 1), with the tangent k_se = kse (F_xb + kse0).

    The velocity follows from the differentiated force balance; the series element's length is computed from the force
    that the heads bear, so that both elements always bear the same force and no drift can build up between them.
    Below zero force the spring goes on with its tangent at rest, as in the released sets.
    """

    name = "exponential"
    parameters: ClassVar[tuple[Parameter, ...]] = (KSE, KSE0, SMOOTH_STIFFNESS)
    length_states = (EXTENSION,)
    entry = Entry(
        "compliance", "series compliance", "a spring in series takes up part of the length change",
        None, shape={"kse": 1.0, "kse0": 1.0}, starts=({"kse": 0.3, "kse0": 0.1}, {"kse": 1.0, "kse0": 0.1}),
        frame=True, name="series_compliance",
    )  # fmt: skip

    def ce_velocity(self, q: Quantities) -> Expr:
        """U = (gamma v k_se - dF_kin)/(dF/dx + k_se)."""
        stiffness = q.kse * (q.positive(q.force_xb) + q.kse0)
        heads = q.stiffness_xb
        if q.smooth:
            heads = heads + q.smooth_stiffness * (q.positive(heads) - heads)
        return (q.gamma * q.velocity * stiffness - q.kinetic_force_rate) / (heads + stiffness)

    def extension(self, q: Quantities) -> Expr:
        """Integral of dF/k_se from 0 to the present force."""
        if q.smooth:
            return ops.smooth_series_extension(q.force_xb, q.kse0, q.smoothing) / q.kse
        taut = ops.positive(q.force_xb)
        return ops.log(1 + taut / q.kse0) / q.kse + (q.force_xb - taut) / (q.kse * q.kse0)

    def balance(self, q: Quantities, element: Contractile) -> Balance:
        """The spring's length is a state and its force what the contractile element bears; slack bears none."""
        force = q.kse0 * (ops.exp(q.kse * ops.positive(q.l_se)) - 1)
        velocity = element.velocity_at(force)
        return Balance(force, velocity, q.l_se, {"l_se": q.gamma * q.velocity - velocity})
