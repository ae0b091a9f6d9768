"""Ordinary errors of the measurement in a fit: which of them its trials can show, and which went beyond ordinary."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from xb_muscle_ros.fit.data import FitTrial
from xb_muscle_ros.measurement.artefacts import ARTEFACTS, ORDINARY, Scope

# An estimate this many standard deviations of its prior from 0 is reported.
BEYOND = 2.0


def shown_by(training: Sequence[FitTrial]) -> tuple[list[str], list[str]]:
    """Ordinary faults that trials can show at all, and the names of the others."""
    moves = any(t.moves for t in training)
    seen = {
        "run_down": len(training) > 1,
        "length_gain": moves,
        "time_shift": moves or any(np.ptp(t.calcium_um) > 0.0 for t in training),
    }
    fitted = [name for name in ORDINARY if training and seen.get(name, True)]
    return fitted, [name for name in ORDINARY if name not in fitted]


def fitted_line(parameters: Sequence[Mapping[str, Any]]) -> str:
    """What of the measurement was fitted, each with how many values and the prior's standard deviation; may be empty.

    Args:
        parameters: rows of `report.parameter_rows`.
    """
    kinds: dict[str, list[Mapping[str, Any]]] = {}
    for row in parameters:
        if row["group"] is not None:
            kinds.setdefault(row["name"], []).append(row)
    named = []
    for name, rows in kinds.items():
        scope, sd = ARTEFACTS[name].scope, rows[0]["prior_sd"]
        many = "" if scope is Scope.STUDY else f"{len(rows)} {scope.value}{'s' * (len(rows) > 1)}, "
        named.append(f"{name} ({many}{'no prior' if sd is None else f'SD {sd:g}{unit_of(name)}'})")
    return f"errors of the measurement fitted beside: {', '.join(named)}" if named else ""


def beyond_line(parameters: Sequence[Mapping[str, Any]], trials: Sequence[Mapping[str, Any]]) -> list[str]:
    """One line on all estimates further from 0 than ordinary errors are, those of held-out trials included.

    Args:
        parameters, trials: rows of `report.parameter_rows` and `report.trial_rows`.
    """
    sds = {row["name"]: row["prior_sd"] for row in parameters if row["group"] is not None}
    found = [(row["name"], row["group"], row["value"]) for row in parameters if row["group"] is not None]
    found += [(name, row["trial"], value) for row in trials for name, value in row.get("own_faults", {}).items()]
    beyond = [
        f"{name}{f'[{group}]' if group else ''} {value:.3g}{unit_of(name)} ({abs(value) / sds[name]:.1f} SD)"
        for name, group, value in found
        if sds[name] is not None and abs(value) > BEYOND * sds[name]
    ]
    if not beyond:
        return []
    return [
        f"beyond what is ordinary ({BEYOND:g} SD): {', '.join(beyond)}; look at the recording, or the model lacks it"
    ]


def unit_of(name: str) -> str:
    """Unit of a fault behind a number, with its space; empty for a pure number."""
    unit = ARTEFACTS[name].unit
    return "" if unit == "1" else f" {unit}"
