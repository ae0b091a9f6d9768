"""Trial facts as the strings of a bag's ``custom_data``, and back."""

from __future__ import annotations

import json
import math
import unicodedata
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.readers.units import finite
from xb_muscle_ros.trials.trial import Phase, TrialFacts

_CONTROL = ("Cc", "Cs", "Zl", "Zp")
_TEXTS = ("fibre", "trial", "source", "data_set", "protocol")
_WHERE_KNOWN = ("data_set", "protocol")
_OPTIONAL_NUMBERS = ("pca", "amplitude_l0", "recovery_s")
_POSITIVE_NUMBERS = ("reference_length_m", "f0_n")


def facts_to_custom_data(facts: TrialFacts) -> dict[str, str]:
    """Facts as strings; facts that are not known are left out.

    Numbers are written as Python writes them, so that they come back bit for bit; phases as JSON.

    Raises:
        UserError: a text has a line break or another control character, which YAML readers do not agree on.
    """
    for name in _TEXTS:
        bad = next((c for c in getattr(facts, name) if unicodedata.category(c) in _CONTROL), None)
        if bad is not None:
            raise UserError(f"{name} holds the control character {bad!r}; allowed is text on one line")
    data = {name: getattr(facts, name) for name in _TEXTS if name not in _WHERE_KNOWN or getattr(facts, name)}
    for name in _OPTIONAL_NUMBERS + _POSITIVE_NUMBERS:
        value = getattr(facts, name)
        if value is not None:
            data[name] = repr(float(value))
    data["phases"] = json.dumps(
        [{"name": p.name, "start_s": float(p.start_s), "end_s": float(p.end_s)} for p in facts.phases]
    )
    if facts.settings:
        data["settings"] = json.dumps({name: float(value) for name, value in facts.settings})
    return data


def facts_from_custom_data(data: Mapping[str, str], where: str, fibre: str, trial: str) -> TrialFacts:
    """Facts from ``custom_data``; other keys are left alone.

    Args:
        fibre: used where the data name no fibre.
        trial: used where the data name no trial.

    Raises:
        UserError: a number or the phases cannot be read.
    """
    known: dict[str, Any] = {name: data[name] for name in _TEXTS if name in data}
    numbers = [name for name in _OPTIONAL_NUMBERS + _POSITIVE_NUMBERS if name in data]
    known |= {name: finite(data[name], f"custom_data {name}", f"bag {where}") for name in numbers}
    for name in _POSITIVE_NUMBERS:
        if known.get(name, 1.0) <= 0.0:
            raise UserError(f"bag {where}: custom_data {name} is {known[name]!r}; allowed are numbers above 0")
    phases, settings = _phases(data.get("phases", "[]"), where), _settings(data.get("settings", "{}"), where)
    return replace(TrialFacts(fibre, trial, phases=phases, settings=settings), **known)


def _settings(text: str, where: str) -> tuple[tuple[str, float], ...]:
    try:
        found = tuple((str(name), float(value)) for name, value in json.loads(text).items())
    except (ValueError, TypeError, AttributeError) as problem:
        raise UserError(
            f"bag {where}: custom_data settings cannot be read ({problem}); needed is a JSON object of numbers"
        ) from None
    bad = next((each for each in found if not math.isfinite(each[1])), None)
    if bad is not None:
        raise UserError(f"bag {where}: custom_data settings has {bad[0]} = {bad[1]}; allowed are finite numbers")
    return found


def _phases(text: str, where: str) -> tuple[Phase, ...]:
    try:
        phases = tuple(Phase(str(p["name"]), float(p["start_s"]), float(p["end_s"])) for p in json.loads(text))
    except (ValueError, TypeError, KeyError) as problem:
        raise UserError(
            f"bag {where}: custom_data phases cannot be read ({problem}); "
            'needed is a JSON list of {"name": ..., "start_s": ..., "end_s": ...}'
        ) from None
    for phase in phases:
        if not (math.isfinite(phase.start_s) and math.isfinite(phase.end_s) and phase.start_s <= phase.end_s):
            raise UserError(
                f"bag {where}: custom_data phase {phase.name} goes from {phase.start_s} to {phase.end_s} s; "
                "allowed are finite times, the end not before the start"
            )
    return phases
