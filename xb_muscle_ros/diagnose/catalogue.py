"""What a diagnosis may put into a model: each mechanism's parameters, where to start them, what to expect of them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from xb_muscle_ros.diagnose.names import Name
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.fit.coordinates import Coordinate
from xb_muscle_ros.models.parameters import PARAMETERS
from xb_muscle_ros.models.registry import split_set, with_mechanisms

Starts = tuple[Mapping[str, float], ...]


@dataclass(frozen=True)
class Entry:
    """One mechanism as a candidate.

    Attributes:
        name: of the mechanism.
        effect: parameter that is 0 where the mechanism is absent; None where its absence is another model.
        size: of the effect to expect, in its unit; standard deviation of its prior.
        shape: further parameters that are fitted, each with the factor (as a logarithm) by which it is expected to
            vary, or for a parameter that may be negative its standard deviation.
        starts: values that the parameters may start from; every one is tried.
        start_from: such values from those of the base model, where they depend on them.
        reach: largest effect that is still this mechanism, in units of `size`.
    """

    name: Name
    effect: str | None
    size: float = 1.0
    shape: Mapping[str, float] = field(default_factory=dict)
    starts: Starts = ({},)
    start_from: Callable[[Mapping[str, float]], Starts] | None = None
    reach: float = 30.0

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of all parameters that are fitted for it."""
        return (*((self.effect,) if self.effect else ()), *self.shape)

    def starting_values(self, base: Mapping[str, float]) -> Starts:
        """Values to start from in a model with the base's values."""
        return self.starts if self.start_from is None else self.start_from(base)

    def coordinates(self, values: Mapping[str, float]) -> tuple[Coordinate, ...]:
        """Coordinates of the mechanism's parameters, started at some values.

        The effect is moved on a linear scale, so that its interval can hold 0.
        """
        found = []
        for name in self.parameters:
            row, start = PARAMETERS[name], float(values[name])
            if name == self.effect:
                lower = max(row.lower, -self.reach * self.size) if row.lower < 0.0 else 0.0
                upper = min(row.upper, self.reach * self.size)
                found.append(Coordinate(name, None, False, lower, upper, start, 0.0, self.size))
            elif row.lower < 0.0:
                sd = self.shape[name]
                low, high = max(row.lower, start - 4.0 * sd), min(row.upper, start + 4.0 * sd)
                found.append(Coordinate(name, None, False, low, high, start, start, sd))
            else:
                sd = self.shape[name]
                low = max(row.lower, start * math.exp(-3.0 * sd), 1e-12)
                high = min(row.upper, start * math.exp(3.0 * sd))
                found.append(Coordinate(name, None, True, low, high, start, math.log(start), sd))
        return tuple(found)


def _of_sigmoid(base: Mapping[str, float]) -> Starts:
    """Cooperative filaments that are half active where the sigmoid is, at several strengths of cooperativity."""
    kappa = base.get("kappa", 1.0)
    return tuple(
        {"kon": koff * half / kappa, "koop": koop, "koff": koff}
        for koff, koop, half in ((80.0, 1.0, 0.7), (20.0, 3.0, 0.5), (10.0, 10.0, 0.3))
    )


def _of_always_on(base: Mapping[str, float]) -> Starts:
    """Thick filaments that force switches on; more attachment makes up for the heads that are super-relaxed."""
    return tuple({"JF": jf, "f": base.get("f", 50.0) * more} for jf, more in ((30.0, 2.0), (200.0, 2.0), (1000.0, 1.1)))


