"""Lattice spacing: heads reach actin more easily where filaments lie closer, as they do in a longer fibre."""

from xb_muscle_ros.mechanisms import Entry, Extra, Needs, Parameter, Quantities, Values, ops

LATTICE = Parameter(
    "attachment_per_length", "1/L0", "relative rise of the attachment rate with half-sarcomere length", -50.0, 50.0,
    0.0, "Williams et al. 2013; this package",
)  # fmt: skip


class LatticeSpacing(Extra):
    """f exp(alpha ΔS) in place of the attachment rate f; ΔS is the half-sarcomeres' length change."""

    name = "lattice_spacing"
    needs = Needs.HEADS
    parameters = (LATTICE,)
    entry = Entry(
        "length_dependence", "lattice spacing",
        "heads attach faster when the fibre is longer and its lattice tighter",
        "attachment_per_length", 3.0, starts=({"attachment_per_length": 1.5},),
    )  # fmt: skip

    def modified(self, q: Quantities) -> Values:
        return {"f": q.f * ops.exp(q.attachment_per_length * q.sarcomere_change)}
