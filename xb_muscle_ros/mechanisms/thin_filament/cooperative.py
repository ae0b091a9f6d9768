"""Cooperative thin filament: active sites and bound heads help their neighbours to switch on."""

from collections.abc import Mapping

from xb_muscle_ros.mechanisms import Entry, Expr, Parameter, Quantities, Starts, State, ThinFilament, Values

N_ON = State("n_on", "1", "fraction of binding sites where heads can attach", 0.0, 1.0)
KON = Parameter(
    "kon", "1/(µM s)", "thin-filament activation rate per free calcium", 0.0, 1e4, None, "van der Zee et al. 2026"
)
KOFF = Parameter(
    "koff", "1/s", "thin-filament deactivation rate", 0.0, 1e5, 80.0, "van der Zee et al. 2026, its reference 108"
)
KOOP = Parameter("koop", "1", "strength of thin-filament cooperativity", 0.0, 1e4, None, "van der Zee et al. 2026")


def _of_sigmoid(base: Mapping[str, float]) -> Starts:
    """Cooperative filaments that are half active where the sigmoid is, at several strengths of cooperativity."""
    kappa = base.get("kappa", 1.0)
    return tuple(
        {"kon": koff * half / kappa, "koop": koop, "koff": koff}
        for koff, koop, half in ((80.0, 1.0, 0.7), (20.0, 3.0, 0.5), (10.0, 10.0, 0.3))
    )


class CooperativeThinFilament(ThinFilament):
    """dN = kon Ca (1 - N)(1 + koop N) - koff (N - Q0)(1 + koop (1 - N)).

    Sites with a head bound cannot switch off, hence N - Q0 (van der Zee et al. 2026, after Campbell et al. 2018).
    """

    name = "cooperative"
    parameters = (KON, KOFF, KOOP)
    states = (N_ON,)
    entry = Entry(
        "regulation", "thin-filament cooperativity",
        "bound heads and active sites help their neighbours to become active",
        None, shape={"kon": 1.0, "koff": 1.0, "koop": 1.0}, start_from=_of_sigmoid,
        frame=True, name="thin_filament_cooperativity",
    )  # fmt: skip

    def available_sites(self, q: Quantities) -> Expr:
        """N itself is the state."""
        return q.n_on

    def derivatives(self, q: Quantities) -> Values:
        on = q.kon * q.calcium * (1 - q.n_on) * (1 + q.koop * q.n_on)
        off = q.koff * (q.n_on - q.q0) * (1 + q.koop * (1 - q.n_on))
        return {"n_on": on - off}
