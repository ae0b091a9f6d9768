"""The continuously differentiable force-velocity relation of De Groote et al. 2016."""

from xb_muscle_ros.mechanisms import Expr, ForceVelocity, Parameter, Quantities, ops

_SOURCE = "De Groote et al. 2016"
VMAX = Parameter("vmax", "power strokes/s", "unloaded shortening velocity", 1e-3, 1e6, None, "van der Zee et al. 2026")
E1 = Parameter("e1", "1", "shape of the force-velocity relation: height", -100.0, -1e-3, -0.3183, _SOURCE)
E2 = Parameter("e2", "1", "shape of the force-velocity relation: slope", -1e3, -1e-3, -8.1492, _SOURCE)
E3 = Parameter("e3", "1", "shape of the force-velocity relation: centre", -100.0, 100.0, -0.3741, _SOURCE)
E4 = Parameter("e4", "1", "shape of the force-velocity relation: offset", -100.0, 100.0, 0.8856, _SOURCE)


class LogarithmicForceVelocity(ForceVelocity):
    """F/a = e1 ln(y + sqrt(y² + 1)) + e4 with y = e2 v/vmax + e3; inverse v = vmax (sinh((F/a - e4)/e1) - e3)/e2.

    Activation can fall faster than force, and F/a then asks for velocities beyond all numbers. Past a sinh of 12 (ten
    thousand vmax) the inverse goes on along its tangent: force falls through that range in microseconds either way.
    """

    name = "logarithmic"
    parameters = (VMAX, E1, E2, E3, E4)

    def force(self, q: Quantities, velocity: Expr) -> Expr:
        return q.e1 * ops.asinh(q.e2 * velocity / q.vmax + q.e3) + q.e4

    def velocity(self, q: Quantities, force: Expr) -> Expr:
        return q.vmax * (ops.tangent_sinh((force - q.e4) / q.e1) - q.e3) / q.e2
