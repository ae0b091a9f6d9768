"""Active titin: it takes hold of actin when calcium comes, and is a spring from there on."""

from xb_muscle_ros.mechanisms import Entry, Expr, Extra, Parameter, Quantities, State, Values

_SOURCE = "Millard, Franklin and Herzog 2024; this package"
STIFFNESS = Parameter("titin_stiffness", "F0/L0", "stiffness of titin held by actin", 0.0, 100.0, 0.0, _SOURCE)
RELEASE = Parameter("titin_release", "1/s", "rate at which titin lets go without calcium", 0.0, 1e4, 10.0, _SOURCE)
HALF = Parameter("titin_calcium", "µM", "calcium at which half of the titin holds on", 1e-3, 1e3, 1.0, _SOURCE)
HILL = Parameter("titin_hill", "1", "steepness with which calcium makes titin hold on", 0.5, 20.0, 2.0, _SOURCE)
REBINDING = Parameter(
    "titin_rebinding", "1/s", "rate at which slack titin takes hold anew, shorter", 0.0, 1e4, 10.0, _SOURCE
)


class ActiveTitin(Extra):
    """F = k g x+ with x' = v - release (1 - g) x + rebinding (-x)+ and g = 1/(1 + (Ca_half/Ca)^hill).

    x is the stretch since titin took hold: it follows the fibre while calcium holds titin to actin and is forgotten
    without. Shortened below where it took hold titin is slack, until it takes hold anew.
    """

    name = "active_titin"
    parameters = (STIFFNESS, RELEASE, HALF, HILL, REBINDING)
    states = (State("titin_stretch", "L0", "stretch since titin took hold of actin", -100.0, 100.0),)
    entry = Entry(
        "calcium_dependent_elasticity", "active titin",
        "a spring that engages when the fibre is activated and is stretched from there on",
        "titin_stiffness", 2.0, {"titin_calcium": 0.7, "titin_hill": 0.5, "titin_rebinding": 1.0},
        tuple({"titin_stiffness": 1.0, "titin_calcium": half} for half in (0.3, 1.0, 4.0)),
    )  # fmt: skip

    def force(self, q: Quantities) -> Expr:
        return q.titin_stiffness * self._held(q) * q.positive(q.titin_stretch)

    def derivatives(self, q: Quantities) -> Values:
        x = q.titin_stretch
        forgotten = q.titin_release * (1 - self._held(q)) * x
        return {"titin_stretch": q.velocity - forgotten + q.titin_rebinding * q.positive(-x)}

    def _held(self, q: Quantities) -> Expr:
        return 1 / (1 + (q.titin_calcium / q.calcium) ** q.titin_hill)
