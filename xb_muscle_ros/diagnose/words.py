"""How a diagnosis speaks to people: names, one-line meanings, phases, and numbers in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

# Names that are not their identifier with spaces.
_NAMES: Mapping[str, str] = {
    "filament_friction": "friction of bound heads",
    "static_calcium_stiffness": "static calcium-dependent stiffness",
    "length_dependent_activation": "length-dependent activation",
    "strain_recruited_heads": "heads recruited by strain",
    "nonlinear_crossbridge": "non-linear cross-bridges",
    "half_sarcomere_spread": "uneven half-sarcomeres",
    "thin_filament_cooperativity": "thin-filament cooperativity",
    "thick_filament_cooperativity": "thick-filament cooperativity",
    "pca_shift": "pCa shift",
    "run_down": "run-down",
    "base": "the base model",
}
_MEANINGS: Mapping[str, str] = {
    "viscous_drag": "a force proportional to the speed of stretch",
    "passive_viscoelasticity": "springs with dashpots beside the cross-bridges; force decays after a stretch",
    "weakly_bound_heads": "heads that bind and let go quickly and hold for a moment when the fibre is stretched",
    "filament_friction": "links of bound heads are elastic for a short way, slip, and take time to form anew",
    "active_titin": "a spring that engages when the fibre is activated and is stretched from there on",
    "static_calcium_stiffness": "a spring whose stiffness follows calcium, not force",
    "length_dependent_activation": "a longer fibre is more sensitive to calcium",
    "lattice_spacing": "heads attach faster when the fibre is longer and its lattice tighter",
    "filament_overlap": "the number of heads within reach changes with length",
    "strain_recruited_heads": "stretch wakes heads that were resting on the thick filament",
    "persistent_thick_filament": "heads that force has woken go to rest more slowly than the model has it",
    "forcible_detachment": "heads stretched too far are torn off and bind again quickly",
    "nonlinear_crossbridge": "the stiffness of a head changes with how far it is stretched",
    "half_sarcomere_spread": "stronger half-sarcomeres shorten at the cost of weaker ones in series",
    "series_compliance": "a spring in series takes up part of the length change",
    "thin_filament_cooperativity": "bound heads and active sites help their neighbours to become active",
    "thick_filament_cooperativity": "force wakes heads that were resting on the thick filament",
    "temperature": "the recordings were made warmer or colder than the model assumes",
    "phosphate": "phosphate in the solution lets heads detach before they have done their work",
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
    return _NAMES.get(name, name.replace("_", " "))


def meaning(name: str) -> str:
    """What it is, in one line; empty where nothing is known."""
    return _MEANINGS.get(name, "")


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
