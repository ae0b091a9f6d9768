"""Temperature: all rates faster or slower together."""

from __future__ import annotations

from collections.abc import Mapping

from xb_muscle_ros.mechanisms.base import Parameter, Quantities
from xb_muscle_ros.mechanisms.extra import Extra
from xb_muscle_ros.mechanisms.ops import Expr

_SOURCE = "Ranatunga 1996; this package"
OFFSET = Parameter("warmer", "K", "temperature above that of the parameter set", -30.0, 30.0, 0.0, _SOURCE)
Q10 = Parameter("q10", "1", "factor of all rates per 10 K", 0.5, 10.0, 2.5, _SOURCE)
# Rates per second, and velocities; what a model does not have is left out.
_RATES = ("kon", "koff", "J1", "J2", "f", "k11", "k21", "k", "b", "vmax")


class Temperature(Extra):
    """Every rate times Q10^(ΔT/10); equilibria stay where they are."""

    name = "temperature"
    parameters = (OFFSET, Q10)

    def modified(self, q: Quantities) -> Mapping[str, Expr]:
        """See the class."""
        factor = q.q10 ** (q.warmer / 10)
        return {name: getattr(q, name) * factor for name in _RATES if name in q}
