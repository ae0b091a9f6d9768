"""Persistent thick filament: it switches more slowly than force does, on and off."""

from xb_muscle_ros.mechanisms import Entry, Extra, Needs, Parameter, Quantities, Values, ops

PERSISTENCE = Parameter(
    "thick_persistence", "1", "natural logarithm of the factor by which thick-filament switching is slower", -5.0, 10.0,
    0.0, "Hill et al. 2021 (eLife 10:e68211); this package",
)  # fmt: skip


class PersistentThickFilament(Extra):
    """J1 and J2 times exp(-p): the same equilibrium at every force, reached exp(p) times as slowly.

    X-ray diffraction of tetani shows thick filaments that stay on while force is lost already (Hill et al. 2021). Heads
    that a quick shortening has taken off are then still ready, and force comes back at the rate of attachment.
    """

    name = "persistent_thick_filament"
    needs = Needs.SUPER_RELAXED
    parameters = (PERSISTENCE,)
    entry = Entry(
        "regulation", "persistent thick filament",
        "heads that force has woken go to rest more slowly than the model has it",
        "thick_persistence", 2.0, starts=({"thick_persistence": 2.0},), reach=4.0,
    )  # fmt: skip

    def modified(self, q: Quantities) -> Values:
        slower = ops.exp(-q.thick_persistence)
        return {"J1": q.J1 * slower, "J2": q.J2 * slower}
