"""Active force-length relation: the share of heads' force that is borne depends on the half-sarcomeres' length."""

from xb_muscle_ros.mechanisms import Expr, Extra, Needs, Parameter, Quantities, ops

_SOURCE = "MuJoCo, 'Muscle actuators' (lmin, lmax); plateau and limbs: Gordon, Huxley and Julian 1966"
FL_MIN = Parameter(
    "fl_min", "L0", "length of half-sarcomeres below which they bear no active force; the optimum is at 1", 0.0, 0.95,
    0.5, _SOURCE,
)  # fmt: skip
FL_MAX = Parameter(
    "fl_max", "L0", "length of half-sarcomeres above which they bear no active force; the optimum is at 1", 1.05, 4.0,
    1.6, _SOURCE,
)  # fmt: skip
FL_OPTIMUM = Parameter(
    "fl_optimum", "L0", "length change of half-sarcomeres at their optimum, whence lengths are counted", -0.5, 0.5, 0.0,
    "this package",
)  # fmt: skip


class ActiveForceLength(Extra):
    """A share g of the heads' force is borne: 1 - z²/2 up to z = 1, (2 - z)²/2 up to z = 2, and none beyond.

    z is the distance from the optimum, 2 (1 - L)/(1 - fl_min) below and 2 (L - 1)/(fl_max - 1) above, with
    L = 1 + ΔS - fl_optimum and ΔS the half-sarcomeres' length change. Slope and share are continuous. Heads within
    reach behave as at the optimum: kinetics are per head, and so is the force that wakes the thick filament.
    """

    name = "active_force_length"
    needs = Needs.SEPARATE_LENGTHS
    geometry = True
    parameters = (FL_MIN, FL_MAX, FL_OPTIMUM)

    def force_share(self, q: Quantities) -> tuple[Expr, Expr]:
        beyond = q.sarcomere_change - q.fl_optimum
        below, above = 2 / (1 - q.fl_min), 2 / (q.fl_max - 1)
        z = below * ops.positive(-beyond) + above * ops.positive(beyond)
        outer, inner = ops.positive(2 - z), ops.positive(1 - z)
        slope_of_z = above * ops.above(beyond) - below * ops.above(-beyond)
        return outer**2 / 2 - inner**2, (2 * inner - outer) * slope_of_z
