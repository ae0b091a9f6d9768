"""Thick filament without regulation: every head that is not attached can attach."""

from xb_muscle_ros.mechanisms import Expr, Quantities, ThickFilament


class AlwaysOnThickFilament(ThickFilament):
    """The family's null block: D = 1 - Q0 - R."""

    name = "always_on"

    def ready_heads(self, q: Quantities) -> Expr:
        return 1 - q.q0 - q.forcibly_detached
