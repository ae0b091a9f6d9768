"""Cooperative thick filament: force brings super-relaxed heads into play."""

from collections.abc import Mapping

from xb_muscle_ros.mechanisms import Entry, Expr, Parameter, Quantities, Starts, State, ThickFilament, Values

J1 = Parameter("J1", "1/s", "rate from super-relaxed to ready at zero force", 0.0, 1e5, 6.17, "van der Zee et al. 2026")
J2 = Parameter("J2", "1/s", "rate from ready to super-relaxed", 0.0, 1e5, 200.0, "van der Zee et al. 2026")
JF = Parameter("JF", "1", "increase of J1 per cross-bridge force", 0.0, 1e6, None, "van der Zee et al. 2026")


def _of_always_on(base: Mapping[str, float]) -> Starts:
    """Thick filaments that force switches on; more attachment makes up for the heads that are super-relaxed."""
    return tuple({"JF": jf, "f": base.get("f", 50.0) * more} for jf, more in ((30.0, 2.0), (200.0, 2.0), (1000.0, 1.1)))


class ForceDependentThickFilament(ThickFilament):
    """dD = J1 (1 + JF F+ + recruitment) S - J2 D - (dQ0 + dR by kinetics), with S = 1 - Q0 - D - R super-relaxed."""

    name = "force_dependent"
    parameters = (J1, J2, JF)
    states = (State("drx", "1", "fraction of heads detached and disordered-relaxed", 0.0, 1.0),)
    entry = Entry(
        "regulation", "thick-filament cooperativity", "force wakes heads that were resting on the thick filament",
        None, shape={"JF": 1.5}, start_from=_of_always_on,
        # Where nothing sends heads to rest they are always on.
        off={"J2": 0.0}, name="thick_filament_cooperativity",
    )  # fmt: skip

    def rest(self, q: Quantities) -> Values:
        """Without force, heads share themselves out as J1 to J2."""
        return {"drx": q.J1 / (q.J1 + q.J2)}

    def ready_heads(self, q: Quantities) -> Expr:
        """D itself is the state."""
        return q.drx

    def derivatives(self, q: Quantities) -> Values:
        super_relaxed = 1 - q.q0 - q.drx - q.forcibly_detached
        recruit = q.J1 * (1 + q.JF * q.positive(q.force_xb) + q.recruitment) * super_relaxed
        return {"drx": recruit - q.J2 * q.drx - q.attachment_rate_net}
