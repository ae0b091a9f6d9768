"""Mechanisms that can be put into a model, as a fit or a diagnosis sees them: parameters, starts, expected sizes.

One catalogue for both, so that a fit of ``3state_coop+viscous_drag`` begins where a diagnosis would.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from xb_muscle_ros.models.registry import EXTRAS, SEPARATOR

Starts = tuple[Mapping[str, float], ...]


@dataclass(frozen=True)
class Entry:
    """One mechanism.

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

    name: str
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
    Entry("viscous_drag", "drag", 0.02, starts=({"drag": 0.01},)),
    Entry(
        "passive_viscoelasticity",
        "pv_stiffness",
        2.0,
        {"pv_tau": 1.5, "pv_ratio": 0.7},
        tuple({"pv_stiffness": 0.5, "pv_tau": tau, "pv_ratio": 0.3} for tau in (0.005, 0.03, 0.2, 1.0)),
    ),
    Entry(
        "weakly_bound_heads",
        "weak_stiffness",
        20.0,
        {"weak_detachment": 1.0},
        tuple({"weak_stiffness": 0.02 * rate, "weak_detachment": rate} for rate in (100.0, 400.0, 1500.0)),
        reach=100.0,
    ),
    Entry(
        "active_titin",
        "titin_stiffness",
        2.0,
        {"titin_calcium": 0.7, "titin_hill": 0.5, "titin_rebinding": 1.0},
        tuple({"titin_stiffness": 1.0, "titin_calcium": half} for half in (0.3, 1.0, 4.0)),
    ),
    Entry(
        "static_calcium_stiffness",
        "calcium_stiffness",
        2.0,
        {"stiffness_calcium": 0.7, "stiffness_hill": 0.5},
        tuple({"calcium_stiffness": 1.0, "stiffness_calcium": half} for half in (0.3, 1.0, 4.0)),
    ),
    Entry("length_dependent_activation", "calcium_per_length", 3.0, starts=({"calcium_per_length": 1.5},)),
    Entry("lattice_spacing", "attachment_per_length", 3.0, starts=({"attachment_per_length": 1.5},)),
    Entry(
        "filament_overlap",
        "overlap_per_length",
        3.0,
        {"overlap_edge": 0.02},
        tuple({"overlap_per_length": -1.5, "overlap_edge": edge} for edge in (-0.06, -0.01)),
    ),
    Entry("persistent_thick_filament", "thick_persistence", 2.0, starts=({"thick_persistence": 2.0},), reach=4.0),
    Entry(
        "filament_friction",
        "friction_force",
        0.4,
        {"friction_way": 0.7, "friction_release": 1.5},
        tuple({"friction_force": 0.3, "friction_way": 0.007, "friction_release": rate} for rate in (8.0, 45.0)),
    ),
    Entry("strain_recruited_heads", "strain_recruitment", 150.0, starts=({"strain_recruitment": 60.0},)),
    Entry(
        "forcible_detachment",
        "k",
        1000.0,
        {"dLcrit": 0.7},
        tuple({"k": 500.0, "dLcrit": critical, "b": 1000.0} for critical in (0.7, 1.5, 2.5)),
    ),
    Entry("nonlinear_crossbridge", "head_curvature", 0.1, starts=({"head_curvature": 0.05},), reach=5.0),
    Entry(
        "half_sarcomere_spread",
        "hs_spread",
        0.1,
        {"hs_stiffness": 1.0},
        tuple({"hs_spread": s, "hs_stiffness": k} for s, k in ((0.03, 0.0005), (0.08, 0.003), (0.1, 0.03))),
        reach=6.0,
    ),
    Entry(
        "series_compliance",
        None,
        shape={"kse": 1.0, "kse0": 1.0},
        starts=({"kse": 0.3, "kse0": 0.1}, {"kse": 1.0, "kse0": 0.1}),
    ),
    Entry("thin_filament_cooperativity", None, shape={"kon": 1.0, "koff": 1.0, "koop": 1.0}, start_from=_of_sigmoid),
    Entry("thick_filament_cooperativity", None, shape={"JF": 1.5}, start_from=_of_always_on),
    Entry("temperature", "warmer", 3.0, starts=({"warmer": 2.0},), reach=5.0),
    Entry("phosphate", "phosphate_detachment", 5.0, starts=({"phosphate_detachment": 2.0},)),
)

CATALOGUE: Mapping[str, Entry] = MappingProxyType({row.name: row for row in _ROWS})
"""Every mechanism of the registry by name."""


def mechanisms_of(name: str) -> tuple[Entry, ...]:
    """Mechanisms that a model or set has beside those of the model before the first ``+``."""
    return tuple(CATALOGUE[part] for part in name.split(SEPARATOR)[1:])


def swapped_in(name: str) -> tuple[Entry, ...]:
    """Those of `mechanisms_of` that take the place of a block, and so have no null at which they are absent."""
    return tuple(entry for entry in mechanisms_of(name) if entry.name not in EXTRAS)


def without_effect(name: str, values: Mapping[str, float]) -> tuple[Entry, ...]:
    """Mechanisms of a model whose effect is exactly zero with these values."""
    return tuple(e for e in mechanisms_of(name) if e.effect is not None and values[e.effect] == 0.0)


def without_effect_line(name: str, values: Mapping[str, float]) -> str:
    """One line on the mechanisms of `without_effect`; empty where there are none."""
    idle = without_effect(name, values)
    if not idle:
        return ""
    named, effects = " and ".join(e.name for e in idle), " ".join(f"--set {e.effect}=VALUE" for e in idle)
    if len(idle) == 1:
        return f"{named} is at its null value, its effect is exactly zero; fit it or give {effects}"
    return f"{named} are at their null values, their effects are exactly zero; fit them or give {effects}"


def starts_for(entry: Entry, base: Mapping[str, float]) -> dict[str, tuple[float, ...]]:
    """Values to start from by parameter, as many for each as the mechanism has starts."""
    starts = entry.starting_values(base)
    return {name: tuple(float(start[name]) for start in starts) for name in starts[0]}
