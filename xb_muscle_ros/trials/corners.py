"""Straight pieces of a length record and the corners between them.

A ramp imposed on a fibre is a straight line; its recording has noise and, where it was smoothed, rounded corners.
Lines fitted to the middles of the pieces are free of both, so a corner is taken where two neighbouring lines meet.
"""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np

from xb_muscle_ros.trials.runs import (
    LASTING_SAMPLES,
    Run,
    lasting_samples,
    merge,
    samples_of,
    split,
    with_steps,
    without_departure,
    without_give,
)
from xb_muscle_ros.trials.trial import Array

# A slope belongs to a ramp above this fraction of the fastest slope, so that halves of rounded corners are split.
RAMP_FRACTION = 0.3
# The slope's noise (standard deviation) has to be this much smaller than the fastest slope.
NOISE_FRACTION = 0.08
# Half-windows of the slope estimate, samples; the smallest quiet enough is used, so that short ramps stay visible.
# Long ones, beyond this in s, are for finer samples alone: they would blur a ramp of the paper's.
HALF_WINDOWS = (1, 2, 3, 4, 6, 8, 12, 16, 24, 36, 54, 80, 120, 180, 240)
LONGEST_HALF_WINDOW_S, ALWAYS_TRIED = 0.024, 24
# Ramps below these are wobble: relative to the largest ramp, and to the length itself.
SMALLEST_RAMP = 0.01
SMALLEST_STRAIN = 3e-4
# Beside much faster ramps, a slow one is looked for where a level ends this much (L0) off its begin.
SLOW_STRAIN = 5e-3
# A shorter pause cannot be told from a rounded corner: filters and motors round over some 12 ms. Samples, at 1 kHz and
# above; what is sampled more coarsely is not smoothed that much, but a pause has a few samples all the same.
SHORTEST_PAUSE, FEWEST_IN_PAUSE = 9, 3
SHORTEST_PAUSE_S = 9e-3
# Half of a record may be ramps and their corners, which are no noise: this quantile of the slope's changes is.
QUIET_QUANTILE, QUIET_FACTOR = 0.25, 3.138
# A ramp of few samples begins and ends where it is this near its levels, as part of its rise.
STEP_EDGE = 0.05
# A level next to a corner is taken from at most this many samples, so that slow drift further away does not count.
LEVEL_SAMPLES = 100


class Piece(NamedTuple):
    """A straight piece of a length record.

    Attributes:
        direction: +1 stretch, 0 isometric, -1 shortening.
        start_s: begin, s.
        end_s: end, s.
        line: slope (length unit per s) and offset (length unit, at time 0).
    """

    direction: int
    start_s: float
    end_s: float
    line: tuple[float, float]


def straight_pieces(time_s: Array, length: Array, l0: float | None = None, servo_give: float = 0.0) -> list[Piece]:
    """Split a length record into straight pieces.

    Args:
        time_s: shape (n,), strictly increasing, s.
        length: shape (n,), length (not its change) in any unit.
        l0: the length that is L0, in that unit; None for the median of the record.
        servo_give: changes of length up to this that come back are no ramps, in that unit.

    Returns:
        Pieces in order of time that touch each other and cover the whole record; the level of an isometric piece is
        its line's offset.
    """
    l0 = float(np.median(length)) if l0 is None else l0
    slope, half_window = _quiet_slope(time_s, length)
    runs = _ramp_runs(time_s, length, slope, half_window)
    runs = merge([part for run in runs for part in _slower_ramps(run, time_s, length, l0)])
    runs = without_give(without_departure(runs, lasting_samples(time_s)), length, servo_give)
    runs = with_steps(runs, time_s, length, l0)
    lines = [_line(time_s, length, run, half_window) for run in runs]
    corners = [float(time_s[0])]
    for (left, left_line), (right, right_line) in itertools.pairwise(zip(runs, lines, strict=True)):
        low, high = (0.5 * (time_s[run.first] + time_s[run.last]) for run in (left, right))
        met = _meeting(
            _facing_line(length, left, left_line, half_window, at_end=True),
            _facing_line(length, right, right_line, half_window, at_end=False),
        )
        # Lines that meet outside both pieces are no corner of theirs; the sample where the direction changed then is.
        corners.append(met if met is not None and low <= met <= high else float(time_s[right.first]))
    corners.append(float(time_s[-1]))
    return [Piece(run.direction, corners[i], corners[i + 1], lines[i]) for i, run in enumerate(runs)]


def _quiet_slope(time_s: Array, length: Array) -> tuple[Array, int]:
    """Slope of the length over the smallest window that keeps its noise down; zero where no window does."""
    step_s = float(np.median(np.diff(time_s))) if time_s.size > 1 else 0.0
    for half_window in HALF_WINDOWS:
        too_long = half_window > ALWAYS_TRIED and half_window * step_s > LONGEST_HALF_WINDOW_S
        if time_s.size < 4 * half_window + 3 or too_long:
            break
        slope = _slope(time_s, length, half_window)
        fastest = _fastest(slope, lasting_samples(time_s))
        apart = slope[2 * half_window + 1 :] - slope[: -(2 * half_window + 1)]
        noise = QUIET_FACTOR * float(np.quantile(np.abs(apart), QUIET_QUANTILE)) / np.sqrt(2.0)
        # A step within a few samples lasts only as long as the window.
        if fastest > 0.0 and noise <= NOISE_FRACTION * fastest:
            return slope, half_window
    return np.zeros_like(length), 1


