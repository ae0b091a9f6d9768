"""Clocks and values of signals: sampling rate, gaps, times that stand still or go back, blanks."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from xb_muscle_ros.trials.readers.contents import Content
from xb_muscle_ros.trials.readers.parts import bounds_of_runs
from xb_muscle_ros.trials.stamps import largest_gap, not_after, to_ns
from xb_muscle_ros.trials.trial import Array

# Steps that differ by more than this part of the median are told.
_UNEVEN = 0.02


class Clock(NamedTuple):
    """Times of a signal.

    Attributes:
        runs: first sample of each run of time that starts anew, and the end.
        rate_hz: by the median step; None where there are less than two samples.
        faults: what is wrong with it, one line each.
    """

    runs: tuple[int, ...]
    rate_hz: float | None
    faults: tuple[str, ...]


def clock_of(times_s: Array, content: Content) -> Clock:
    """Look at times.

    Args:
        times_s: shape (n,), s, or any unit where that is not known; NaN where there is none.
        content: the signal that they are of, for its places.
    """
    finite = np.isfinite(times_s)
    if not finite.any():
        return Clock((0, 0), None, ("no time is a finite number",))
    whole = bool(finite.all())
    known: Sequence[int] = range(times_s.size) if whole else np.flatnonzero(finite).tolist()
    times = times_s if whole else times_s[finite]
    bounds = tuple(bounds_of_runs(times) or (0, times.size))
    forward = np.diff(times)
    if not np.all(forward > 0.0):
        forward = forward[forward > 0.0]
    rate = 1.0 / float(np.median(forward)) if forward.size else None
    del forward  # as large as the record
    faults = list(_faults(times, bounds, content, known))
    if len(bounds) > 2:
        faults.insert(0, f"time starts anew {len(bounds) - 2} times, first at {content.at(known[bounds[1]])}")
    return Clock(bounds, rate, tuple(faults))


def _faults(times: Array, bounds: tuple[int, ...], content: Content, known: Sequence[int]) -> Iterator[str]:
    back: list[int] = []
    for begin, end in itertools.pairwise(bounds):
        back += (not_after(to_ns(times[begin:end] - times[begin])) + begin).tolist()
    if back:
        i = back[0]
        what = "stands still" if times[i] == times[i - 1] else "goes back or stands still"
        where = content.at(known[i])
        yield f"time {what} {len(back)} times, first at {where} ({times[i - 1]:.9g}, then {times[i]:.9g})"
        return
    uneven = gaps = 0
    for begin, end in itertools.pairwise(bounds):
        gap = largest_gap(times[begin:end])
        if gap is not None:
            gaps += gap.of
            more = "" if gap.of == 1 else f", the largest of {gap.of} gaps"
            yield f"samples are missing from {gap.start_s:.9g} to {gap.end_s:.9g}{more}"
        steps = np.diff(times[begin:end])
        uneven += (
            int(np.count_nonzero(np.abs(steps - np.median(steps)) > _UNEVEN * np.median(steps))) if steps.size else 0
        )
    if uneven > gaps:
        yield f"{uneven} of {times.size - 1} steps differ from the median step by more than {100 * _UNEVEN:g} %"
    if times.size and times[0] < 0.0:
        yield f"times begin at {times[0]:.9g}; import shifts them to 0"


def value_faults(content: Content) -> Iterator[str]:
    """What is odd about values."""
    yield from content.faults
    missing = int(np.count_nonzero(~np.isfinite(content.values)))
    if missing and not content.faults:
        first = int(np.argmin(np.isfinite(content.values)))
        yield f"{missing} values are no finite numbers, the first at {content.at(first)}"
    if content.finite.size > 1 and np.ptp(content.finite) == 0.0:
        yield f"is constant at {content.finite[0]:.6g}"
