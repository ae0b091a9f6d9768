"""Regular detachment, and heads that are torn off when stretched far: the fourth state."""

from xb_muscle_ros.mechanisms import (
    Entry,
    Expr,
    GaussianSpread,
    Parameter,
    Quantities,
    State,
    StepRate,
    StrainRate,
    Values,
)
from xb_muscle_ros.mechanisms.attachment.gaussian import WIDTH
from xb_muscle_ros.mechanisms.detachment.regular import RegularDetachment

_SOURCE = "van der Zee et al. 2026"
K_FORCIBLE = Parameter(
    "k", "1/s", "forcible detachment rate past the critical strain (paper 3000, released sets 1000)", 0.0, 1e6, 3000.0,
    _SOURCE,
)  # fmt: skip
B_REATTACH = Parameter(
    "b", "1/s", "reattachment rate of forcibly detached heads (paper 1000, released sets 3000)", 0.0, 1e6, 1000.0,
    _SOURCE,
)  # fmt: skip
CRITICAL = Parameter(
    "dLcrit", "power strokes", "critical strain x_c past which heads are torn off", -10.0, 15.0, None, _SOURCE
)
STEEPNESS = Parameter(
    "steepness", "1/power stroke",
    "slope of the tanh by which forcible detachment sets in (paper 20, released sets 3); moments take a sharp step",
    1e-3, 20.0, 20.0, _SOURCE,
)  # fmt: skip


class ForcibleDetachment(RegularDetachment):
    """g(x) as in regular detachment; torn off at k (1 + tanh(steepness (x - x_c)))/2, back at b R around strain 0.

    dR = (heads torn off) - b R. The released sets take a sharp step in the moments; see `StepRate`.
    """

    name = "forcible"
    parameters = (*RegularDetachment.parameters, K_FORCIBLE, B_REATTACH, CRITICAL, STEEPNESS, WIDTH)
    states = (State("r", "1", "fraction of heads forcibly detached", 0.0, 1.0),)
    entry = Entry(
        "heads_under_strain", "forcible detachment", "heads stretched too far are torn off and bind again quickly",
        "k", 1000.0, {"dLcrit": 0.7},
        tuple({"k": 500.0, "dLcrit": critical, "b": 1000.0} for critical in (0.7, 1.5, 2.5)),
        name="forcible_detachment",
    )  # fmt: skip

    def forcible_rates(self, q: Quantities) -> tuple[StrainRate, ...]:
        return (StepRate(q.k, q.dLcrit, q.steepness),)

    def reattachment(self, q: Quantities) -> tuple[GaussianSpread, ...]:
        """Torn-off heads come back with the spread of first attachment."""
        return (GaussianSpread(q.b * q.r, q.w),)

    def forcibly_detached(self, q: Quantities) -> Expr:
        """R itself is the state."""
        return q.r

    def derivatives(self, q: Quantities) -> Values:
        return {"r": q.torn_off - q.reattached}
