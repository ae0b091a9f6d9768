"""No series compliance: the contractile element takes the whole length change."""

from xb_muscle_ros.mechanisms import Balance, Contractile, Expr, Quantities, Series


class RigidSeries(Series):
    """The family's null block: u = gamma v."""

    name = suffix = "rigid"

    def ce_velocity(self, q: Quantities) -> Expr:
        return q.gamma * q.velocity

    def extension(self, q: Quantities) -> Expr:
        """None at any force."""
        return 0.0

    def balance(self, q: Quantities, element: Contractile) -> Balance:
        """The contractile element moves as the fibre does, and its force follows."""
        velocity = q.gamma * q.velocity
        return Balance(element.force_at(velocity), velocity, 0.0, {})
