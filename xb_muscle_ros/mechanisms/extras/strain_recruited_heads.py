"""Strain recruits heads: stretch of the thick filament brings super-relaxed heads into play, beside force."""

from __future__ import annotations

from collections.abc import Mapping

from xb_muscle_ros.mechanisms.base import Parameter, Quantities
from xb_muscle_ros.mechanisms.extra import Extra, Needs
from xb_muscle_ros.mechanisms.ops import Expr

RECRUITMENT = Parameter(
    "strain_recruitment", "1/L0", "increase of J1 with the fibre's stretch", 0.0, 1e5, 0.0,
    "Ait-Mou et al. 2016; this package",
)  # fmt: skip


class StrainRecruitedHeads(Extra):
    """J1 (1 + JF F + kappa ΔL+) in place of J1 (1 + JF F)."""

    name = "strain_recruited_heads"
    needs = Needs.SUPER_RELAXED
    parameters = (RECRUITMENT,)

    def modified(self, q: Quantities) -> Mapping[str, Expr]:
        """See the class."""
        return {"recruitment": q.strain_recruitment * q.positive(q.length_change)}
