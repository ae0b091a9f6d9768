"""Static stiffness: a spring that calcium, not force, makes stiff."""

from xb_muscle_ros.mechanisms import Entry, Expr, Extra, Parameter, Quantities

_SOURCE = "Bagni et al. 1994; this package"
STIFFNESS = Parameter("calcium_stiffness", "F0/L0", "static stiffness at full calcium", 0.0, 100.0, 0.0, _SOURCE)
HALF = Parameter("stiffness_calcium", "µM", "calcium at which half of it is there", 1e-3, 1e3, 1.0, _SOURCE)
HILL = Parameter("stiffness_hill", "1", "steepness with which calcium makes it", 0.5, 20.0, 2.0, _SOURCE)


class StaticCalciumStiffness(Extra):
    """F = k ΔL/(1 + (Ca_half/Ca)^hill)."""

    name = "static_calcium_stiffness"
    parameters = (STIFFNESS, HALF, HILL)
    entry = Entry(
        "calcium_dependent_elasticity", "static calcium-dependent stiffness",
        "a spring whose stiffness follows calcium, not force",
        "calcium_stiffness", 2.0, {"stiffness_calcium": 0.7, "stiffness_hill": 0.5},
        tuple({"calcium_stiffness": 1.0, "stiffness_calcium": half} for half in (0.3, 1.0, 4.0)),
    )  # fmt: skip

    def force(self, q: Quantities) -> Expr:
        return q.calcium_stiffness * q.length_change / (1 + (q.stiffness_calcium / q.calcium) ** q.stiffness_hill)
