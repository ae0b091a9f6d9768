"""How attached heads are distributed over strain: what a representation gives to the composition."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import ClassVar, NamedTuple

from xb_muscle_ros.mechanisms import Expr, GaussianSpread, Moments, Parameter, Quantities, State, StrainRate


class Ways(NamedTuple):
    """The ways heads come and go, in terms of strain.

    Attributes:
        attach: of ready heads.
        detach: to the ready state.
        tear: to the forcibly detached state.
        reattach: back from it.
    """

    attach: GaussianSpread
    detach: tuple[StrainRate, ...]
    tear: tuple[StrainRate, ...]
    reattach: tuple[GaussianSpread, ...]


class Fluxes(NamedTuple):
    """What the ways amount to, in heads per second.

    Attributes:
        kinetics: moments of all that comes less all that goes, at constant strain.
        torn_off: heads that go to the forcibly detached state.
        reattached: heads that come back from it.
    """

    kinetics: Moments
    torn_off: Expr
    reattached: Expr


class Settling(NamedTuple):
    """How a fibre is brought to rest isometrically with the method's own steps.

    Attributes:
        rate: at rest, no state changes faster than this, 1/s.
        step_s: fixed step, s; None: variable steps of any size.
        tolerance: error of a variable step, in units of the states.
    """

    rate: float
    step_s: float | None
    tolerance: float = 1e-8


class Representation(ABC):
    """A way to carry the distribution of attached heads over strain.

    Attributes:
        name: as in the registry.
        parameters: rows of the parameter table that belong to the method.
        states: of a fixed number of states; a grid's bins are not among them.
        settling: see `Settling`.
        remap: how bins are brought back after a step: see `models.grid_codegen`; None: there are none, and everything
            is an expression of the states.
    """

    name: ClassVar[str]
    parameters: ClassVar[tuple[Parameter, ...]] = ()
    states: ClassVar[tuple[State, ...]] = ()
    settling: ClassVar[Settling] = Settling(rate=1e-9, step_s=None)
    remap: ClassVar[str | None] = None

    @abstractmethod
    def fluxes(self, q: Quantities, ways: Ways) -> Fluxes:
        """Heads per second by the ways of the model."""

    def state_rows(self, states: tuple[State, ...], values: Mapping[str, float]) -> tuple[State, ...]:
        """The integrated states with these parameter values, in order, of a model with such states of its own."""
        return states


class MomentRepresentation(Representation):
    """A distribution that is known by its moments alone."""

    @abstractmethod
    def outflow(self, q: Quantities, rate: StrainRate) -> Moments:
        """Moments of the heads per second that leave at a strain-dependent rate."""

    def inflow(self, spread: GaussianSpread) -> Moments:
        """Moments of heads that attach, normally distributed around strain 0."""
        return Moments(spread.rate, 0, spread.rate * spread.width**2)

    def fluxes(self, q: Quantities, ways: Ways) -> Fluxes:
        """Sums of the ways' moments."""
        torn = back = Moments(0, 0, 0)
        for rate in ways.tear:
            torn = torn.plus(self.outflow(q, rate))
        for spread in ways.reattach:
            back = back.plus(self.inflow(spread))
        kinetics = self.inflow(ways.attach).plus(torn, -1).plus(back)
        for rate in ways.detach:
            kinetics = kinetics.plus(self.outflow(q, rate), -1)
        return Fluxes(kinetics, torn.m0, back.m0)
