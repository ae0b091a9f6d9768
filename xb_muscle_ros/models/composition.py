"""A model as a row of blocks; `models.assembly` makes one set of equations of them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from xb_muscle_ros.distribution.base import Representation, Settling
from xb_muscle_ros.distribution.gaussian import Gaussian
from xb_muscle_ros.mechanisms import (
    Attachment,
    Detachment,
    Expr,
    Extra,
    Family,
    InSeries,
    Mechanism,
    Parallel,
    Parameter,
    Series,
    State,
    ThickFilament,
    ThinFilament,
)

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


class Outputs(NamedTuple):
    """What a fibre shows at one moment; van der Zee et al. 2026.

    Attributes:
        force_f0: force of the fibre, F0.
        force_ce_f0: of the contractile element, F0.
        force_pe_f0: of the parallel element, F0.
        ce_length_change_l0: length change of the contractile element relative to rest, L0.
        ce_velocity_l0_per_s: its velocity, L0/s; positive lengthens.
        q0: attached heads, as a share of all; the moment of order 0 of the distribution of strain.
        q1: moment of order 1, power strokes.
        q2: moment of order 2, power strokes squared.
        n_on: available binding sites of the thin filament, as a share of all.
        drx: heads that are detached and disordered-relaxed, ready to attach, as a share of all.
        r: forcibly detached heads, as a share of all.
    """

    force_f0: float
    force_ce_f0: float
    force_pe_f0: float
    ce_length_change_l0: float
    ce_velocity_l0_per_s: float
    q0: float
    q1: float
    q2: float
    n_on: float
    drx: float
    r: float


OUTPUTS = Outputs._fields


class Model(ABC):
    """Blocks and the one set of equations that they make: what stepping, files and node know of a model.

    Attributes:
        name: unique among generated modules.
    """

    name: str

    @property
    @abstractmethod
    def blocks(self) -> tuple[Mechanism, ...]:
        """All blocks, in the order in which their states stand."""

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Rows of the parameter table that this model needs, without repeats."""
        return distinct((*(p for block in self.blocks for p in block.parameters), *COMMON))

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

    def symbols(self, *further: str) -> dict[str, Any]:
        """SymPy symbols of states, inputs and parameters, and of further names."""
        import sympy

        names = [*(s.name for s in (*self.states, *INPUTS)), *(p.name for p in self.parameters), *further]
        return {name: sympy.Symbol(name, real=True) for name in names}

    @abstractmethod
    def evaluated(self, values: Mapping[str, float]) -> dict[str, float]:
        """Rates of the states and outputs, without smoothing, as the blocks' formulas give them with plain numbers.

        Args:
            values: of states, inputs and parameters, by name.
        """

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
    """One block of each family, further mechanisms, and a representation of the strain distribution."""

    name: str
    thin_filament: ThinFilament
    thick_filament: ThickFilament
    attachment: Attachment
    detachment: Detachment
    series: Series
    parallel: Parallel
    representation: Representation
    extras: tuple[Extra, ...] = ()

    @property
    def families(self) -> tuple[Mechanism, ...]:
        """The blocks of the families, in the order in which their states stand."""
        return (
            self.thin_filament,
            self.thick_filament,
            self.attachment,
            self.detachment,
            self.series,
            self.parallel,
        )

    @property
    def blocks(self) -> tuple[Mechanism, ...]:
        """All blocks, in the order in which their states stand."""
        return (*self.families, *self.extras)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Those of the representation come last."""
        return distinct((*super().parameters, *self.representation.parameters))

    @property
    def states(self) -> tuple[State, ...]:
        """States that are integrated, moments first, without the inputs."""
        own = (*self.representation.states, *(s for block in self.blocks for s in block.states))
        return (*own, *(row for row, _ in other_states(self)))

    def state_rows(self, values: Mapping[str, float]) -> tuple[State, ...]:
        return self.representation.state_rows(self.states, values)

    @property
    def settling(self) -> Settling:
        """See the base class; half-sarcomeres creep against each other for seconds, which needs no such small steps."""
        settling = self.representation.settling
        return settling if self.in_series is None else settling._replace(tolerance=1e-6)

    @property
    def in_series(self) -> InSeries | None:
        """The mechanism that puts another half-sarcomere in series, if there is one."""
        return next((extra for extra in self.extras if isinstance(extra, InSeries)), None)

    def evaluated(self, values: Mapping[str, float]) -> dict[str, float]:
        from xb_muscle_ros.models.assembly import evaluated

        return evaluated(self, values)

    def equations(self, smooth: bool) -> Equations:
        from xb_muscle_ros.models.assembly import equations

        return equations(self, smooth)

    def module_text(self, smooth: bool) -> str:
        """See the base class: one flat right-hand side, or scalar parts as expressions and bins in loops."""
        remap = self.representation.remap
        if remap is None:
            from xb_muscle_ros.models.codegen import flat_module

            return flat_module(self, smooth)
        from xb_muscle_ros.models.grid_codegen import grid_module

        return grid_module(self, smooth, remap)


# Moments of the other half-sarcomere are integrated about a moving point, where an error within the tolerance may carry
# a vanishing second moment below zero.
_LEAST_Q2 = -1e-2


def other_states(model: Composition) -> list[tuple[State, str]]:
    """States of the half-sarcomere in series with the model's own, each with the name it has in that one."""
    if model.in_series is None:
        return []
    within = (block for block in model.families if block.family not in (Family.SERIES, Family.PARALLEL))
    rows = [*Gaussian.states, *(s for block in within for s in block.states)]
    found = []
    for row in rows:
        lower = _LEAST_Q2 if row.name == "q2" else row.lower
        found.append((row._replace(name=f"{InSeries.PREFIX}{row.name}", lower=lower), row.name))
    return found


@dataclass(frozen=True, kw_only=True)
class Written:
    """A model written out in symbols.

    Attributes:
        states: those that are symbols.
        parameters: in the order of the parameter vector.
        symbols: the SymPy symbol of every state, input and parameter, by name.
        derivatives: rates of the states, then that of the shift: the contractile element's movement within a step.
        rest: states of a fibre at rest without calcium.
        outputs: values of `OUTPUTS`.
    """

    states: tuple[State, ...]
    parameters: tuple[Parameter, ...]
    symbols: Mapping[str, Any]
    derivatives: Sequence[Expr]
    rest: Sequence[Expr]
    outputs: Sequence[Expr]

    def __post_init__(self) -> None:
        """Make plain numbers among the expressions SymPy's."""
        import sympy

        for name in ("derivatives", "rest", "outputs"):
            object.__setattr__(self, name, tuple(sympy.sympify(e) for e in getattr(self, name)))


@dataclass(frozen=True, kw_only=True)
class Equations(Written):
    """A model whose every state is a symbol, in the strain frame of the contractile element's present position.

    Rates are those in the frame that was fixed at the start of the step; behind that of the shift stands that of the
    length change. In the fixed frame the movement of the heads with the contractile element is exact: only attachment
    and detachment change the moments. Outputs are those at zero shift.

    Attributes:
        shift: the symbol of the contractile element's movement within a step, power strokes.
        arrival: the states in the frame of the end of the step, from those in the fixed frame and the shift.
        shares: names of moments that are divided by the first of them, and so must be right relative to it.
    """

    shift: Any
    arrival: Sequence[Expr]
    shares: tuple[str, ...] = ()

    @property
    def follows_length(self) -> bool:
        """Whether rates depend on the length change itself and not on its velocity alone."""
        length = self.symbols["length_change"]
        return any(length in rate.free_symbols for rate in self.derivatives[:-1])
