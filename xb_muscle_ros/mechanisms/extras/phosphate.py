"""Phosphate: heads detach by reversing the power stroke."""

from xb_muscle_ros.mechanisms import Entry, ExponentialRate, Extra, Needs, Parameter, Quantities, StrainRate

REVERSAL = Parameter(
    "phosphate_detachment", "1/s", "detachment by reversal of the power stroke, the same at every strain", 0.0, 1e4,
    0.0, "Dantzig et al. 1992; this package",
)  # fmt: skip


class Phosphate(Extra):
    """A constant added to the detachment rate g(x)."""

    name = "phosphate"
    needs = Needs.HEADS
    parameters = (REVERSAL,)
    entry = Entry(
        "rates", "phosphate", "phosphate in the solution lets heads detach before they have done their work",
        "phosphate_detachment", 5.0, starts=({"phosphate_detachment": 2.0},),
    )  # fmt: skip

    def detachment(self, q: Quantities) -> tuple[StrainRate, ...]:
        return (ExponentialRate(q.phosphate_detachment, 0),)
