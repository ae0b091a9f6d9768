"""Free calcium of a trial: from a column, from pCa, or from stimulation by the activation stage."""

from __future__ import annotations

import math
import re
from typing import NamedTuple

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.activation import Interval, force_drop, stimulated_intervals
from xb_muscle_ros.trials.readers.clock import Clock, times_of
from xb_muscle_ros.trials.readers.description import Activation, ImportMapping
from xb_muscle_ros.trials.readers.plausibility import calcium_doubts
from xb_muscle_ros.trials.readers.recording import Recording, Signal
from xb_muscle_ros.trials.trial import Array

# Beyond these it is no free calcium, or its unit is wrong.
CALCIUM_RANGE_UM = (0.0, 1e5)
PCA_RANGE = (1.0, 12.0)
# pCa is noted to a tenth.
SAME_PCA = 0.05


class Calcium(NamedTuple):
    """Times (s) and values (µM) of calcium where it changes, pCa where it does not, notes, and warnings."""

    time_s: Array
    calcium_um: Array
    pca: float | None
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()


def read_calcium(recording: Recording, mapping: ImportMapping, clock: Clock, pca: float | None) -> Calcium:
    """Calcium of a trial.

    Raises:
        UserError: calcium is not known, or no muscle has it.
    """
    if mapping.activation is not None:
        return _by_activation(recording, mapping, mapping.activation, clock)
    if recording.calcium is None:
        if pca is None:
            raise UserError(
                f"{recording.where}: calcium is not known; give --pca, a calcium column or a file name pattern"
            )
        return Calcium(clock.time_s[:1], np.array([10.0 ** (6.0 - pca)]), pca)
    found = _by_column(recording, recording.calcium, mapping, clock)
    if pca is not None and (found.pca is None or abs(found.pca - pca) > SAME_PCA):
        shown = "changes" if found.pca is None else f"is pCa {found.pca:.4g}"
        raise UserError(
            f"{recording.where}: pCa is given as {pca:g}, but calcium of {recording.calcium.name} {shown}; leave one "
            "of them out"
        )
    return found


def _by_column(recording: Recording, signal: Signal, mapping: ImportMapping, clock: Clock) -> Calcium:
    assert mapping.calcium is not None  # there is a signal
    unit = mapping.calcium.unit
    is_pca = unit.kind == "pCa"
    if is_pca:
        absurd = np.flatnonzero(~((signal.values >= PCA_RANGE[0]) & (signal.values <= PCA_RANGE[1])))
        if absurd.size:
            i = int(absurd[0])
            raise UserError(
                f"{signal.place(recording.where, i)} is pCa {signal.values[i]:g}; allowed is {PCA_RANGE[0]:g} to "
                f"{PCA_RANGE[1]:g}; is it a concentration?"
            )
    calcium_um = 10.0 ** (6.0 - signal.values) if is_pca else signal.values * unit.factor
    low, high = CALCIUM_RANGE_UM
    bad = np.flatnonzero(~((calcium_um >= low) & (calcium_um <= high)))
    if bad.size:
        i = int(bad[0])
        raise UserError(
            f"{signal.place(recording.where, i)} is {calcium_um[i]:.6g} µM; allowed is {low:g} to {high:g}; "
            "check the column and its unit"
        )
    changes = np.concatenate(([True], np.diff(calcium_um) != 0.0))
    pca = None
    if np.count_nonzero(changes) == 1 and calcium_um[0] > 0.0:
        pca = float(signal.values[0]) if is_pca else float(6.0 - np.log10(calcium_um[0]))
    time_s = times_of(signal, clock, recording, mapping)
    warnings = [*calcium_doubts(recording.where, mapping, calcium_um)]
    if not is_pca and re.match(r"p[ _-]?ca([^a-z0-9]|$)", mapping.calcium.name, re.IGNORECASE):
        warnings.append(
            f"{recording.where}: {signal.name} is read in {mapping.calcium.unit_name} but called pCa; is pCa its unit?"
        )
    count = int(np.count_nonzero(changes)) - 1
    if count:
        at = int(np.flatnonzero(changes)[1])
        warnings.append(
            f"{recording.where}: {signal.name} changes {count} times, first at {time_s[at]:.6g} s from "
            f"{calcium_um[at - 1]:.4g} to {calcium_um[at]:.4g} µM; this is one trial of changing calcium without a pCa"
        )
    return Calcium(time_s[changes], calcium_um[changes], pca, warnings=tuple(warnings))


def _by_activation(recording: Recording, mapping: ImportMapping, activation: Activation, clock: Clock) -> Calcium:
    transient = activation.transient
    intervals, how = _stimulated(recording, mapping, activation, clock)
    time_s, calcium_um = transient.samples(clock.time_s, intervals)
    times = ", ".join(f"{begin:.6g} to {end:.6g} s" for begin, end in intervals) or "never"
    note = (
        f"stimulated {times}{how}; free calcium by first-order activation from {transient.rest_um:g} to "
        f"{transient.tetanus_um:g} µM, rise {transient.rise_s:g} s, decay {transient.decay_s:g} s"
    )
    if activation.source:
        note += f" ({activation.source})"
    pca = float(6.0 - np.log10(calcium_um[0])) if calcium_um.size == 1 else None
    return Calcium(time_s, calcium_um, pca, (note,))


def _stimulated(
    recording: Recording, mapping: ImportMapping, activation: Activation, clock: Clock
) -> tuple[tuple[Interval, ...], str]:
    """Intervals of stimulation in the trial's own time, and how their end was found."""
    if mapping.stimulation is not None and recording.stimulation is not None:
        signal, told = recording.stimulation, mapping.stimulation
        level = signal.values * told.column.unit.factor
        time_s = times_of(signal, clock, recording, mapping)
        return stimulated_intervals(time_s, level, told.threshold, told.pulse_gap_s), ""
    assert activation.begin_s is not None  # the mapping was checked
    if math.isinf(activation.begin_s):
        return (), ""
    begin_s = activation.begin_s + clock.shift_s
    if activation.end_s is not None:
        return ((begin_s, activation.end_s + clock.shift_s),), ""
    assert recording.force is not None  # the mapping was checked
    end_s = force_drop(times_of(recording.force, clock, recording, mapping), recording.force.values, begin_s)
    if end_s is None:
        raise UserError(
            f"{recording.where}, {recording.force.name} shows no sharp drop after {begin_s:g} s; give the time at "
            "which stimulation ends as activation.end, or 'begin: never'"
        )
    return ((begin_s, end_s),), " (its end is where force begins to drop sharply)"