def _fastest(slope: Array, lasting: int) -> float:
    """The fastest slope that lasts: a glitch of one sample is faster than any ramp."""
    count = slope.size - min(lasting, slope.size) + 1
    found = 0.0
    for sign in (1.0, -1.0):
        least = sign * slope[:count]
        for k in range(1, slope.size - count + 1):
            np.minimum(least, sign * slope[k : k + count], out=least)
        found = max(found, float(np.max(least)))
    return found


def _slope(time_s: Array, length: Array, half_window: int) -> Array:
    """Mean of the samples after minus mean of those before, over the time between; shape (n,)."""

    def after_minus_before(values: Array) -> Array:
        # total[k] is the sum of the samples before the k-th.
        total = np.zeros(values.size + 1)
        np.cumsum(values - values[0], out=total[1:])
        count = values.size - 2 * half_window
        after = total[2 * half_window + 1 :] - total[half_window + 1 : half_window + 1 + count]
        before = total[half_window : half_window + count] - total[:count]
        after -= before
        after /= half_window
        return after

    inner = after_minus_before(length) / after_minus_before(time_s)
    return np.pad(inner, half_window, mode="edge")


def _ramp_runs(time_s: Array, length: Array, slope: Array, half_window: int) -> list[Run]:
    """Runs of samples with one direction; wobble and pauses shorter than the slope's window are not runs."""
    fastest = _fastest(slope, lasting_samples(time_s))
    moving = np.abs(slope) > RAMP_FRACTION * fastest if fastest > 0.0 else np.zeros(slope.size, dtype=bool)
    runs = split((np.sign(slope) * moving).astype(np.int64))
    rise = [abs(float(length[run.last] - length[run.first])) if run.direction else 0.0 for run in runs]
    smallest = max(SMALLEST_RAMP * max(rise), SMALLEST_STRAIN * abs(float(np.median(length))))
    runs = merge([run if up >= smallest else run._replace(direction=0) for run, up in zip(runs, rise, strict=True)])
    shortest_pause = max(samples_of(SHORTEST_PAUSE_S, time_s, FEWEST_IN_PAUSE, SHORTEST_PAUSE), 2 * half_window + 1)
    # The samples of shorter pauses belong to no piece: neither line is fitted to them.
    seen = [run for run in runs if run.direction or run.samples >= shortest_pause]
    return [_sharpened(run, length, half_window) for run in merge(seen or runs)]


def _sharpened(run: Run, length: Array, half_window: int) -> Run:
    """A ramp shorter than the slope's window without the samples of the levels beside it."""
    if run.direction == 0 or not 1 < run.samples <= 4 * half_window + 2:
        return run
    part = length[run.first : run.last + 1]
    low, high = sorted((float(part[0]), float(part[-1])))
    margin = STEP_EDGE * (high - low)
    inside = (part > low + margin) & (part < high - margin)
    first = int(np.argmax(np.abs(np.diff(part))))  # a motor may ring after its step, but more slowly
    last = first + 1
    while first > 0 and inside[first]:
        first -= 1
    while last < part.size - 1 and inside[last]:
        last += 1
    return run._replace(first=run.first + first, last=run.first + last)


def _slower_ramps(run: Run, time_s: Array, length: Array, l0: float) -> list[Run]:
    """Runs within one that is isometric beside faster ramps, but ends elsewhere than it begins."""
    edge = max(run.samples // 20, 3)
    if run.direction != 0 or run.samples < 10 * LASTING_SAMPLES:
        return [run]
    part = length[run.first : run.last + 1]
    if abs(float(np.median(part[-edge:]) - np.median(part[:edge]))) < SLOW_STRAIN * l0:
        return [run]
    slope, half_window = _quiet_slope(time_s[run.first : run.last + 1], part)
    found = _ramp_runs(time_s[run.first : run.last + 1], part, slope, half_window)
    found[0], found[-1] = found[0]._replace(first=0), found[-1]._replace(last=part.size - 1)
    return [Run(each.direction, run.first + each.first, run.first + each.last) for each in found]


def _core(run: Run, half_window: int) -> slice:
    """The samples of a run without its rounded ends."""
    trim = min(max(int(np.ceil(0.15 * run.samples)), half_window), run.samples // 4)
    return slice(run.first + trim, run.last + 1 - trim)


def _line(time_s: Array, length: Array, run: Run, half_window: int) -> tuple[float, float]:
    """Straight line (slope, offset) through the middle of a run; a level where the run is isometric."""
    core = _core(run, half_window)
    if run.direction == 0 or run.samples < 2:
        return 0.0, float(np.mean(length[core]))
    middle = float(np.mean(time_s[core]))  # centred: times may be large against their spread
    slope, level = np.polyfit(time_s[core] - middle, length[core], 1)
    return float(slope), float(level - slope * middle)


def _facing_line(
    length: Array, run: Run, line: tuple[float, float], half_window: int, *, at_end: bool
) -> tuple[float, float]:
    """The run's line, or for an isometric run the level of the samples nearest the corner."""
    if run.direction != 0:
        return line
    core = length[_core(run, half_window)]
    return 0.0, float(np.mean(core[-LEVEL_SAMPLES:] if at_end else core[:LEVEL_SAMPLES]))


def _meeting(left: tuple[float, float], right: tuple[float, float]) -> float | None:
    """Time at which two lines meet, s; None for parallels."""
    if left[0] == right[0]:
        return None
    return (right[1] - left[1]) / (left[0] - right[0])
