"""Mechanisms that come on top of a model: any number of them, each changing the model in one of a few ways."""

from __future__ import annotations

import enum
from abc import abstractmethod
from collections.abc import Callable
from typing import ClassVar, NamedTuple

from xb_muscle_ros.mechanisms.base import Family, Mechanism, StrainRate, Values
from xb_muscle_ros.mechanisms.ops import Expr
from xb_muscle_ros.mechanisms.quantities import Quantities


class Needs(enum.Enum):
    """What a model must have for a mechanism to act on; the value says it in words."""

    NOTHING = "nothing"
    HEADS = "heads that attach and detach"
    SUPER_RELAXED = "super-relaxed heads"
    SEPARATE_LENGTHS = "a series element whose length does not follow from the heads' force"


class Moments(NamedTuple):
    """Zeroth to second moment over strain: of heads, or of a flux of heads (1/s)."""

    m0: Expr
    m1: Expr
    m2: Expr

    def plus(self, other: Moments, sign: int = 1) -> Moments:
        """Sum, or difference with sign -1."""
        return Moments(self.m0 + sign * other.m0, self.m1 + sign * other.m1, self.m2 + sign * other.m2)


class Extra(Mechanism):
    """A mechanism beside the families. Every hook's default changes nothing.

    Class attributes:
        needs: what the model must have.
        geometry: it describes how a muscle is built, which is measured and not missing: no diagnosis looks for it, no
            fit moves its parameters unasked, and it has no `entry`.
    """

    family = Family.EXTRA
    needs: ClassVar[Needs] = Needs.NOTHING
    geometry: ClassVar[bool] = False

    def force(self, q: Quantities) -> Expr:
        """Force beside the contractile and the parallel element, F0."""
        return 0

    def inner_force(self, q: Quantities) -> Expr:
        """Force beside the heads within the half-sarcomeres, in series with the series element, power-stroke units."""
        return 0

    def inner_kinetics(self, q: Quantities) -> tuple[Expr, Expr]:
        """Rate of that force at constant length, 1/s, and its stiffness per power stroke."""
        return 0, 0

    def force_share(self, q: Quantities) -> tuple[Expr, Expr]:
        """Share of the heads' force that is borne at ``q.sarcomere_change``, and its change per L0 of that length."""
        return 1, 0

    @property
    def limits_force(self) -> bool:
        """Whether it has a `force_share` of its own."""
        return type(self).force_share is not Extra.force_share

    def modified(self, q: Quantities) -> Values:
        """Other values for parameters and inputs, by name; the model's blocks see these in place of their own."""
        return {}

    def overlap(self, q: Quantities) -> Expr:
        """Share of the available sites that heads can reach, 1 at rest length."""
        return 1

    def detachment(self, q: Quantities) -> tuple[StrainRate, ...]:
        """Further rates at which attached heads detach to the ready state."""
        return ()

    def head_force(self, q: Quantities, m: Moments) -> Expr:
        """What heads bear beyond Q0 + Q1, from their moments; linear in these, so that rates may stand for heads."""
        return 0


class Unit(NamedTuple):
    """One half-sarcomere's heads.

    Attributes:
        force: they bear, power-stroke units.
        force_rate: of that by attachment and detachment alone, 1/s.
        stiffness: force per power stroke.
    """

    force: Expr
    force_rate: Expr
    stiffness: Expr


class Chain(NamedTuple):
    """A chain of half-sarcomeres as the series element sees it, and how it shares out the movement.

    Attributes:
        force, force_rate, stiffness: of the chain; see `Unit`.
        own_velocity, other_velocity: of either half-sarcomere from that of the chain, power strokes/s.
        derivatives: rates of the mechanism's states from that velocity.
    """

    force: Expr
    force_rate: Expr
    stiffness: Expr
    own_velocity: Callable[[Expr], Expr]
    other_velocity: Callable[[Expr], Expr]
    derivatives: Callable[[Expr], Values]


class InSeries(Extra):
    """A mechanism that puts another half-sarcomere in series with the model's own.

    The other one has the same blocks; its states go by the same names with `PREFIX` before them.
    """

    PREFIX: ClassVar[str] = "other_"
    needs = Needs.HEADS

    @abstractmethod
    def apart(self, q: Quantities) -> Expr:
        """By how much the model's own half-sarcomere is longer than their mean, power strokes."""

    @abstractmethod
    def chain(self, q: Quantities, own: Unit, other: Unit) -> Chain:
        """Force balance of the chain."""
