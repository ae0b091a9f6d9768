"""Lattice spacing: heads reach actin more easily where filaments lie closer, as they do in a longer fibre."""

from __future__ import annotations

from collections.abc import Mapping

from xb_muscle_ros.mechanisms import ops
from xb_muscle_ros.mechanisms.base import Parameter, Quantities
from xb_muscle_ros.mechanisms.extra import Extra, Needs
from xb_muscle_ros.mechanisms.ops import Expr

LATTICE = Parameter(
    "attachment_per_length", "1/L0", "relative rise of the attachment rate with half-sarcomere length", -50.0, 50.0,
    0.0, "Williams et al. 2013; this package",
)  # fmt: skip


class LatticeSpacing(Extra):
    """f exp(alpha ΔS) in place of the attachment rate f; ΔS is the half-sarcomeres' length change."""

    name = "lattice_spacing"
    needs = Needs.HEADS
    parameters = (LATTICE,)

    def modified(self, q: Quantities) -> Mapping[str, Expr]:
        """See the class."""
        return {"f": q.f * ops.exp(q.attachment_per_length * q.sarcomere_change)}
