"""Filament overlap: how many of the available sites heads can reach depends on length."""

from __future__ import annotations

from xb_muscle_ros.mechanisms import ops
from xb_muscle_ros.mechanisms.base import Parameter, Quantities
from xb_muscle_ros.mechanisms.extra import Extra
from xb_muscle_ros.mechanisms.ops import Expr

OVERLAP = Parameter(
    "overlap_per_length", "1/L0",
    "relative change of reachable sites with length: positive on the ascending limb, negative on the descending",
    -50.0, 50.0, 0.0, "Gordon, Huxley and Julian 1966; this package",
)  # fmt: skip


class FilamentOverlap(Extra):
    """N exp(alpha ΔL) in place of the available sites N: a limb of the force-length relation near rest length."""

    name = "filament_overlap"
    parameters = (OVERLAP,)

    def overlap(self, q: Quantities) -> Expr:
        """See the class."""
        return ops.exp(q.overlap_per_length * q.length_change)
