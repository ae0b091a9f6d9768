"""Temperature: all rates faster or slower together."""

from xb_muscle_ros.mechanisms import Entry, Extra, Parameter, Quantities, Values

_SOURCE = "Ranatunga 1996; this package"
OFFSET = Parameter("warmer", "K", "temperature above that of the parameter set", -30.0, 30.0, 0.0, _SOURCE)
Q10 = Parameter("q10", "1", "factor of all rates per 10 K", 0.5, 10.0, 2.5, _SOURCE)
# Rates per second, and velocities; what a model does not have is left out.
RATES = ("kon", "koff", "J1", "J2", "f", "k11", "k21", "k", "b", "vmax")


class Temperature(Extra):
    """Every rate times Q10^(ΔT/10); equilibria stay where they are."""

    name = "temperature"
    parameters = (OFFSET, Q10)
    entry = Entry(
        "rates", "temperature", "the recordings were made warmer or colder than the model assumes",
        "warmer", 3.0, starts=({"warmer": 2.0},), reach=5.0,
    )  # fmt: skip

    def modified(self, q: Quantities) -> Values:
        factor = q.q10 ** (q.warmer / 10)
        return {name: getattr(q, name) * factor for name in RATES if name in q}
