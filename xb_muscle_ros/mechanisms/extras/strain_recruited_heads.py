"""Strain recruits heads: stretch of the thick filament brings super-relaxed heads into play, beside force."""

from xb_muscle_ros.mechanisms import Entry, Extra, Needs, Parameter, Quantities, Values

RECRUITMENT = Parameter(
    "strain_recruitment", "1/L0", "increase of J1 with the fibre's stretch", 0.0, 1e5, 0.0,
    "Ait-Mou et al. 2016; this package",
)  # fmt: skip


class StrainRecruitedHeads(Extra):
    """J1 (1 + JF F + kappa ΔL+) in place of J1 (1 + JF F)."""

    name = "strain_recruited_heads"
    needs = Needs.SUPER_RELAXED
    parameters = (RECRUITMENT,)
    entry = Entry(
        "regulation", "heads recruited by strain", "stretch wakes heads that were resting on the thick filament",
        "strain_recruitment", 150.0, starts=({"strain_recruitment": 60.0},),
    )  # fmt: skip

    def modified(self, q: Quantities) -> Values:
        return {"recruitment": q.strain_recruitment * q.positive(q.length_change)}
