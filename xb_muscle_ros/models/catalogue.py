"""Mechanisms that can be put into a model, as a fit or a diagnosis sees them: parameters, starts, expected sizes.

One catalogue for both, so that a fit of ``3state_coop+viscous_drag`` begins where a diagnosis would.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

from xb_muscle_ros.mechanisms import Entry
from xb_muscle_ros.models.registry import EXTRAS, SEPARATOR, SWAPS

CATALOGUE: Mapping[str, Entry] = MappingProxyType(
    {name: replace(b.entry, name=name) for name, b in {**SWAPS, **EXTRAS}.items() if b.entry is not None}
)
"""The entry of every mechanism of the registry by name, family by family; those that are geometry have none."""


def mechanisms_of(name: str) -> tuple[Entry, ...]:
    """Mechanisms that a model or set has beside those of the model before the first ``+``; geometry is none."""
    return tuple(CATALOGUE[part] for part in name.split(SEPARATOR)[1:] if part in CATALOGUE)


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
