"""The families of a model's blocks, and the hooks that a block of each has."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from typing import ClassVar, NamedTuple

from xb_muscle_ros.mechanisms.base import Family, GaussianSpread, Mechanism, State, StrainRate, Values
from xb_muscle_ros.mechanisms.ops import Expr
from xb_muscle_ros.mechanisms.quantities import Quantities


class ThinFilament(Mechanism):
    """Makes binding sites available."""

    family = Family.THIN_FILAMENT

    @abstractmethod
    def available_sites(self, q: Quantities) -> Expr:
        """Fraction N of sites where heads can attach (those with a head bound included)."""


class ThickFilament(Mechanism):
    """Makes myosin heads ready (disordered-relaxed, DRX)."""

    family = Family.THICK_FILAMENT

    @abstractmethod
    def ready_heads(self, q: Quantities) -> Expr:
        """Fraction D of heads that are detached and able to attach."""


class Attachment(Mechanism):
    """Spreads newly attached heads over strain."""

    family = Family.ATTACHMENT

    @abstractmethod
    def spread(self, q: Quantities) -> GaussianSpread:
        """Heads that attach per second and their spread over strain."""


class Detachment(Mechanism):
    """Takes attached heads off, and may bring them back by a way of its own."""

    family = Family.DETACHMENT

    @abstractmethod
    def rates(self, q: Quantities) -> tuple[StrainRate, ...]:
        """Rates at which attached heads detach to the ready state, as functions of strain."""

    def forcible_rates(self, q: Quantities) -> tuple[StrainRate, ...]:
        """Rates at which attached heads are torn off into the forcibly detached state."""
        return ()

    def reattachment(self, q: Quantities) -> tuple[GaussianSpread, ...]:
        """Heads that come back from the forcibly detached state."""
        return ()

    def forcibly_detached(self, q: Quantities) -> Expr:
        """Fraction R of heads that were torn off and have not come back."""
        return 0.0


class Contractile(NamedTuple):
    """A contractile element whose force is a function of its velocity alone.

    Attributes:
        force_at: cross-bridge force at a velocity in power strokes/s.
        velocity_at: the inverse.
    """

    force_at: Callable[[Expr], Expr]
    velocity_at: Callable[[Expr], Expr]


class Balance(NamedTuple):
    """Where such an element and the series element bear the same force.

    Attributes:
        force: cross-bridge force.
        ce_velocity: of the contractile element, power strokes/s.
        extension: of the series element, power strokes.
        derivatives: rates of the series element's `length_states`.
    """

    force: Expr
    ce_velocity: Expr
    extension: Expr
    derivatives: Values


class Series(Mechanism):
    """What lies between the contractile element and the end of the fibre.

    Cross-bridges carry the force in their states: `ce_velocity` and `extension` follow from it. Where the contractile
    element has no such state, the series element's own length is one (`length_states`), and `balance` applies. A block
    whose length does not follow from force has it among its `states`, and says `force` and `derivatives`.
    """

    family = Family.SERIES
    length_states: ClassVar[tuple[State, ...]] = ()

    @property
    def follows_force(self) -> bool:
        """Whether its length is known from the cross-bridges' force alone."""
        return any(state not in self.states for state in self.length_states)

    @abstractmethod
    def ce_velocity(self, q: Quantities) -> Expr:
        """Velocity u of the contractile element, power strokes/s.

        ``q.kinetic_force_rate`` is dF_xb/dt at constant strain (1/s), ``q.stiffness_xb`` is dF_xb per power stroke.
        """

    @abstractmethod
    def extension(self, q: Quantities) -> Expr:
        """Length of the series element at the force ``q.force_xb``, power strokes."""

    def force(self, q: Quantities) -> Expr:
        """What it bears, cross-bridge force; that of the heads, ``q.force_xb``, where it has no states."""
        return q.force_xb

    @abstractmethod
    def balance(self, q: Quantities, element: Contractile) -> Balance:
        """Force and velocity of a contractile element without states of its own."""


class Parallel(Mechanism):
    """What bears force beside the cross-bridges."""

    family = Family.PARALLEL

    @abstractmethod
    def force(self, q: Quantities) -> Expr:
        """Force at ``q.length_change``, F0."""


class Activation(Mechanism):
    """Says how strong the contractile element is."""

    family = Family.ACTIVATION

    @abstractmethod
    def level(self, q: Quantities) -> Expr:
        """Isometric force as a fraction of the cross-bridge force of all heads."""


class ForceVelocity(Mechanism):
    """Force of the contractile element over its activation, as a function of velocity."""

    family = Family.FORCE_VELOCITY

    @abstractmethod
    def force(self, q: Quantities, velocity: Expr) -> Expr:
        """Force over activation at a velocity in power strokes/s, positive in lengthening."""

    @abstractmethod
    def velocity(self, q: Quantities, force: Expr) -> Expr:
        """The inverse of `force`, power strokes/s."""
