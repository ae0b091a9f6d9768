"""How a diagnosis speaks to people: names, one-line meanings, phases, and numbers in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

from xb_muscle_ros.diagnose.names import FAMILY, Name


class Words(NamedTuple):
    """Of one thing that a diagnosis may name.

    Attributes:
        name: how a sentence calls it.
        meaning: what it is, in a line that follows a colon.
    """

    name: str
    meaning: str


_WORDS: Mapping[Name, Words] = {
    Name.VISCOUS_DRAG: Words("viscous drag", "a force proportional to the speed of stretch"),
    Name.PASSIVE_VISCOELASTICITY: Words(
        "passive viscoelasticity",
        "springs with dashpots beside the cross-bridges, so that force decays after a stretch",
    ),
    Name.WEAKLY_BOUND_HEADS: Words(
        "weakly bound heads", "heads that bind and let go quickly and hold for a moment when the fibre is stretched"
    ),
    Name.FILAMENT_FRICTION: Words(
        "friction of bound heads",
        "links that bound heads make are elastic for a short way, slip, and take time to form anew",
    ),
    Name.ACTIVE_TITIN: Words(
        "active titin", "a spring that engages when the fibre is activated and is stretched from there on"
    ),
    Name.STATIC_CALCIUM_STIFFNESS: Words(
        "static calcium-dependent stiffness", "a spring whose stiffness follows calcium, not force"
    ),
    Name.LENGTH_DEPENDENT_ACTIVATION: Words(
        "length-dependent activation", "a longer fibre is more sensitive to calcium"
    ),
    Name.LATTICE_SPACING: Words(
        "lattice spacing", "heads attach faster when the fibre is longer and its lattice tighter"
    ),
    Name.FILAMENT_OVERLAP: Words("filament overlap", "the number of heads within reach changes with length"),
    Name.STRAIN_RECRUITED_HEADS: Words(
        "heads recruited by strain", "stretch wakes heads that were resting on the thick filament"
    ),
    Name.PERSISTENT_THICK_FILAMENT: Words(
        "persistent thick filament",
        "heads that force has woken stay awake after force is lost, and go to rest more slowly than the model has it",
    ),
    Name.FORCIBLE_DETACHMENT: Words(
        "forcible detachment", "heads stretched too far are torn off and bind again quickly"
    ),
    Name.NONLINEAR_CROSSBRIDGE: Words(
        "non-linear cross-bridges", "the stiffness of a head changes with how far it is stretched"
    ),
    Name.HALF_SARCOMERE_SPREAD: Words(
        "uneven half-sarcomeres", "stronger half-sarcomeres shorten at the cost of weaker ones in series"
    ),
    Name.SERIES_COMPLIANCE: Words("series compliance", "a spring in series takes up part of the length change"),
    Name.THIN_FILAMENT_COOPERATIVITY: Words(
        "thin-filament cooperativity", "bound heads and active sites help their neighbours to become active"
    ),
    Name.THICK_FILAMENT_COOPERATIVITY: Words(
        "thick-filament cooperativity", "force wakes heads that were resting on the thick filament"
    ),
    Name.TEMPERATURE: Words("temperature", "the recordings were made warmer or colder than the model assumes"),
    Name.PHOSPHATE: Words("phosphate", "phosphate in the solution lets heads detach before they have done their work"),
    Name.PCA_SHIFT: Words("pCa shift", "a solution had more or less free calcium than its label says"),
    Name.RUN_DOWN: Words("run-down", "the fibre lost force from trial to trial"),
    Name.FORCE_OFFSET: Words("force offset", "the transducer did not read zero at zero force"),
    Name.FORCE_DRIFT: Words("force drift", "the reading of the transducer crept during a trial"),
    Name.LENGTH_GAIN: Words("length gain", "the length changes were larger or smaller than recorded"),
    Name.TIME_SHIFT: Words("time shift", "force and length were recorded out of step"),
    Name.TRANSDUCER_LAG: Words("transducer lag", "the transducer follows force with a delay"),
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
    return " with ".join(_one(part).name for part in parts(name)) or name


def meaning(name: str) -> str:
    """What it is, in one line; empty where nothing is known."""
    return "; ".join(m for m in (_one(part).meaning for part in parts(name)) if m)


def family_words(family: str) -> str:
    """A family as a sentence calls it."""
    return _FAMILIES.get(family, family.replace("_", " "))


def family_of(name: str) -> str | None:
    """Family of a known name, else None."""
    known = {str(n.value): family for n, family in FAMILY.items()}
    return known.get(name)


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


def _one(name: str) -> Words:
    try:
        return _WORDS[Name(name)]
    except ValueError:
        return Words(name.replace("_", " "), "")
