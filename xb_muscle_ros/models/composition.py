"""A model as a row of blocks, and the one set of equations that they make together."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from xb_muscle_ros.distribution.base import Moments, Representation, Settling, Ways
from xb_muscle_ros.mechanisms.base import (
    Attachment,
    Detachment,
    Mechanism,
    Parallel,
    Parameter,
    Quantities,
    Series,
    State,
    ThickFilament,
    ThinFilament,
)
from xb_muscle_ros.mechanisms.ops import Expr

GAMMA = Parameter(
    "gamma", "power strokes/L0", "half-sarcomere length in power strokes (1.3 µm / 10 nm)", 1.0, 1e4, 130.0,
    "van der Zee et al. 2026",
)  # fmt: skip
FSCALE = Parameter(
    "Fscale", "F0", "fibre force per cross-bridge force: 1 / attached fraction at pCa 4.5", 1e-3, 1e3, 2.0,
    "van der Zee et al. 2026",
)  # fmt: skip
SMOOTHING = Parameter(
    "smoothing", "1", "sharpness K of the smooth functions the released sets were fitted with; 0 is exact", 0.0, 1e6,
    0.0, "as released (K = 100)",
)  # fmt: skip
COMMON = (GAMMA, FSCALE, SMOOTHING)

# Inputs are carried at the end of the state vector, so that a state tells all that the next step needs.
INPUTS = (
    State("length_change", "L0", "fibre length change relative to rest", -1.0, 10.0),
    State("velocity", "L0/s", "fibre velocity of the last step", -1e9, 1e9),
    State("calcium", "µM", "free calcium of the last step", 0.0, 1e6),
)
OUTPUTS = (
    "force_f0", "force_ce_f0", "force_pe_f0", "ce_length_change_l0", "ce_velocity_l0_per_s",
    "q0", "q1", "q2", "n_on", "drx", "r",
)  # fmt: skip


class Model(ABC):
    """Blocks and the one set of equations that they make: what stepping, files and node know of a model.

    Attributes:
        name: unique among generated modules.
    """

    name: str

    @property
    @abstractmethod
    def parameters(self) -> tuple[Parameter, ...]:
        """Rows of the parameter table that this model needs, without repeats."""

    @property
    @abstractmethod
    def states(self) -> tuple[State, ...]:
        """States that every copy of the model integrates, without the inputs."""

    def state_rows(self, values: Mapping[str, float]) -> tuple[State, ...]:
        """The integrated states with these parameter values, in order; a strain grid adds its bins."""
        return self.states

    @property
    def settling(self) -> Settling:
        """How a fibre is brought to rest."""
        return Representation.settling

    @abstractmethod
    def equations(self, smooth: bool) -> Equations:
        """Write the model out; `smooth` picks the released sets' smooth functions."""

    @abstractmethod
    def module_text(self, smooth: bool) -> str:
        """Text of the module that steps the model: see `models.codegen`."""


def distinct(rows: Iterable[Parameter]) -> tuple[Parameter, ...]:
    """Parameters without repeats, in order; blocks may share them."""
    found: dict[str, Parameter] = {}
    for row in rows:
        found.setdefault(row.name, row)
    return tuple(found.values())


