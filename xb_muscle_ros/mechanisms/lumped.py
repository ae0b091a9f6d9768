"""Families of models without cross-bridges (Hill-type): an activation, and a relation of force and velocity."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping

from xb_muscle_ros.mechanisms.base import Family, Mechanism, Quantities
from xb_muscle_ros.mechanisms.ops import Expr


class Activation(Mechanism):
    """Says how strong the contractile element is."""

    family = Family.ACTIVATION

    @abstractmethod
    def level(self, q: Quantities) -> Expr:
        """Isometric force as a fraction of the cross-bridge force of all heads."""

    def derivatives(self, q: Quantities) -> Mapping[str, Expr]:
        """Rates of change of the block's states, 1/s."""
        return {}


class ForceVelocity(Mechanism):
    """Force of the contractile element over its activation, as a function of velocity."""

    family = Family.FORCE_VELOCITY

    @abstractmethod
    def force(self, q: Quantities, velocity: Expr) -> Expr:
        """Force over activation at a velocity in power strokes/s, positive in lengthening."""

    @abstractmethod
    def velocity(self, q: Quantities, force: Expr) -> Expr:
        """The inverse of `force`, power strokes/s."""
