"""Parallel spring of the paper: linear above its resting length, with a smooth transition."""

from xb_muscle_ros.mechanisms import Expr, Parallel, Parameter, Quantities, ops
from xb_muscle_ros.mechanisms.parallel.linear import KPE

LPE0 = Parameter(
    "lpe0", "L0", "resting length of the parallel spring, as a length change of the fibre", -1.0, 10.0, 0.0,
    "van der Zee et al. 2026",
)  # fmt: skip
SHARPNESS = Parameter(
    "pe_sharpness", "1/L0", "how sharply the parallel spring sets in at its resting length", 1.0, 1e6, 100.0,
    "this package",
)  # fmt: skip


class SoftplusParallel(Parallel):
    """F_pe = kpe gamma ln(1 + exp(K (ΔL - lpe0)))/K, in F0, with K = pe_sharpness.

    Well above its resting length it is the straight line kpe gamma (ΔL - lpe0); the released sets' constant force at
    rest, Fpe0, is the same as lpe0 = -Fpe0/(kpe gamma) there.
    """

    name = suffix = "softplus"
    parameters = (KPE, LPE0, SHARPNESS)

    def force(self, q: Quantities) -> Expr:
        return q.kpe * q.gamma * ops.softplus(q.length_change - q.lpe0, q.pe_sharpness)
