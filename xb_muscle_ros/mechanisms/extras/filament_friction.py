"""Friction that bound heads make: links are elastic for a short way, slip, and take time to form anew."""

from xb_muscle_ros.mechanisms import Entry, Expr, Extra, Needs, Parameter, Quantities, State, Values

_SOURCE = (
    "Campbell and Lakie 1998 (J Physiol 510:941), links that slip and form anew; "
    "Brunello et al. 2007 (PNAS 104:20114), second heads; two-moment form: this package"
)
FORCE = Parameter("friction_force", "F0", "friction if all heads were bound", 0.0, 10.0, 0.0, _SOURCE)
WAY = Parameter("friction_way", "L0", "length change after which links slip", 1e-5, 1.0, 0.01, _SOURCE)
RELEASE = Parameter("friction_release", "1/s", "rate at which links let go and form anew", 0.0, 1e4, 10.0, _SOURCE)


# Share of links below which their mean strain counts less: it stays finite where none holds.
_FEW = 1e-3


class FilamentFriction(Extra):
    """F = A Q0 t, t' = h v/d - (r + s) t, h' = r (1 - h) - s h, with s = max(v y, 0) y²/d and y = t/(h + 0.001).

    Of the links that bound heads make, the share h holds; their mean strain in units of the way d is y. Links follow
    length as springs do, let go and form anew without strain at the rate r, and slip once they have gone d or so in the
    direction of the movement. So friction is elastic for a short way, then falls to what the rate r renews, and is less
    stiff right after a movement (thixotropy). By measured force (rat soleus) it scales with bound heads; in proportion
    to available sites it explains less, and friction that is whole again at once contradicts measured SRS.
    """

    name = "filament_friction"
    needs = Needs.HEADS
    parameters = (FORCE, WAY, RELEASE)
    states = (
        State(
            "friction", "1", "force of all links over that of links that hold and are strained by the way", -10.0, 10.0
        ),
        State("friction_slipped", "1", "share of links that have slipped and not yet formed anew", 0.0, 1.0),
    )
    entry = Entry(
        "weak_binding", "friction of bound heads",
        "links of bound heads are elastic for a short way, slip, and take time to form anew",
        "friction_force", 0.4, {"friction_way": 0.7, "friction_release": 1.5},
        tuple({"friction_force": 0.3, "friction_way": 0.007, "friction_release": rate} for rate in (8.0, 45.0)),
        # Links that never slip: absent friction halves no steps.
        off={"friction_way": 1.0},
    )  # fmt: skip

    def force(self, q: Quantities) -> Expr:
        return q.friction_force * q.q0 * q.friction

    def derivatives(self, q: Quantities) -> Values:
        v, total = q.velocity, q.friction
        holding = 1 - q.friction_slipped
        y = total / (holding + _FEW)
        slipping = q.positive(v * y) * y**2 / q.friction_way
        return {
            "friction": v / q.friction_way * holding - (q.friction_release + slipping) * total,
            "friction_slipped": slipping * holding - q.friction_release * q.friction_slipped,
        }
