"""What a mechanism is: a block of physics with parameters, states and the few hooks that its family has.

A model is one block of each family. A family's null block supplies the same quantities as the real ones, so that no
other code asks whether a mechanism is there. Blocks are written in symbols (see `ops`), know nothing of how heads are
distributed over strain, of steppers, or of ROS.
"""

from __future__ import annotations

import enum
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from typing import ClassVar, NamedTuple

from xb_muscle_ros.mechanisms.ops import Expr


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


class Quantities:
    """What a block may ask for, by name: its parameters, the states of all blocks, inputs, and provided quantities.

    Names that exist in every cross-bridge model: ``calcium`` (µM), ``velocity`` (L0/s), ``length_change`` (L0),
    ``sarcomere_change`` (L0, that of the half-sarcomeres: without the series element's), ``q0 q1 q2`` (moments),
    ``force_xb`` (cross-bridge force, power-stroke units), ``forcibly_detached`` (R), ``available_sites`` (N),
    ``ready_heads`` (D), ``gamma``, and ``recruitment`` (what brings super-relaxed heads into play beside force; 0
    unless a mechanism says otherwise).

    ``positive``, ``divisor``, ``variance`` and ``limit`` are the places where the released parameter sets were fitted
    with smooth functions; without smoothing they are exact.
    """

    # Fewer attached heads than this fraction carry no force worth a digit, and are less than the error of a fixed step;
    # it keeps Q1/Q0 defined at rest, and where a quick movement has taken all heads off and left rounding behind.
    EMPTY = 1e-7

    def __init__(self, values: Mapping[str, Expr], block: str, smoothing: Expr | None) -> None:
        self._values = dict(values)
        self._block = block
        self._smoothing = smoothing

    def __getattr__(self, name: str) -> Expr:
        """A quantity by name; fails with the block's and the quantity's name."""
        if name.startswith("_"):
            raise AttributeError(name)
        try:
            return self._values[name]
        except KeyError:
            raise AttributeError(
                f"mechanism {self._block} asks for '{name}', which no block of this model provides; "
                f"there are {', '.join(sorted(self._values))}"
            ) from None

    def __contains__(self, name: str) -> bool:
        """Whether the model has a quantity of this name."""
        return name in self._values

    def for_block(self, block: str, **more: Expr) -> Quantities:
        """The same quantities and some more, in the hands of another block."""
        return Quantities({**self._values, **more}, block, self._smoothing)

    @property
    def smooth(self) -> bool:
        """Whether the smooth functions of the released sets stand in for the exact ones."""
        return self._smoothing is not None

    def positive(self, z: Expr) -> Expr:
        """Positive part, or its softplus."""
        from xb_muscle_ros.mechanisms import ops

        return ops.positive(z) if self._smoothing is None else ops.softplus(z, self._smoothing)

    def divisor(self, q0: Expr) -> Expr:
        """Attached fraction as a divisor: never less than `EMPTY`, and within (EMPTY/Q0)²/2 of itself above."""
        from xb_muscle_ros.mechanisms import ops

        if self._smoothing is None:
            return ops.sqrt(ops.positive(q0) ** 2 + self.EMPTY**2)
        return ops.softplus(q0, self._smoothing)

    def variance(self, z: Expr) -> Expr:
        """Variance of the strain distribution."""
        from xb_muscle_ros.mechanisms import ops

        return z if self._smoothing is None else ops.softplus(z, self._smoothing)

    def limit(self, exponent: Expr) -> Expr:
        """Exponent of a detachment moment, limited to ±10 in the released sets.

        Exact ones level off above 12. A rate grows 160,000-fold until then, and heads are gone within a microsecond
        either way; without any limit a quick release pulls them into a singularity that no step size resolves: the
        fewer are left the more strain is theirs, and the faster they go.
        """
        from xb_muscle_ros.mechanisms import ops

        return ops.limited(exponent) if self._smoothing is None else 10 * ops.tanh(exponent / 10)


class Mechanism(ABC):
    """A block of physics.

    Class attributes:
        name: unique within the family, as in the registry.
        family: the slot it fills.
        parameters: rows of the parameter table that it needs.
        states: states that it adds.
    """

    name: ClassVar[str]
    family: ClassVar[Family]
    parameters: ClassVar[tuple[Parameter, ...]] = ()
    states: ClassVar[tuple[State, ...]] = ()

    def rest(self, q: Quantities) -> Mapping[str, Expr]:
        """Values of the block's states in a fibre at rest without calcium; parameters only."""
        return {state.name: 0.0 for state in self.states}


class ThinFilament(Mechanism):
    """Makes binding sites available."""

    family = Family.THIN_FILAMENT

    @abstractmethod
    def available_sites(self, q: Quantities) -> Expr:
        """Fraction N of sites where heads can attach (those with a head bound included)."""

    @abstractmethod
    def derivatives(self, q: Quantities) -> Mapping[str, Expr]:
        """Rates of change of the block's states, 1/s."""


class ThickFilament(Mechanism):
    """Makes myosin heads ready (disordered-relaxed, DRX)."""

    family = Family.THICK_FILAMENT

    @abstractmethod
    def ready_heads(self, q: Quantities) -> Expr:
        """Fraction D of heads that are detached and able to attach."""

    @abstractmethod
    def derivatives(self, q: Quantities) -> Mapping[str, Expr]:
        """Rates of change, 1/s; ``q.attachment_rate_net`` is dQ0 + dR by cross-bridge kinetics."""


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

    def derivatives(self, q: Quantities) -> Mapping[str, Expr]:
        """Rates of change, 1/s; ``q.torn_off`` and ``q.reattached`` are in heads per second."""
        return {}


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
    derivatives: Mapping[str, Expr]


class Series(Mechanism):
    """What lies between the contractile element and the end of the fibre.

    Cross-bridges carry the force in their states: `ce_velocity` and `extension` follow from it. Where the contractile
    element has no such state, the series element's own length is one (`length_states`), and `balance` applies. A block
    whose length does not follow from force has it among its `states`, and says `force` and `derivatives`.
    """

    family = Family.SERIES
    length_states: ClassVar[tuple[State, ...]] = ()

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

    def derivatives(self, q: Quantities) -> Mapping[str, Expr]:
        """Rates of change of its states; ``q.ce_velocity`` (power strokes/s) is among the names."""
        return {}

    @abstractmethod
    def balance(self, q: Quantities, element: Contractile) -> Balance:
        """Force and velocity of a contractile element without states of its own."""


class Parallel(Mechanism):
    """What bears force beside the cross-bridges."""

    family = Family.PARALLEL

    @abstractmethod
    def force(self, q: Quantities) -> Expr:
        """Force at ``q.length_change``, F0."""
