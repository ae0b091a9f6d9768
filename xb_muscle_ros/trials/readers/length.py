"""Length of a trial in m, the length that is L0, and the phases that the record shows."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.phases import detect_phases, initial_isometric
from xb_muscle_ros.trials.readers.description import ImportMapping
from xb_muscle_ros.trials.readers.plausibility import (
    SPIKE_L0,
    length_doubts,
    length_range_doubts,
    sarcomere_hint,
    spikes,
)
from xb_muscle_ros.trials.readers.recording import Recording
from xb_muscle_ros.trials.trial import Array, Phase

# Beyond these it is no muscle's length, or its unit is wrong. A whole muscle may go slack, its length near 0.
LENGTH_RANGE_L0 = (0.1, 3.0)
# From the shortest piece of a fibre to the longest fibres there are (Harris et al. 2005: human sartorius, 0.6 m).
L0_RANGE_M = (1e-5, 0.7)
SARCOMERE_RANGE_M = (0.5e-6, 6e-6)


class Length(NamedTuple):
    """Length (m) and L0 (m), phases, notes for the source, and warnings."""

    length_m: Array
    reference_m: float
    phases: tuple[Phase, ...]
    notes: tuple[str, ...]
    warnings: tuple[str, ...] = ()


def read_length(
    recording: Recording, mapping: ImportMapping, time_s: Array, amplitude_l0: float | None, recovery_s: float | None
) -> Length:
    """Make lengths of the length column.

    Args:
        recording: of the trial.
        mapping: unit and meaning of the column.
        time_s: times of the samples, s.
        amplitude_l0, recovery_s: of the protocol where they are known; see `detect_phases`.

    Raises:
        UserError: a length that no muscle has.
    """
    signal, column = recording.length, mapping.length
    length_m = signal.values * column.unit.factor
    relative = column.unit.kind == "relative length"
    reference_m = 1.0 if relative else None if mapping.reference_length is None else mapping.reference_length.value
    if reference_m is not None and (mapping.length_is_change or mapping.at_reference is not None):
        length_m = length_m - (mapping.at_reference or 0.0) + reference_m
    give = 0.0 if mapping.servo_give is None else mapping.servo_give.value
    phases = detect_phases(time_s, length_m, amplitude_l0, recovery_s, reference_m, give)
    warnings: tuple[str, ...] = ()
    found = reference_m is None
    if reference_m is None:
        isometric = length_m[initial_isometric(time_s, phases)]
        if isometric.size == 0:
            warnings = (f"{recording.where} does not begin isometrically; L0 is the length of its first sample",)
            isometric = length_m[:1]
        reference_m = float(np.mean(isometric))
    _check(recording, mapping, length_m, reference_m)
    notes = (_note(mapping, relative, found, reference_m),)
    warnings += (
        *length_doubts(recording.where, mapping, reference_m),
        *length_range_doubts(recording.where, length_m, reference_m),
        *spikes(recording.where, signal, length_m / reference_m, SPIKE_L0, "L0"),
    )
    if mapping.length_of != "fibre":
        length_m, reference_m = length_m / reference_m, 1.0
    return Length(length_m, reference_m, phases, notes, warnings)


def _check(recording: Recording, mapping: ImportMapping, length_m: Array, reference_m: float) -> None:
    where, signal, column = recording.where, recording.length, mapping.length
    if reference_m <= 0.0:
        raise UserError(
            f"{where}, {signal.name} begins with {reference_m:.6g} m; a length is above 0; "
            "does the column hold a change of length?"
        )
    low, high = L0_RANGE_M if mapping.length_of == "fibre" else SARCOMERE_RANGE_M
    if column.unit.kind == "length" and not low <= reference_m <= high:
        what = "fibres" if mapping.length_of == "fibre" else "sarcomeres and their halves"
        hint = sarcomere_hint(reference_m) if mapping.length_of == "fibre" else ""
        hint = hint or f"is {column.unit_name} its unit?"
        raise UserError(f"{where}, {signal.name}: L0 is {reference_m:.6g} m; {what} have {low:g} to {high:g} m; {hint}")
    length_l0 = length_m / reference_m
    low, high = LENGTH_RANGE_L0
    bad = np.flatnonzero(~((length_l0 >= low) & (length_l0 <= high)))
    if bad.size:
        i = int(bad[0])
        raise UserError(
            f"{signal.place(where, i)} is {length_l0[i]:.6g} L0 (L0 = {reference_m:.6g} m); allowed is "
            f"{low:g} to {high:g}; check the column and its unit"
        )


def _note(mapping: ImportMapping, relative: bool, found: bool, reference_m: float) -> str:
    """What lengths mean."""
    if relative:
        return "lengths come relative to L0 and are stored with 1 m for L0"
    how = "mean before the first change of length" if found else "given"
    if mapping.length_of != "fibre":
        what = mapping.length_of.replace("_", "-")
        return f"{what} lengths relative to {reference_m:.6g} m ({how}), stored with 1 m for L0"
    note = f"L0 = {reference_m:.6g} m ({how})"
    if mapping.length_is_change:
        return f"{note}; the recorded change of length is added to it"
    if mapping.at_reference is not None:
        return f"{note}, taken where the recorded length is {mapping.at_reference:.6g} m"
    return note
