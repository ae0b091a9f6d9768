"""How a diagnosis speaks to people: names, one-line meanings, phases, and numbers in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

from xb_muscle_ros.diagnose.answers import FAMILY
from xb_muscle_ros.diagnose.names import Name
from xb_muscle_ros.models.catalogue import CATALOGUE

# Name and meaning of measurement artefacts; mechanisms bring theirs.
_ARTEFACTS: Mapping[Name, tuple[str, str]] = {
    Name.PCA_SHIFT: ("pCa shift", "a solution had more or less free calcium than its label says"),
    Name.RUN_DOWN: ("run-down", "the fibre lost force from trial to trial"),
    Name.FORCE_OFFSET: ("force offset", "the transducer did not read zero at zero force"),
    Name.FORCE_DRIFT: ("force drift", "the reading of the transducer crept during a trial"),
    Name.LENGTH_GAIN: ("length gain", "the length changes were larger or smaller than recorded"),
    Name.TIME_SHIFT: ("time shift", "force and length were recorded out of step"),
    Name.TRANSDUCER_LAG: ("transducer lag", "the transducer follows force with a delay"),
}
_FAMILIES: Mapping[str, str] = {
    "parallel_viscoelasticity": "parallel viscoelasticity",
    "weak_binding": "weak binding and friction",
    "calcium_dependent_elasticity": "calcium-dependent elasticity",
    "length_dependence": "length dependence of activation and attachment",
    "regulation": "regulation by the filaments",
    "heads_under_strain": "behaviour of strained heads",
    "heterogeneity": "heterogeneity of half-sarcomeres",
    "compliance": "series compliance",
    "rates": "temperature and chemistry",
    "calcium_of_solutions": "calcium of the solutions",
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
"""What a remainder scales with, after its subject."""
# The scale for likelihood of Mastrandrea et al. 2010 (guidance note of the IPCC on uncertainties): lower limits.
_LIKELY = (
    (0.99, "virtually certain"),
    (0.90, "very likely"),
    (0.66, "likely"),
    (0.33, "about as likely as not"),
    (0.10, "unlikely"),
    (0.0, "very unlikely"),
)


def parts(name: str) -> list[str]:
    """Names in a pair written ``a+b``; a single name alone."""
    return [part for part in (piece.strip() for piece in name.split("+")) if part]


def human(name: str) -> str:
    """A mechanism, fault or pair as a sentence calls it."""
    if name == "base":
        return "the base model"
    return " with ".join(_one(part)[0] for part in parts(name)) or name


def meaning(name: str) -> str:
    """What it is, in one line; empty where nothing is known."""
    return "; ".join(m for m in (_one(part)[1] for part in parts(name)) if m)


def family_words(family: str) -> str:
    """A family as a sentence calls it."""
    return _FAMILIES.get(family, family.replace("_", " "))


def family_of(name: str) -> str | None:
    """Family of a known name, else None."""
    return FAMILY.get(Name(name))


def phase_words(phase: str) -> str:
    """A phase as figures and sentences call it."""
    return "isometric phase" if phase == "isometric" else phase.replace("_", " ")


def joined(items: Sequence[str], last: str = "and") -> str:
    """``a, b and c``."""
    if len(items) < 2:
        return "".join(items)
    return f"{', '.join(items[:-1])} {last} {items[-1]}"


def likely(share: float) -> str:
    """A probability in words."""
    return next(words for least, words in _LIKELY if share >= least or least == 0.0)


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


def quantity(value: float, unit: str | None) -> str:
    """A value with its unit; ``1`` is none."""
    return digits(value, 3) + ("" if unit in (None, "", "1") else f" {unit}")


def chance(p_value: float) -> str:
    """How often chance alone does as much, after the words *by chance*."""
    if p_value <= 0.0:
        return "in none of the simulated repeats"
    for repeats in (10, 100, 1000, 10000):
        if p_value * repeats >= 1.0:
            return f"in about {round(p_value * repeats)} of {repeats} repeats"
    return "in fewer than 1 of 10000 repeats"


def _one(name: str) -> tuple[str, str]:
    """Name and meaning of one mechanism or artefact."""
    if name in CATALOGUE:
        return CATALOGUE[name].title, CATALOGUE[name].meaning
    return _ARTEFACTS.get(Name(name), (name.replace("_", " "), ""))
