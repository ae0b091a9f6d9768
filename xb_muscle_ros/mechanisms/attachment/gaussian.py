"""Attachment around the power stroke with the spread of the head's Brownian motion."""

from xb_muscle_ros.mechanisms import Attachment, GaussianSpread, Parameter, Quantities, ops

F_RATE = Parameter("f", "1/s", "attachment rate, summed over strain", 0.0, 1e6, None, "van der Zee et al. 2026")
WIDTH = Parameter(
    "w", "power strokes", "standard deviation of the strain at attachment (paper 0.3, released sets 1/6)", 1e-3, 5.0,
    0.3, "van der Zee et al. 2026",
)  # fmt: skip


class GaussianAttachment(Attachment):
    """D f/(w sqrt(2 pi)) exp(-x²/(2 w²)) (N - Q0), and none where no site is free.

    With a cooperative thin filament N never falls below Q0. A sigmoid one follows falling calcium past the heads still
    bound; without the limit heads would then be taken away around strain 0, where there may be none.
    """

    name = "gaussian"
    parameters = (F_RATE, WIDTH)

    def spread(self, q: Quantities) -> GaussianSpread:
        return GaussianSpread(q.ready_heads * q.f * ops.positive(q.available_sites - q.q0), q.w)
