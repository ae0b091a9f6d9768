"""Thick filament without regulation: every head that is not attached can attach."""

from __future__ import annotations

from collections.abc import Mapping

from xb_muscle_ros.mechanisms.base import Quantities, ThickFilament
from xb_muscle_ros.mechanisms.ops import Expr


class AlwaysOnThickFilament(ThickFilament):
    """The family's null block: D = 1 - Q0 - R."""

    name = "always_on"

    def ready_heads(self, q: Quantities) -> Expr:
        """See the class."""
        return 1 - q.q0 - q.forcibly_detached

    def derivatives(self, q: Quantities) -> Mapping[str, Expr]:
        """No state."""
        return {}
