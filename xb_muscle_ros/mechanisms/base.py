"""What a mechanism is: a block of physics with parameters, states and the few hooks that its family has.

A model is one block of each family. A family's null block supplies the same quantities as the real ones, so that no
other code asks whether a mechanism is there. Blocks are written in symbols (see `ops`), know nothing of how heads are
distributed over strain, of steppers, or of ROS.
"""

from __future__ import annotations

import enum
from abc import ABC
from collections.abc import Mapping
from typing import ClassVar, NamedTuple, TypeAlias

from xb_muscle_ros.mechanisms.entry import Entry
from xb_muscle_ros.mechanisms.ops import Expr
from xb_muscle_ros.mechanisms.quantities import Quantities

Values: TypeAlias = Mapping[str, Expr]
"""Expressions by the name of a state, a parameter or an input."""


class Family(enum.Enum):
    """The slots of a model; `EXTRA` takes any number of blocks."""

    THIN_FILAMENT = "thin_filament"
    THICK_FILAMENT = "thick_filament"
    ATTACHMENT = "attachment"
    DETACHMENT = "detachment"
    SERIES = "series"
    PARALLEL = "parallel"
    EXTRA = "extra"
    ACTIVATION = "activation"
    FORCE_VELOCITY = "force_velocity"


class Parameter(NamedTuple):
    """One row of the parameter table.

    Attributes:
        name: as in fibre files and the field's papers.
        unit: SI or the model's own (F0, L0, power strokes); ``1`` for a pure number.
        meaning: what it does, in a line.
        lower: least allowed value.
        upper: largest allowed value.
        default: value where a fibre file does not give one; None where it must be given.
        source: where the meaning or the default comes from.
    """

    name: str
    unit: str
    meaning: str
    lower: float
    upper: float
    default: float | None
    source: str


class State(NamedTuple):
    """A state that a block adds to the model.

    Attributes:
        name: as in outputs and messages.
        unit: see `Parameter`.
        meaning: in a line.
        lower: physical lower bound.
        upper: physical upper bound.
        blur: how far, in 1/K, the equations with smooth functions themselves carry the state past its bounds.
    """

    name: str
    unit: str
    meaning: str
    lower: float
    upper: float
    blur: float = 0.0


class ExponentialRate(NamedTuple):
    """A detachment rate ``scale * exp(slope * x)`` in 1/s, x in power strokes."""

    scale: Expr
    slope: Expr


class StepRate(NamedTuple):
    """A detachment rate in 1/s that sets in at a strain.

    Over a distribution ``height (1 + tanh(steepness (x - threshold)))/2``, x and threshold in power strokes, steepness
    per power stroke. The closed moments know its sharp limit only: ``height`` above the threshold, nothing below.
    """

    height: Expr
    threshold: Expr
    steepness: Expr


# The kinds of strain dependence; a representation knows the moments of each.
StrainRate = ExponentialRate | StepRate


class GaussianSpread(NamedTuple):
    """Heads per second that attach, normally distributed over strain around 0 with standard deviation ``width``."""

    rate: Expr
    width: Expr


class Mechanism(ABC):
    """A block of physics.

    Class attributes:
        name: unique within the family, as in the registry.
        family: the slot it fills.
        parameters: rows of the parameter table that it needs.
        states: states that it adds.
        suffix: of the names of models that have it in place of their own block, ``3state_coop_rigid``; empty: none.
        entry: what a fit and a diagnosis know of it; None: it is no mechanism that a model's name may add with ``+``.
    """

    name: ClassVar[str]
    family: ClassVar[Family]
    parameters: ClassVar[tuple[Parameter, ...]] = ()
    states: ClassVar[tuple[State, ...]] = ()
    suffix: ClassVar[str] = ""
    entry: ClassVar[Entry | None] = None

    def __init_subclass__(cls) -> None:
        """A block made of another one is no variant and no mechanism of that one's name."""
        cls.suffix, cls.entry = vars(cls).get("suffix", ""), vars(cls).get("entry")

    def rest(self, q: Quantities) -> Values:
        """Values of the block's states in a fibre at rest without calcium; parameters only."""
        return {state.name: 0.0 for state in self.states}

    def derivatives(self, q: Quantities) -> Values:
        """Rates of change of the block's states, 1/s.

        Among the names of `q` are, for a thick filament, ``attachment_rate_net`` (dQ0 + dR by cross-bridge kinetics),
        for detachment ``torn_off`` and ``reattached`` (heads per second), for the series element and for mechanisms
        beside the families ``ce_velocity`` (power strokes/s).
        """
        return {}
