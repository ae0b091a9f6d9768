"""Times of a recording: checked, in s, and as a bag keeps them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials import ros_types
from xb_muscle_ros.trials.readers.description import ImportMapping
from xb_muscle_ros.trials.readers.plausibility import time_doubts
from xb_muscle_ros.trials.readers.recording import Recording, Signal
from xb_muscle_ros.trials.trial import Array

# Beyond these it is no muscle's recording, or its unit is wrong.
STEP_RANGE_S = (1e-6, 0.2)
# A step this many times as long as those around it has lost samples.
GAP_STEPS = 5.0


class Clock(NamedTuple):
    """Times of the lengths (s), and what was added to the file's times (s) so that they do not begin below 0."""

    time_s: Array
    shift_s: float
    warnings: tuple[str, ...] = ()


def read_clock(recording: Recording, mapping: ImportMapping) -> Clock:
    """Times of the lengths.

    Raises:
        UserError: times that do not increase, or steps that no recording of a muscle has.
    """
    where, signal, column = recording.where, recording.time, mapping.time
    if signal.values.size < 2:
        raise UserError(f"{where}, {signal.name} has one sample; a trial needs two at least; give a whole recording")
    time_s = signal.values * column.unit.factor
    _check_order(where, signal, time_s)
    step_s = float(np.median(np.diff(time_s)))
    largest_s = mapping.largest_step_s or STEP_RANGE_S[1]
    if not STEP_RANGE_S[0] <= step_s <= largest_s:
        raise UserError(
            f"{where}, {signal.name}: samples are {step_s:.3g} s apart; allowed is {STEP_RANGE_S[0]:g} to "
            f"{largest_s:g} s; is {column.unit_name} its unit?"
        )
    shift_s, warnings = 0.0, [*gaps(where, signal, time_s, mapping), *time_doubts(where, mapping, step_s)]
    if time_s[0] < 0.0:
        shift_s = -float(time_s[0])
        warnings.append(f"{where}: times shifted by {shift_s:.9g} s, because a stamp cannot be negative")
    return Clock(_stamped(time_s + shift_s), shift_s, tuple(warnings))


def gaps(where: str, signal: Signal, time_s: Array, mapping: ImportMapping) -> Iterator[str]:
    """A line where samples are missing, after making sure that no gap is larger than allowed.

    A step counts as a gap by those around it, because some records are sampled more and more slowly.

    Args:
        where: the trial, for messages.
        signal: whose times they are.
        time_s: increasing times, s.
        mapping: tells the largest step allowed; what it allows is no gap.

    Raises:
        UserError: the largest step is larger than allowed.
    """
    steps = np.diff(time_s)
    if not steps.size:
        return
    largest_s = mapping.largest_step_s or STEP_RANGE_S[1]
    i = int(np.argmax(steps))
    if steps[i] > largest_s * (1.0 + 1e-9):
        raise UserError(
            f"{signal.place(where, i + 1)}: samples are missing from {time_s[i]:.9g} to {time_s[i + 1]:.9g} s "
            f"({steps[i]:.6g} s); allowed are {largest_s:g} s between samples (columns.time.largest_step); cut the "
            "record, or allow more"
        )
    if mapping.largest_step_s is not None:
        return
    around = np.array([np.median(np.delete(steps[max(j - 5, 0) : j + 6], min(j, 5))) for j in _candidates(steps)])
    found = [j for j, usual in zip(_candidates(steps), around, strict=True) if steps[j] > GAP_STEPS * usual]
    if found:
        i = max(found, key=lambda j: float(steps[j]))
        more = "" if len(found) == 1 else f", the largest of {len(found)} gaps"
        yield (
            f"{where}, {signal.name}: samples are missing from {time_s[i]:.9g} to {time_s[i + 1]:.9g} s{more}; a "
            "straight line is taken between them"
        )


def _candidates(steps: Array) -> list[int]:
    """Steps that may be gaps; with less than two others around there is nothing to compare with."""
    if steps.size < 3:
        return []
    return [int(j) for j in np.flatnonzero(steps > GAP_STEPS * np.quantile(steps, 0.1))]


def times_of(signal: Signal, clock: Clock, recording: Recording, mapping: ImportMapping) -> Array:
    """Times of another signal, s: those of the lengths, or its own.

    Raises:
        UserError: its own do not increase, or begin before time 0.
    """
    if signal.times is None:
        return clock.time_s
    time_s = signal.times * mapping.time.unit.factor + clock.shift_s
    _check_order(recording.where, signal, time_s)
    if time_s[0] < 0.0:
        raise UserError(
            f"{signal.place(recording.where, 0)} is at {time_s[0]:.9g} s; allowed are times from 0, where the lengths "
            "begin; cut the record"
        )
    return _stamped(time_s)


def _check_order(where: str, signal: Signal, time_s: Array) -> None:
    steps_ns = np.diff(ros_types.to_ns(time_s - time_s[0]))
    back = np.flatnonzero(steps_ns <= 0)
    if back.size:
        i = int(back[0]) + 1
        equal = int(np.count_nonzero(steps_ns == 0))
        if equal == back.size > 1:
            raise UserError(
                f"{signal.place(where, i)}: {time_s[i]:.9g} s comes again, as {equal} times do; if the column is "
                "rounded, leave it out and give the rate of the samples (--rate '1000 Hz'), else remove the doubles"
            )
        raise UserError(
            f"{signal.place(where, i)}: {time_s[i]:.9g} s does not come after {time_s[i - 1]:.9g} s; time has to "
            "increase from sample to sample; mend or remove it"
        )


def _stamped(time_s: Array) -> Array:
    return ros_types.to_s(ros_types.to_ns(time_s))
