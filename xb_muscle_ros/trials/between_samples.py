"""Corners of a length record that lie between its samples.

A length protocol is straight from corner to corner. Where samples are milliseconds apart, the line from sample to
sample cuts each corner, by up to a quarter of the step times the change of speed: 6 ms at 0.45 L0/s make 0.7e-3 L0,
which at 30 F0/L0 is 2 % F0. The straight pieces on either side tell where the corner was: their lines meet there.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from xb_muscle_ros.trials.trial import Array, Phase, Trial

# Samples no further apart than this, s, are fine enough: cut corners cost 0.6 % F0 for a moment at 6 ms, in proportion
# less here, which is below what a diagnosis calls a mismatch (0.3 % F0).
COARSE_S = 2.51e-3
# Steps between samples for so long after a corner, s: force follows a ramp's begin and end within milliseconds.
FINE_S, AFTER_S = 2e-3, 0.03
# A piece is straight where its samples lie this near its line: so many L0, or so many times the record's noise.
STRAIGHT_L0, STRAIGHT_NOISE = 2e-5, 4.0
# More noise than this, L0, hides what is a corner and what is not.
NOISY_L0 = 1e-4
_FEWEST = 3
"""Samples of a line."""
# A corner is no bend: cut off in the middle between two samples it would cost at least this many tolerances. Lines
# along a curve, as long as their tolerance lets them be, meet in bends of at most 4/3.
_LEAST = 3.0
# So many tolerances around a sample its corner may seem to lie where it is at the sample itself.
_SLACK = 4.0
# Differences of white noise are this much larger than the noise, by their order; a quarter of a normal distribution
# lies within so many of its standard deviations.
_LARGER = {2: 6.0**0.5, 3: 20.0**0.5, 4: 70.0**0.5}
_QUARTER, _WITHIN = 0.25, 0.3186


class Line(NamedTuple):
    """Samples ``first`` to ``last`` (inclusive) on a straight line: value at the time of the first, and slope."""

    first: int
    last: int
    start_s: float
    level: float
    slope: float

    def at(self, time_s: float) -> float:
        """Value of the line at a time."""
        return self.level + self.slope * (time_s - self.start_s)


class Refined(NamedTuple):
    """A length record on a finer grid.

    Attributes:
        time_s, length_l0: shape (n,); all samples as they were, and what lies between.
        corners: how many there are between samples.
    """

    time_s: Array
    length_l0: Array
    corners: int


def with_corners(trial: Trial) -> Trial:
    """The trial with the corners of its length record, and finer steps for 30 ms after each.

    Force and calcium stay at their own times. A trial comes back as it is where samples are 2.5 ms apart or less, where
    length is not straight between corners or a protocol made it oscillate, and where this has refined it before.
    """
    if trial.facts.setting("frequency_hz") is not None:
        return trial  # a sinusoid, whose flanks are nearly straight
    found = refined(trial.time_s, trial.length_change_l0, trial.facts.phases)
    if not found.corners:
        return trial
    length_m = trial.facts.reference_length_m * (1.0 + found.length_l0)
    # Samples to the last bit.
    length_m[np.searchsorted(found.time_s, trial.time_s)] = trial.length_m
    return replace(trial, time_s=found.time_s, length_m=length_m)


def refined(time_s: Array, length_l0: Array, phases: tuple[Phase, ...] = ()) -> Refined:
    """Put corners between samples back.

    Args:
        time_s, length_l0: shape (n,), increasing, s and L0.
        phases: of the record, where known; a pause that falls between two samples is taken from them.

    Returns:
        the record as it is, with no corner, where its samples are fine enough, noisy or on no straight lines.
    """
    unchanged = Refined(time_s, length_l0, 0)
    if time_s.size < 2 * _FEWEST or float(np.median(np.diff(time_s))) <= COARSE_S:
        return unchanged
    noise = _noise(time_s, length_l0)
    if noise > NOISY_L0:
        return unchanged
    tolerance = max(STRAIGHT_L0, STRAIGHT_NOISE * noise)
    lines = straight_lines(time_s, length_l0, tolerance)
    points = [p for pair in itertools.pairwise(lines) for p in _corner(*pair, time_s, phases, tolerance)]
    corners = np.array(points).reshape(-1, 2)
    times, kept = np.unique(np.concatenate([time_s, corners[:, 0]]), return_index=True)
    lengths = np.concatenate([length_l0, corners[:, 1]])[kept]
    fine = _fine_times(times, corners[:, 0])
    if fine.size == time_s.size:
        return unchanged
    return Refined(fine, np.interp(fine, times, lengths), len(points))


def straight_lines(time_s: Array, length_l0: Array, tolerance: float) -> list[Line]:
    """Straight pieces of three samples or more, each as long as it goes, in order of time.

    Args:
        time_s, length_l0: shape (n,).
        tolerance: how far a sample may lie off a line, in the unit of length.
    """
    lines: list[Line] = []
    times, lengths = time_s.tolist(), length_l0.tolist()
    first = 0
    while first <= len(times) - _FEWEST:
        line = _longest(first, times, lengths, tolerance)
        is_line = line.last - first + 1 >= _FEWEST
        first = line.last + 1 if is_line else first + 1
        lines += [line] if is_line else []
    return lines


def _longest(first: int, times: list[float], lengths: list[float], tolerance: float) -> Line:
    """The line of least squares from a sample on as far as samples keep to it, by sums that one more adds to."""
    line = Line(first, first, times[first], lengths[first], 0.0)
    # Of times since the first sample and of lengths beside it; squares and products.
    time = length = squares = products = 0.0
    for last in range(first, len(times)):
        n = last - first
        if n > 1:
            # Evenly sampled, the variance of a line's next value is 1 + (4 n + 2)/(n (n - 1)) times that of a sample.
            allowed = tolerance * math.sqrt(1.0 + (4.0 * n + 2.0) / (n * (n - 1.0)))
            if abs(lengths[last] - line.at(times[last])) > allowed:
                break
        since, beside = times[last] - times[first], lengths[last] - lengths[first]
        time += since
        length += beside
        squares += since * since
        products += since * beside
        if n:
            mean_s, mean = time / (n + 1), length / (n + 1)
            slope = (products - time * mean) / (squares - time * mean_s)
            line = Line(first, last, times[first], lengths[first] + mean - slope * mean_s, slope)
    return line


def _corner(
    left: Line, right: Line, time_s: Array, phases: tuple[Phase, ...], tolerance: float
) -> list[tuple[float, float]]:
    """The corner (s, L0) between two lines that follow each other, or both corners of a pause that hides there."""
    before_s, after_s = float(time_s[left.last]), float(time_s[right.first])
    bend = abs(right.slope - left.slope)
    if right.first != left.last + 1 or 0.25 * bend * (after_s - before_s) < _LEAST * tolerance:
        return []
    met_s = before_s + (left.at(before_s) - right.at(before_s)) / (right.slope - left.slope)
    for phase in phases:
        if before_s < phase.start_s < phase.end_s < after_s and phase.start_s <= met_s <= phase.end_s:
            return [(phase.start_s, left.at(phase.start_s)), (phase.end_s, right.at(phase.end_s))]
    for sample_s, outside in ((before_s, met_s < before_s), (after_s, met_s > after_s)):
        near = bend * abs(met_s - sample_s)
        if near <= tolerance or (outside and near <= _SLACK * tolerance):
            return [(sample_s, left.at(sample_s))]
    return [(met_s, left.at(met_s))] if before_s < met_s < after_s else []


def _noise(time_s: Array, length_l0: Array) -> float:
    """Standard deviation of a record's white noise, from its smallest differences.

    High ones leave out what curves, low ones see the fewest corners; what either has beside noise makes it larger.
    """
    step_s, divided = float(np.median(np.diff(time_s))), length_l0
    found = []
    for order in range(1, 5):
        divided = np.diff(divided) / (time_s[order:] - time_s[:-order])
        if order in _LARGER and divided.size:
            # As differences of samples a usual step apart.
            size = float(np.quantile(np.abs(divided), _QUARTER)) * math.factorial(order) * step_s**order
            found.append(size / _LARGER[order] / _WITHIN)
    return float(np.min(found))


def _fine_times(time_s: Array, corners_s: Array) -> Array:
    """Times with steps of at most 2 ms for 30 ms after each corner."""
    found = [time_s]
    for corner_s in corners_s:
        end_s = corner_s + AFTER_S
        inside = time_s[(time_s >= corner_s) & (time_s < end_s)]
        for begin_s, next_s in itertools.pairwise([*inside, *time_s[time_s >= end_s][:1]]):
            parts = int(np.ceil((min(next_s, end_s) - begin_s) / FINE_S - 1e-6))
            found.append(begin_s + (min(next_s, end_s) - begin_s) * np.arange(1, parts) / parts)
            if next_s > end_s and next_s - begin_s > FINE_S:
                found.append(np.array([end_s]))
    return np.unique(np.concatenate(found))
