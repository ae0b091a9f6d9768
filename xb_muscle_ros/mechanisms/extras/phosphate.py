"""Phosphate: heads detach by reversing the power stroke."""

from __future__ import annotations

from xb_muscle_ros.mechanisms.base import ExponentialRate, Parameter, Quantities, StrainRate
from xb_muscle_ros.mechanisms.extra import Extra, Needs

REVERSAL = Parameter(
    "phosphate_detachment", "1/s", "detachment by reversal of the power stroke, the same at every strain", 0.0, 1e4,
    0.0, "Dantzig et al. 1992; this package",
)  # fmt: skip


class Phosphate(Extra):
    """A constant added to the detachment rate g(x)."""

    name = "phosphate"
    needs = Needs.HEADS
    parameters = (REVERSAL,)

    def detachment(self, q: Quantities) -> tuple[StrainRate, ...]:
        """See the class."""
        return (ExponentialRate(q.phosphate_detachment, 0),)