@dataclass(frozen=True)
class Composition(Model):
    """One block of each family and a representation of the strain distribution."""

    name: str
    thin_filament: ThinFilament
    thick_filament: ThickFilament
    attachment: Attachment
    detachment: Detachment
    series: Series
    parallel: Parallel
    representation: Representation

    @property
    def blocks(self) -> tuple[Mechanism, ...]:
        """All blocks, in the order in which their states stand."""
        return (
            self.thin_filament,
            self.thick_filament,
            self.attachment,
            self.detachment,
            self.series,
            self.parallel,
        )

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Rows of the parameter table that this model needs, without repeats."""
        blocks = (p for block in self.blocks for p in block.parameters)
        return distinct((*blocks, *COMMON, *self.representation.parameters))

    @property
    def states(self) -> tuple[State, ...]:
        """States that are integrated, moments first, without the inputs."""
        return (*self.representation.states, *(s for block in self.blocks for s in block.states))

    def state_rows(self, values: Mapping[str, float]) -> tuple[State, ...]:
        """See the base class."""
        return self.representation.state_rows(self, values)

    @property
    def settling(self) -> Settling:
        """See the base class."""
        return self.representation.settling

    def equations(self, smooth: bool) -> Equations:
        """See the base class."""
        return equations(self, smooth)

    def module_text(self, smooth: bool) -> str:
        """See the base class."""
        return self.representation.module_text(self, smooth)


@dataclass(frozen=True)
class Equations:
    """A model written out in symbols.

    Attributes:
        states: integrated states, in the strain frame of the contractile element's present position.
        parameters: in the order of the parameter vector.
        symbols: the SymPy symbol of every state, input and parameter, by name.
        shift: the symbol of the contractile element's movement within a step, power strokes.
        derivatives: rates of the states in the frame that was fixed at the start of the step, then that of the
            shift, then that of the length change. In the fixed frame the movement of the heads with the contractile
            element is exact: only attachment and detachment change the moments.
        arrival: the states in the frame of the end of the step, from those in the fixed frame and the shift.
        rest: states of a fibre at rest without calcium.
        outputs: values of `OUTPUTS`, at zero shift.
        shares: names of moments that are divided by the first of them, and so must be right relative to it.
    """

    states: tuple[State, ...]
    parameters: tuple[Parameter, ...]
    symbols: Mapping[str, Any]
    shift: Any
    derivatives: tuple[Expr, ...]
    arrival: tuple[Expr, ...]
    rest: tuple[Expr, ...]
    outputs: tuple[Expr, ...]
    shares: tuple[str, ...] = ()


def equations(model: Composition, smooth: bool) -> Equations:
    """Write a composition out; `smooth` picks the released sets' smooth functions.

    Raises:
        AttributeError: a block asks for a quantity that no block provides; the message names both.
    """
    import sympy

    names = [*(s.name for s in model.states), *(i.name for i in INPUTS), *(p.name for p in model.parameters)]
    symbols = {name: sympy.Symbol(name, real=True) for name in names}
    shift = sympy.Symbol("shift", real=True)
    fixed = Moments(symbols["q0"], symbols["q1"], symbols["q2"])
    moved = _moved(fixed, shift)
    values = {**symbols, "q0": moved.m0, "q1": moved.m1, "q2": moved.m2}
    parts = rates(model, Quantities(values, "composition", symbols["smoothing"] if smooth else None))
    # In the frame fixed at the start of the step a head's strain is x - shift, whatever the velocity.
    in_fixed = _moved(parts.kinetics, -shift)
    others = [parts.others[s.name] for s in model.states[3:]]
    derivatives = [*in_fixed, *others, parts.q.ce_velocity, symbols["velocity"]]
    rest_q = Quantities(symbols, "composition", None)
    rest = [0, 0, 0]
    for block in model.blocks:
        rest += [block.rest(rest_q.for_block(block.name))[s.name] for s in block.states]
    return Equations(
        states=model.states,
        parameters=model.parameters,
        symbols=symbols,
        shift=shift,
        derivatives=tuple(sympy.sympify(e) for e in derivatives),
        arrival=tuple(sympy.sympify(e) for e in (*moved, *(symbols[s.name] for s in model.states[3:]))),
        rest=tuple(sympy.sympify(e) for e in rest),
        outputs=tuple(sympy.sympify(e).subs(shift, 0) for e in output_expressions(model, parts.q)),
        # The smooth form never divides by less than ln 2 / K heads.
        shares=() if smooth else ("q0", "q1", "q2"),
    )


def _moved(m: Moments, shift: Expr) -> Moments:
    """Moments about a point that lies `shift` lower: every strain has grown by `shift`."""
    return Moments(m.m0, m.m1 + shift * m.m0, m.m2 + 2 * shift * m.m1 + shift**2 * m.m0)


class Parts(NamedTuple):
    """What `rates` puts together.

    Attributes:
        kinetics: moments of the heads per second that come and go, at constant strain.
        others: rates of change of the blocks' own states, by name.
        ways: how heads come and go, in terms of strain.
        q: all quantities, ``ce_velocity`` among them.
    """

    kinetics: Moments
    others: Mapping[str, Expr]
    ways: Ways
    q: Quantities


def rates(model: Composition, q: Quantities) -> Parts:
    """Put the blocks together, from moments and states to rates of change and velocity.

    The order is fixed by who needs what: force and sites before heads, heads before fluxes, fluxes before velocity.
    """
    import sympy

    thin, thick, detach = model.thin_filament, model.thick_filament, model.detachment
    q = q.for_block(model.detachment.name, force_xb=q.q0 + q.q1)
    q = q.for_block(thin.name, forcibly_detached=detach.forcibly_detached(q))
    q = q.for_block(thick.name, available_sites=thin.available_sites(q))
    q = q.for_block(model.attachment.name, ready_heads=thick.ready_heads(q))
    of_detachment = q.for_block(detach.name)
    ways = Ways(
        attach=model.attachment.spread(q),
        detach=detach.rates(of_detachment),
        tear=detach.forcible_rates(of_detachment),
        reattach=detach.reattachment(of_detachment),
    )
    kinetics, torn, back = model.representation.fluxes(q, ways)
    others: dict[str, Expr] = {}
    others.update(detach.derivatives(q.for_block(detach.name, torn_off=torn, reattached=back)))
    others.update(thin.derivatives(q.for_block(thin.name)))
    # Heads between attached and torn off stay out of the thick filament's balance: dQ0 + dR.
    net = kinetics.m0 + torn - back
    others.update(thick.derivatives(q.for_block(thick.name, attachment_rate_net=net)))
    stiffness = sympy.sympify(q.q0)
    force_rate = kinetics.m0 + kinetics.m1
    q = q.for_block(model.series.name, kinetic_force_rate=force_rate, stiffness_xb=stiffness)
    q = q.for_block("composition", ce_velocity=model.series.ce_velocity(q))
    return Parts(kinetics, others, ways, q)


def output_expressions(model: Composition, q: Quantities) -> list[Expr]:
    """Expressions of `OUTPUTS`."""
    extension = model.series.extension(q.for_block(model.series.name))
    force_pe = model.parallel.force(q.for_block(model.parallel.name))
    force_ce = q.Fscale * q.force_xb
    return [
        force_ce + force_pe,
        force_ce,
        force_pe,
        q.length_change - extension / q.gamma,
        q.ce_velocity / q.gamma,
        q.q0,
        q.q1,
        q.q2,
        q.available_sites,
        q.ready_heads,
        q.forcibly_detached,
    ]
