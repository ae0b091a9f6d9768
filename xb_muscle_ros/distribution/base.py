"""How attached heads are distributed over strain: what a representation gives to the composition."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar, NamedTuple

from xb_muscle_ros.mechanisms.base import GaussianSpread, Quantities, State, StrainRate
from xb_muscle_ros.mechanisms.ops import Expr


class Moments(NamedTuple):
    """Zeroth to second moment over strain: of heads, or of a flux of heads (1/s)."""

    m0: Expr
    m1: Expr
    m2: Expr

    def plus(self, other: Moments, sign: int = 1) -> Moments:
        """Sum, or difference with sign -1."""
        return Moments(self.m0 + sign * other.m0, self.m1 + sign * other.m1, self.m2 + sign * other.m2)


ZERO = Moments(0, 0, 0)


class MomentRepresentation(ABC):
    """A distribution that is known by its moments alone."""

    name: ClassVar[str]
    states: ClassVar[tuple[State, ...]]

    @abstractmethod
    def outflow(self, q: Quantities, rate: StrainRate) -> Moments:
        """Moments of the heads per second that leave at a strain-dependent rate."""

    def inflow(self, spread: GaussianSpread) -> Moments:
        """Moments of heads that attach, normally distributed around strain 0."""
        return Moments(spread.rate, 0, spread.rate * spread.width**2)