_ROWS = (
    Entry(Name.VISCOUS_DRAG, "drag", 0.02, starts=({"drag": 0.01},)),
    Entry(
        Name.PASSIVE_VISCOELASTICITY,
        "pv_stiffness",
        2.0,
        {"pv_tau": 1.5, "pv_ratio": 0.7},
        tuple({"pv_stiffness": 0.5, "pv_tau": tau, "pv_ratio": 0.3} for tau in (0.005, 0.03, 0.2, 1.0)),
    ),
    Entry(
        Name.WEAKLY_BOUND_HEADS,
        "weak_stiffness",
        20.0,
        {"weak_detachment": 1.0},
        tuple({"weak_stiffness": 0.02 * rate, "weak_detachment": rate} for rate in (100.0, 400.0, 1500.0)),
        reach=100.0,
    ),
    Entry(
        Name.ACTIVE_TITIN,
        "titin_stiffness",
        2.0,
        {"titin_calcium": 0.7, "titin_hill": 0.5, "titin_rebinding": 1.0},
        tuple({"titin_stiffness": 1.0, "titin_calcium": half} for half in (0.3, 1.0, 4.0)),
    ),
    Entry(
        Name.STATIC_CALCIUM_STIFFNESS,
        "calcium_stiffness",
        2.0,
        {"stiffness_calcium": 0.7, "stiffness_hill": 0.5},
        tuple({"calcium_stiffness": 1.0, "stiffness_calcium": half} for half in (0.3, 1.0, 4.0)),
    ),
    Entry(Name.LENGTH_DEPENDENT_ACTIVATION, "calcium_per_length", 3.0, starts=({"calcium_per_length": 1.5},)),
    Entry(Name.LATTICE_SPACING, "attachment_per_length", 3.0, starts=({"attachment_per_length": 1.5},)),
    Entry(
        Name.FILAMENT_OVERLAP,
        "overlap_per_length",
        3.0,
        {"overlap_edge": 0.02},
        tuple({"overlap_per_length": -1.5, "overlap_edge": edge} for edge in (-0.06, -0.01)),
    ),
    Entry(Name.STRAIN_RECRUITED_HEADS, "strain_recruitment", 150.0, starts=({"strain_recruitment": 60.0},)),
    Entry(
        Name.FORCIBLE_DETACHMENT,
        "k",
        1000.0,
        {"dLcrit": 0.7},
        tuple({"k": 500.0, "dLcrit": critical, "b": 1000.0} for critical in (0.7, 1.5, 2.5)),
    ),
    Entry(Name.NONLINEAR_CROSSBRIDGE, "head_curvature", 0.1, starts=({"head_curvature": 0.05},), reach=5.0),
    Entry(
        Name.HALF_SARCOMERE_SPREAD,
        "hs_spread",
        0.1,
        {"hs_stiffness": 1.0},
        tuple({"hs_spread": s, "hs_stiffness": k} for s, k in ((0.03, 0.0005), (0.08, 0.003), (0.1, 0.03))),
        reach=6.0,
    ),
    Entry(
        Name.SERIES_COMPLIANCE,
        None,
        shape={"kse": 1.0, "kse0": 1.0},
        starts=({"kse": 0.3, "kse0": 0.1}, {"kse": 1.0, "kse0": 0.1}),
    ),
    Entry(Name.THIN_FILAMENT_COOPERATIVITY, None, shape={"kon": 1.0, "koff": 1.0, "koop": 1.0}, start_from=_of_sigmoid),
    Entry(Name.THICK_FILAMENT_COOPERATIVITY, None, shape={"JF": 1.5}, start_from=_of_always_on),
    Entry(Name.TEMPERATURE, "warmer", 3.0, starts=({"warmer": 2.0},), reach=5.0),
    Entry(Name.PHOSPHATE, "phosphate_detachment", 5.0, starts=({"phosphate_detachment": 2.0},)),
)

CATALOGUE: Mapping[Name, Entry] = MappingProxyType({row.name: row for row in _ROWS})
"""Every mechanism as a candidate."""


def applicable(model: str) -> tuple[Entry, ...]:
    """Mechanisms that can be put into a model; the others are part of it, or have nothing to act on."""
    found = []
    for entry in _ROWS:
        try:
            split_set(with_mechanisms(model, entry.name.value))
        except UserError:
            continue
        found.append(entry)
    return tuple(found)
