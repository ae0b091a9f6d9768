"""Length of a trial in m, the length that is L0, and the phases that the record shows."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from xb_muscle_ros.errors import UserError, naming
from xb_muscle_ros.trials.checks import LENGTH_CHANGE_L0
from xb_muscle_ros.trials.mains import Notch
from xb_muscle_ros.trials.phases import detect_phases, initial_isometric, moves
from xb_muscle_ros.trials.readers.base import Draft
from xb_muscle_ros.trials.readers.description import ImportMapping
from xb_muscle_ros.trials.readers.plausibility import (
    SPIKE_L0,
    doubt_of_l0,
    sarcomere_hint,
    warn_of_length,
    warn_of_spikes,
)
from xb_muscle_ros.trials.trial import Array, Phase

# Beyond these no command takes a length.
_LENGTH_L0 = (1.0 + LENGTH_CHANGE_L0[0], 1.0 + LENGTH_CHANGE_L0[1])
# From the shortest piece of a fibre to the longest fibres there are (Harris et al. 2005: human sartorius, 0.6 m).
L0_RANGE_M = (1e-5, 0.7)
SARCOMERE_RANGE_M = (0.5e-6, 6e-6)


class Length(NamedTuple):
    """Length (m), L0 (m), and phases."""

    length_m: Array
    reference_m: float
    phases: tuple[Phase, ...]


def read_length(draft: Draft, time_s: Array, notch: Notch) -> Length:
    """Make lengths of the length column; amplitude and recovery, where they are known, help to find phases.

    Args:
        time_s: shape (n,), s.
        notch: frequencies that are taken out of length before L0 and phases are found in it.

    Raises:
        UserError: a length that no muscle has, or that the notch cannot be made in.
    """
    mapping, signal, facts = draft.mapping, draft.recording.signals["length"], draft.recording.facts
    reference_m = None if mapping.reference_length is None else mapping.reference_length.value
    unit_m = 1.0
    if mapping.length.unit.kind == "relative length":
        reference_m = unit_m = 1.0 if reference_m is None else reference_m
    length_m = signal.values * mapping.length.unit.factor * unit_m
    if reference_m is not None and (mapping.length_is_change or mapping.at_reference is not None):
        at_m = 0.0 if mapping.at_reference is None else mapping.at_reference.value * unit_m
        length_m = length_m - at_m + reference_m
    recorded_m = length_m
    with naming(draft.where):
        length_m = notch.without("length", time_s, recorded_m)
    give = 0.0 if mapping.servo_give is None else mapping.servo_give.value * unit_m
    phases = detect_phases(time_s, length_m, facts.get("amplitude_l0"), facts.get("recovery_s"), reference_m, give)
    how = mapping.reference_note
    if reference_m is None:
        reference_m, how = _first_isometric(draft, time_s, length_m, phases)
    _check(draft, recorded_m, reference_m)
    draft.notes.append(_note(mapping, f"{reference_m:.6g} m ({how})"))
    warn_of_length(draft, length_m, reference_m)
    warn_of_spikes(draft, signal, recorded_m / reference_m, SPIKE_L0, "L0")
    if mapping.length_of != "fibre":
        length_m, reference_m = length_m / reference_m, 1.0
    return Length(length_m, reference_m, phases)


def _first_isometric(draft: Draft, time_s: Array, length_m: Array, phases: tuple[Phase, ...]) -> tuple[float, str]:
    """L0 (m) of the length before its first change, and how it was found; other lengths get a line."""
    isometric = length_m[initial_isometric(time_s, phases)]
    if isometric.size == 0:
        draft.warnings.append(f"{draft.where} does not begin isometrically; L0 is the length of its first sample")
        return float(length_m[0]), "the first sample, as length moves from there on"
    level = float(np.mean(isometric))
    if len(phases) > 1:
        return level, "mean before the first change of length"
    if not moves(length_m):
        return level, "mean of the record, in which no change of length is found"
    draft.warn(
        "length moves, but noise, hum or an oscillation hides its first change, so L0 is the mean of the whole "
        f"record, {level:.6g} m; give it with --reference-length, or take hum out with --notch"
    )
    return level, "mean of the whole record, as noise, hum or an oscillation hides the first change of length"


def _check(draft: Draft, length_m: Array, reference_m: float) -> None:
    where, mapping, signal = draft.where, draft.mapping, draft.recording.signals["length"]
    if reference_m <= 0.0:
        raise UserError(
            f"{where}, {signal.name} begins with {reference_m:.6g} m; a length is above 0; "
            "does the column hold a change of length?"
        )
    is_fibre = mapping.length_of == "fibre"
    low, high = L0_RANGE_M if is_fibre else SARCOMERE_RANGE_M
    if mapping.l0_is_a_length and not low <= reference_m <= high:
        what = "fibres" if is_fibre else "sarcomeres and their halves"
        hint = (is_fibre and sarcomere_hint(reference_m)) or doubt_of_l0(mapping)
        raise UserError(f"{where}, {signal.name}: L0 is {reference_m:.6g} m; {what} have {low:g} to {high:g} m; {hint}")
    shown = f"{{:.6g}} L0 (L0 = {reference_m:.6g} m)"
    signal.check(where, length_m / reference_m, _LENGTH_L0, shown, "check the column and its unit")


def _note(mapping: ImportMapping, reference: str) -> str:
    """What lengths mean, given L0 and how it was found."""
    if mapping.length.unit.kind == "relative length":
        if mapping.reference_length is not None:
            return f"lengths come relative to L0 = {reference}"
        return "lengths come relative to L0 and are stored with 1 m for L0"
    if mapping.length_of != "fibre":
        return f"{mapping.length_of.replace('_', '-')} lengths relative to {reference}, stored with 1 m for L0"
    if mapping.length_is_change:
        return f"L0 = {reference}; the recorded change of length is added to it"
    at = mapping.at_reference
    return f"L0 = {reference}" + ("" if at is None else f", taken where the recorded length is {at.value:.6g} m")
