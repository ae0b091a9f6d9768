"""Viscous drag: a force proportional to the fibre's velocity."""

from xb_muscle_ros.mechanisms import Entry, Expr, Extra, Parameter, Quantities

DRAG = Parameter("drag", "F0 s/L0", "viscous drag of the fibre", 0.0, 10.0, 0.0, "Ford, Huxley and Simmons 1977")


class ViscousDrag(Extra):
    """F = drag v."""

    name = "viscous_drag"
    parameters = (DRAG,)
    entry = Entry(
        "parallel_viscoelasticity", "viscous drag", "a force proportional to the speed of stretch",
        "drag", 0.02, starts=({"drag": 0.01},),
    )  # fmt: skip

    def force(self, q: Quantities) -> Expr:
        return q.drag * q.velocity
