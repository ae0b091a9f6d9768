"""Exponential series spring that goes slack: a tension element, which does not push."""

from xb_muscle_ros.mechanisms import Expr, Quantities, Values, ops
from xb_muscle_ros.mechanisms.series.exponential import EXTENSION, KSE, KSE0, ExponentialSeries

# Rate at which a difference between spring and heads that rounding has left dies away, 1/s.
_RESTORING = 200.0


class SlackSeries(ExponentialSeries):
    """F_xb = kse0 (exp(kse l_se) - 1) where the spring is taut, l_se > 0; nothing below, where it is slack.

    While the spring is slack the heads bear no force between them and the contractile element shortens as fast as it
    can, unloaded. Force says nothing of how slack the spring is, so that its length is a state, and the force of the
    fibre is the spring's. The heads' follows from the differentiated balance, as in `ExponentialSeries`, and is held
    to it. Taut, both springs are the same; smoothing leaves this one alone.
    """

    name = suffix = "slack"
    parameters = (KSE, KSE0)
    states = (EXTENSION,)

    def force(self, q: Quantities) -> Expr:
        return q.kse0 * (ops.exp(q.kse * ops.positive(q.l_se)) - 1)

    def ce_velocity(self, q: Quantities) -> Expr:
        """U = (gamma v k_se - dF_kin - (F_heads - F_spring)/tau)/(dF/dx + k_se), with k_se = 0 below slack."""
        stiffness = q.kse * (self.force(q) + q.kse0) * ops.above(q.l_se)
        unequal = _RESTORING * (q.force_xb - self.force(q))
        # With no head attached nothing moves a slack contractile element.
        heads = q.stiffness_xb + q.EMPTY
        return (q.gamma * q.velocity * stiffness - q.kinetic_force_rate - unequal) / (heads + stiffness)

    def extension(self, q: Quantities) -> Expr:
        """The state."""
        return q.l_se

    def derivatives(self, q: Quantities) -> Values:
        """What the fibre lengthens beyond the contractile element."""
        return {"l_se": q.gamma * q.velocity - q.ce_velocity}
