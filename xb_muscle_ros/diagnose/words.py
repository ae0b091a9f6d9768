"""How a diagnosis speaks to people: names, one-line meanings, phases, and numbers in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

from xb_muscle_ros.models.catalogue import CATALOGUE

# Names that are not their identifier with spaces; mechanisms bring theirs.
_NAMES: Mapping[str, str] = {
    "pca_shift": "pCa shift",
    "run_down": "run-down",
    "base": "the base model",
}
_MEANINGS: Mapping[str, str] = {
    "pca_shift": "a solution had more or less free calcium than its label says",
    "run_down": "the fibre lost force from trial to trial",
    "force_offset": "the transducer did not read zero at zero force",
    "force_drift": "the reading of the transducer crept during a trial",
    "length_gain": "the length changes were larger or smaller than recorded",
    "time_shift": "force and length were recorded out of step",
    "transducer_lag": "the transducer follows force with a delay",
}
_FAMILIES: Mapping[str, str] = {
    "weak_binding": "weak binding and friction",
    "calcium_dependent_elasticity": "calcium-dependent elasticity",
    "length_dependence": "length dependence of activation and attachment",
    "regulation": "regulation by the filaments",
    "heads_under_strain": "behaviour of strained heads",
    "heterogeneity": "heterogeneity of half-sarcomeres",
    "compliance": "series compliance",
    "rates": "temperature and chemistry",
    "force_scale": "scale of force",
    "force_zero": "zero of force",
    "length_scale": "scale of length",
    "timing": "timing of force and length",
}
SCALES: Mapping[str, str] = MappingProxyType(
    {
        "activation": "scales with the activation of the thin filament",
        "constant": "is the same at every activation",
        "calcium": "scales with the calcium given",
        "force": "scales with force",
    }
)
"""What a residual scales with, after its subject."""


def human(name: str) -> str:
    """A mechanism or artefact as a sentence calls it."""
    return CATALOGUE[name].title if name in CATALOGUE else _NAMES.get(name, name.replace("_", " "))


def meaning(name: str) -> str:
    """What it is, in one line; empty where nothing is known."""
    return CATALOGUE[name].meaning if name in CATALOGUE else _MEANINGS.get(name, "")


def family_words(family: str) -> str:
    """A family as a sentence calls it."""
    return _FAMILIES.get(family, family.replace("_", " "))


def phase_words(phase: str) -> str:
    """A phase as figures and sentences call it."""
    return "isometric phase" if phase == "isometric" else phase.replace("_", " ")


def joined(items: Sequence[str], last: str = "and") -> str:
    """``a, b and c``."""
    if len(items) < 2:
        return "".join(items)
    return f"{', '.join(items[:-1])} {last} {items[-1]}"


def digits(value: float, significant: int = 2) -> str:
    """A number with so many significant digits at least, without an exponent between 1e-4 and 1e6."""
    size = abs(value)
    if size == 0.0:
        return "0"
    if size < 1e-4 or size >= 1e6:
        return f"{value:.{significant}g}"
    # The exponent after rounding: 0.0999 is 0.10.
    exponent = int(f"{value:.{significant - 1}e}".rpartition("e")[2])
    return f"{value:.{max(0, significant - 1 - exponent)}f}"


def percent(value_f0: float) -> str:
    """A force in % F0, without the unit."""
    return digits(100.0 * value_f0)


def quantity(value: float, unit: str | None, significant: int = 3) -> str:
    """A value with its unit; ``1`` is none."""
    return digits(value, significant) + after_number(unit)


def after_number(unit: str | None) -> str:
    """A unit as it follows a number; ``1`` is none."""
    return "" if unit in (None, "", "1") else f" {unit}"


def chance(p_value: float) -> str:
    """How often chance alone does as much, after the words *by chance*."""
    if p_value <= 0.0:
        return "in none of the simulated repeats"
    for repeats in (10, 100, 1000, 10000):
        if p_value * repeats >= 1.0:
            return f"in about {round(p_value * repeats)} of {repeats} repeats"
    return "in fewer than 1 of 10000 repeats"
