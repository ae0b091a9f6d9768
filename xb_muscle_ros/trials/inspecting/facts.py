"""Facts that files tell beside their signals, by the keys of a mapping, and what values are usual."""

from __future__ import annotations

import re

import numpy as np

from xb_muscle_ros.trials.inspecting.recognition import Recognised
from xb_muscle_ros.trials.readers.contents import Contents
from xb_muscle_ros.trials.readers.plausibility import (
    USUAL_CALCIUM_UM,
    USUAL_L0_M,
    USUAL_LENGTH_L0,
    USUAL_STEP_S,
)
from xb_muscle_ros.trials.readers.units import KINDS, UNITS

_QUANTITY = re.compile(r"([+-]?\d+(?:\.\d+)?(?:[eE][+-]?\d+)?)\s*([%A-Za-zµμ][\w/µμ²^]*)?")
# Names that facts go by in comments and in the custom_data of bags, folded; the key of a mapping and its unit.
_FACTS = {
    "fibre": ("fibre", ""), "fiber": ("fibre", ""), "trial": ("trial", ""), "dataset": ("data_set", ""),
    "source": ("source", ""), "pca": ("pca", "number"), "amplitudel0": ("amplitude_l0", "number"),
    "recoverys": ("recovery_s", "number"), "referencelengthm": ("reference_length", "m"),
    "referencelength": ("reference_length", "length"), "l0": ("reference_length", "length"), "f0n": ("f0", "N"),
    "f0": ("f0", "force"),
}  # fmt: skip
# Middle values (of time: the step) that are usual, by role and kind of unit.
_USUAL = {
    "time": {"time": USUAL_STEP_S},
    "length": {"length": USUAL_L0_M, "relative length": USUAL_LENGTH_L0},
    "calcium": {"calcium": USUAL_CALCIUM_UM, "pCa": (3.0, 10.0)},
}


def facts_of(contents: Contents) -> dict[str, str]:
    """Facts that a file tells, by the keys of a mapping, as its values."""
    found: dict[str, str] = {}
    for name, text in contents.facts.items():
        key, kind = _FACTS.get(re.sub(r"[^a-z0-9]", "", name.casefold()), ("", ""))
        match = _QUANTITY.fullmatch(text.strip())
        if not key or key in found:
            continue
        if not kind:
            found[key] = text.strip()
        elif match is not None and kind == "number" and not match.group(2):
            found[key] = match.group(1)
        elif match is not None and kind in ("m", "N") and not match.group(2):
            found[key] = f"{match.group(1)} {kind}"
        elif match is not None and kind in KINDS and match.group(2) in UNITS:
            found[key] = f"{match.group(1)} {match.group(2)}"
    return found


def hint(one: Recognised) -> str:
    """Units in which the values would be usual ones; a hint and no more."""
    values = np.diff(one.content.values) if one.role == "time" else one.content.values
    if not np.isfinite(values).any() or one.role not in _USUAL:
        return ""
    middle = float(np.median(np.abs(values[np.isfinite(values)])))
    usual = [
        name
        for name, unit in UNITS.items()
        for kind, (low, high) in _USUAL[one.role].items()
        if unit.kind == kind and low <= middle * (1.0 if kind == "pCa" else unit.factor) <= high
    ]
    return f"; such values are usual in {', '.join(usual)}" if usual else ""
