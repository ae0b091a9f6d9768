"""Parallel spring of the released sets: linear above rest, with a constant offset."""

from xb_muscle_ros.mechanisms import Expr, Parallel, Parameter, Quantities, ops

KPE = Parameter("kpe", "F0/power stroke", "stiffness of the parallel spring", 0.0, 10.0, 0.0, "van der Zee et al. 2026")
FPE0 = Parameter("Fpe0", "F0", "force of the parallel element at rest length", -1.0, 1.0, 0.0, "as released")


class LinearParallel(Parallel):
    """F_pe = kpe gamma max(ΔL, 0) + Fpe0, in F0."""

    name = "linear"
    parameters = (KPE, FPE0)

    def force(self, q: Quantities) -> Expr:
        return q.kpe * q.gamma * ops.positive(q.length_change) + q.Fpe0
