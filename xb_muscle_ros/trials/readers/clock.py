"""Times of a recording: checked, in s, and as a bag keeps them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials import ros_types
from xb_muscle_ros.trials.readers.description import ImportMapping
from xb_muscle_ros.trials.readers.recording import Recording, Signal
from xb_muscle_ros.trials.trial import Array

# Beyond these it is no muscle's recording, or its unit is wrong.
STEP_RANGE_S = (1e-6, 0.2)


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
    time_s = signal.values * column.unit.factor
    _check_order(where, signal, time_s)
    step_s = float(np.median(np.diff(time_s))) if time_s.size > 1 else STEP_RANGE_S[0]
    largest_s = mapping.largest_step_s or STEP_RANGE_S[1]
    if not STEP_RANGE_S[0] <= step_s <= largest_s:
        raise UserError(
            f"{where}, {signal.name}: samples are {step_s:.3g} s apart; allowed is {STEP_RANGE_S[0]:g} to "
            f"{largest_s:g} s; is {column.unit_name} its unit?"
        )
    shift_s, warnings = 0.0, []
    if time_s[0] < 0.0:
        shift_s = -float(time_s[0])
        warnings.append(f"{where}: times shifted by {shift_s:.9g} s, because a stamp cannot be negative")
    return Clock(_stamped(time_s + shift_s), shift_s, tuple(warnings))


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
    back = np.flatnonzero(np.diff(ros_types.to_ns(time_s - time_s[0])) <= 0)
    if back.size:
        i = int(back[0]) + 1
        raise UserError(
            f"{signal.place(where, i)}: {time_s[i]:.9g} s does not come after {time_s[i - 1]:.9g} s; time has to "
            "increase from sample to sample; mend or remove it"
        )


def _stamped(time_s: Array) -> Array:
    return ros_types.to_s(ros_types.to_ns(time_s))
