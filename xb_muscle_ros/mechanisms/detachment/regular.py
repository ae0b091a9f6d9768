"""Detachment by two exponentials of strain: slow at the power stroke, faster to either side."""

from typing import ClassVar

from xb_muscle_ros.mechanisms import Detachment, ExponentialRate, Parameter, Quantities, StrainRate

_SOURCE = "van der Zee et al. 2026"
K11 = Parameter(
    "k11", "1/s", "detachment rate that grows with negative strain, at the power stroke", 0.0, 1e6, None, _SOURCE
)
K12 = Parameter("k12", "1", "how fast that rate grows with negative strain, per power stroke", 0.0, 50.0, 2.0, _SOURCE)
K21 = Parameter(
    "k21", "1/s", "detachment rate that grows with positive strain, at the power stroke", 0.0, 1e6, None, _SOURCE
)
K22 = Parameter("k22", "1", "how fast that rate grows with positive strain, per power stroke", 0.0, 50.0, None, _SOURCE)


class RegularDetachment(Detachment):
    """g(x) = k11 exp(-k12 x) + k21 exp(k22 x)."""

    name = "regular"
    parameters: ClassVar[tuple[Parameter, ...]] = (K11, K12, K21, K22)

    def rates(self, q: Quantities) -> tuple[StrainRate, ...]:
        return (ExponentialRate(q.k11, -q.k12), ExponentialRate(q.k21, q.k22))
