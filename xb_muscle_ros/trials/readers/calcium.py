"""Free calcium of a trial: from a column, from pCa, or from stimulation by the activation stage."""

from __future__ import annotations

import math
import re
from typing import NamedTuple

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.activation import Interval, force_drop, stimulated_intervals
from xb_muscle_ros.trials.checks import CALCIUM_UM
from xb_muscle_ros.trials.readers.base import Draft, Signal
from xb_muscle_ros.trials.readers.clock import Clock, times_of
from xb_muscle_ros.trials.readers.description import Activation
from xb_muscle_ros.trials.readers.plausibility import warn_of_calcium
from xb_muscle_ros.trials.trial import Array

# Beyond these no command takes calcium.
_CALCIUM_UM = (0.0, CALCIUM_UM)
PCA_RANGE = (6.0 - math.log10(CALCIUM_UM), 12.0)
# pCa is noted to a tenth.
SAME_PCA = 0.05
PCA_COLUMN = re.compile(r"p[ _-]?ca([^a-z0-9]|$)", re.IGNORECASE)
PCA_NUMBER = re.compile(r"p[ _-]?ca[ _=:-]*(\d+(?:[.,]\d+)?)", re.IGNORECASE)


def pcas_in(words: str) -> list[float]:
    """The pCa that a name or comment tells, in its order, each once; 61 is 6.1."""
    told = [float(text.replace(",", ".")) for text in PCA_NUMBER.findall(words)]
    return list(dict.fromkeys(each / 10.0 if each > PCA_RANGE[1] else each for each in told))


class Calcium(NamedTuple):
    """Times (s) and values (µM) of calcium where it changes, and pCa where it does not."""

    time_s: Array
    calcium_um: Array
    pca: float | None


def read_calcium(draft: Draft, clock: Clock) -> Calcium:
    """Calcium of a trial.

    Raises:
        UserError: calcium is not known, or no muscle has it.
    """
    pca, signal = draft.recording.facts.get("pca"), draft.recording.signals.get("calcium")
    if draft.mapping.activation is not None:
        return _by_activation(draft, draft.mapping.activation, clock)
    if signal is None:
        if pca is None:
            raise UserError(f"{draft.where}: calcium is not known; give --pca, a calcium column or a file name pattern")
        return Calcium(clock.time_s[:1], np.array([10.0 ** (6.0 - pca)]), pca)
    found = _by_column(draft, signal, clock)
    if pca is not None and (found.pca is None or abs(found.pca - pca) > SAME_PCA):
        shown = "changes" if found.pca is None else f"is pCa {found.pca:.4g}"
        raise UserError(
            f"{draft.where}: pCa is given as {pca:g}, but calcium of {signal.name} {shown}; leave one of them out"
        )
    return found


def _by_column(draft: Draft, signal: Signal, clock: Clock) -> Calcium:
    where, column = draft.where, draft.mapping.calcium
    assert column is not None  # there is a signal
    is_pca = column.unit.kind == "pCa"
    if is_pca:
        signal.check(where, signal.values, PCA_RANGE, "pCa {:g}", "is it a concentration?")
    calcium_um = 10.0 ** (6.0 - signal.values) if is_pca else signal.values * column.unit.factor
    signal.check(where, calcium_um, _CALCIUM_UM, "{:.6g} µM", "check the column and its unit")
    changes = np.concatenate(([True], np.diff(calcium_um) != 0.0))
    pca = None
    if np.count_nonzero(changes) == 1 and calcium_um[0] > 0.0:
        pca = float(signal.values[0]) if is_pca else float(6.0 - np.log10(calcium_um[0]))
    time_s = times_of(signal, clock, draft)
    warn_of_calcium(draft, calcium_um)
    if not is_pca and PCA_COLUMN.match(column.name):
        draft.warn(f"{signal.name} is read in {column.unit_name} but called pCa; is pCa its unit?")
    count = int(np.count_nonzero(changes)) - 1
    if count:
        at = int(np.flatnonzero(changes)[1])
        draft.warn(
            f"{signal.name} changes {count} times, first at {time_s[at]:.6g} s from {calcium_um[at - 1]:.4g} to "
            f"{calcium_um[at]:.4g} µM; this is one trial of changing calcium without a pCa"
        )
    return Calcium(time_s[changes], calcium_um[changes], pca)


def _by_activation(draft: Draft, activation: Activation, clock: Clock) -> Calcium:
    transient = activation.transient
    intervals, how = _stimulated(draft, activation, clock)
    time_s, calcium_um = transient.samples(clock.time_s, intervals)
    times = ", ".join(f"{begin:.6g} to {end:.6g} s" for begin, end in intervals) or "never"
    source = f" ({activation.source})" if activation.source else ""
    draft.notes.append(
        f"stimulated {times}{how}; free calcium by first-order activation from {transient.rest_um:g} to "
        f"{transient.tetanus_um:g} µM, rise {transient.rise_s:g} s, decay {transient.decay_s:g} s{source}"
    )
    return Calcium(time_s, calcium_um, float(6.0 - np.log10(calcium_um[0])) if calcium_um.size == 1 else None)


def _stimulated(draft: Draft, activation: Activation, clock: Clock) -> tuple[tuple[Interval, ...], str]:
    """Intervals of stimulation in the trial's own time, and how their end was found."""
    told, signal = draft.mapping.stimulation, draft.recording.signals.get("stimulation")
    if told is not None and signal is not None:
        level = signal.values * told.column.unit.factor
        return stimulated_intervals(times_of(signal, clock, draft), level, told.threshold, told.pulse_gap_s), ""
    assert activation.begin_s is not None  # the mapping was checked
    if math.isinf(activation.begin_s):
        return (), ""
    begin_s = activation.begin_s + clock.shift_s
    if activation.end_s is not None:
        return ((begin_s, activation.end_s + clock.shift_s),), ""
    force = draft.recording.signals["force"]
    end_s = force_drop(times_of(force, clock, draft), force.values, begin_s)
    if end_s is None:
        raise UserError(
            f"{draft.where}, {force.name} shows no sharp drop after {begin_s:g} s; give the time at which stimulation "
            "ends as activation.end, or 'begin: never'"
        )
    return ((begin_s, end_s),), " (its end is where force begins to drop sharply)"
