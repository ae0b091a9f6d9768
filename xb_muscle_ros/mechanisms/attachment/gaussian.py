"""Attachment around the power stroke with the spread of the head's Brownian motion."""

from __future__ import annotations

from xb_muscle_ros.mechanisms.base import Attachment, GaussianSpread, Parameter, Quantities

F_RATE = Parameter("f", "1/s", "attachment rate, summed over strain", 0.0, 1e6, None, "van der Zee et al. 2026")
WIDTH = Parameter(
    "w",
    "power strokes",
    "standard deviation of the strain at attachment (paper 0.3, released sets 1/6)",
    1e-3,
    5.0,
    0.3,
    "van der Zee et al. 2026",
)


class GaussianAttachment(Attachment):
    """D f/(w sqrt(2 pi)) exp(-x²/(2 w²)) (N - Q0)."""

    name = "gaussian"
    parameters = (F_RATE, WIDTH)

    def spread(self, q: Quantities) -> GaussianSpread:
        """See the class."""
        return GaussianSpread(q.ready_heads * q.f * (q.available_sites - q.q0), q.w)
