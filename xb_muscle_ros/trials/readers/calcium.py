"""Free calcium of a trial: from a column, from pCa, or from stimulation by the activation stage."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.activation import Interval, force_drop, stimulated_intervals
from xb_muscle_ros.trials.readers.clock import Clock, times_of
from xb_muscle_ros.trials.readers.description import Activation, ImportMapping
from xb_muscle_ros.trials.readers.recording import Recording, Signal
from xb_muscle_ros.trials.trial import Array

# Beyond these it is no free calcium, or its unit is wrong.
CALCIUM_RANGE_UM = (0.0, 1e5)


class Calcium(NamedTuple):
    """Times (s) and values (µM) of calcium where it changes, pCa where it does not, and notes for the source."""

    time_s: Array
    calcium_um: Array
    pca: float | None
    notes: tuple[str, ...] = ()


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
    return _by_column(recording, recording.calcium, mapping, clock)


def _by_column(recording: Recording, signal: Signal, mapping: ImportMapping, clock: Clock) -> Calcium:
    assert mapping.calcium is not None  # there is a signal
    unit = mapping.calcium.unit
    is_pca = unit.kind == "pCa"
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
    return Calcium(time_s[changes], calcium_um[changes], pca)


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
