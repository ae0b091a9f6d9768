"""Filament overlap: how many of the available sites heads can reach depends on length."""

from xb_muscle_ros.mechanisms import Entry, Expr, Extra, Parameter, Quantities, ops

OVERLAP = Parameter(
    "overlap_per_length", "1/L0",
    "relative change of reachable sites with length: positive on the ascending limb, negative on the descending",
    -50.0, 50.0, 0.0, "Gordon, Huxley and Julian 1966; this package",
)  # fmt: skip
EDGE = Parameter(
    "overlap_edge", "L0", "length change of half-sarcomeres up to which overlap stays as it is (the plateau's edge)",
    -1.0, 1.0, -1.0, "Gordon, Huxley and Julian 1966; this package",
)  # fmt: skip


class FilamentOverlap(Extra):
    """N exp(alpha ((ΔS - edge)+ - (-edge)+)) in place of the available sites N: plateau and limb near rest length.

    ΔS is the half-sarcomeres' length change: a taut series spring leaves them shorter than the fibre.
    """

    name = "filament_overlap"
    parameters = (OVERLAP, EDGE)
    entry = Entry(
        "length_dependence", "filament overlap", "the number of heads within reach changes with length",
        "overlap_per_length", 3.0, {"overlap_edge": 0.02},
        tuple({"overlap_per_length": -1.5, "overlap_edge": edge} for edge in (-0.06, -0.01)),
    )  # fmt: skip

    def overlap(self, q: Quantities) -> Expr:
        beyond = q.positive(q.sarcomere_change - q.overlap_edge) - q.positive(-q.overlap_edge)
        return ops.exp(q.overlap_per_length * beyond)
