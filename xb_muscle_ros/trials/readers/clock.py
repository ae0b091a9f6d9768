"""Times of a recording: checked, in s, and as a bag keeps them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.readers.base import Draft, Signal
from xb_muscle_ros.trials.readers.plausibility import warn_of_time_step
from xb_muscle_ros.trials.stamps import largest_gap, not_after, to_ns, to_s
from xb_muscle_ros.trials.trial import Array

# Beyond these it is no muscle's recording, or its unit is wrong.
STEP_RANGE_S = (1e-6, 0.2)


class Clock(NamedTuple):
    """Times of the lengths (s), and what was added to the file's times (s) so that they do not begin below 0."""

    time_s: Array
    shift_s: float


def read_clock(draft: Draft) -> Clock:
    """Times of the lengths.

    Raises:
        UserError: times that do not increase, or steps that no recording of a muscle has.
    """
    where, mapping, signal = draft.where, draft.mapping, draft.recording.signals["time"]
    if signal.values.size < 2:
        raise UserError(f"{where}, {signal.name} has one sample; a trial needs two at least; give a whole recording")
    time_s = signal.values * mapping.time.unit.factor
    _check_order(where, signal, time_s)
    step_s = float(np.median(np.diff(time_s)))
    largest_s = mapping.largest_step_s or STEP_RANGE_S[1]
    if not STEP_RANGE_S[0] <= step_s <= largest_s:
        raise UserError(
            f"{where}, {signal.name}: samples are {step_s:.3g} s apart; allowed is {STEP_RANGE_S[0]:g} to "
            f"{largest_s:g} s; is {mapping.time.unit_name} its unit?"
        )
    check_gaps(draft, signal, time_s)
    warn_of_time_step(draft, step_s)
    shift_s = max(-float(time_s[0]), 0.0)
    if shift_s:
        draft.warn(f"times shifted by {shift_s:.9g} s, because a stamp cannot be negative")
    return Clock(_stamped(time_s + shift_s), shift_s)


def check_gaps(draft: Draft, signal: Signal, time_s: Array) -> None:
    """Warn where samples are missing, after making sure that no gap is larger than allowed.

    Args:
        draft: its mapping tells the largest step allowed; what that allows is no gap.
        time_s: increasing times, s.

    Raises:
        UserError: the largest step is larger than allowed.
    """
    steps = np.diff(time_s)
    if not steps.size:
        return
    largest_s = draft.mapping.largest_step_s or STEP_RANGE_S[1]
    i = int(np.argmax(steps))
    if steps[i] > largest_s * (1.0 + 1e-9):
        raise UserError(
            f"{signal.place(draft.where, i + 1)}: samples are missing from {time_s[i]:.9g} to {time_s[i + 1]:.9g} s "
            f"({steps[i]:.6g} s); allowed are {largest_s:g} s between samples (columns.time.largest_step); cut the "
            "record, or allow more"
        )
    gap = largest_gap(time_s) if draft.mapping.largest_step_s is None else None
    if gap is not None:
        more = "" if gap.of == 1 else f", the largest of {gap.of} gaps"
        draft.warnings.append(
            f"{draft.where}, {signal.name}: samples are missing from {gap.start_s:.9g} to {gap.end_s:.9g} s{more}; a "
            "straight line is taken between them"
        )


def times_of(signal: Signal, clock: Clock, draft: Draft) -> Array:
    """Times of another signal, s: those of the lengths, or its own.

    Raises:
        UserError: its own do not increase, or begin before time 0.
    """
    if signal.times is None:
        return clock.time_s
    time_s = signal.times * draft.mapping.time.unit.factor + clock.shift_s
    _check_order(draft.where, signal, time_s)
    if time_s[0] < 0.0:
        raise UserError(
            f"{signal.place(draft.where, 0)} is at {time_s[0]:.9g} s; allowed are times from 0, where the lengths "
            "begin; cut the record"
        )
    return _stamped(time_s)


def _check_order(where: str, signal: Signal, time_s: Array) -> None:
    stamps = to_ns(time_s - time_s[0])
    back = not_after(stamps)
    if back.size:
        i = int(back[0])
        equal = int(np.count_nonzero(np.diff(stamps) == 0))
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
    return to_s(to_ns(time_s))
