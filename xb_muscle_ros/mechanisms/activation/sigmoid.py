"""Activation by calcium without delay, as in the paper's Hill-type models."""

from xb_muscle_ros.mechanisms import Activation, Expr, Parameter, Quantities, ops
from xb_muscle_ros.mechanisms.thin_filament.sigmoid import HILL_N, KAPPA

ACT_MAX = Parameter(
    "act_max", "1", "activation at full calcium (times Fscale: isometric force)", 1e-3, 10.0, 0.5, "as released"
)
AMIN = Parameter("amin", "1", "least activation, whatever the calcium", 1e-6, 1.0, 0.005, "as released")


class SigmoidActivation(Activation):
    """a = act_max Ca^n/(kappa^n + Ca^n), but amin at least, so that F/a and with it the velocity stay defined."""

    name = "sigmoid"
    parameters = (ACT_MAX, KAPPA, HILL_N, AMIN)

    def level(self, q: Quantities) -> Expr:
        # The quotient form would overflow for a large n at high calcium; this one cannot.
        sigmoid = q.act_max / (1 + (q.kappa / q.calcium) ** q.n)
        return q.amin + ops.positive(sigmoid - q.amin)
