"""Where a force is clamped, and how fast length changes there."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from xb_muscle_ros.scores.estimate import Missing, samples
from xb_muscle_ros.trials.trial import Array

# Force within this of its level counts as clamped, F0; a clamp lasts at least so long, s.
_CLAMPED_F0, _SHORTEST_S = 0.03, 0.01
# The load is the median over what comes after the first part of a clamp, in which the springs give way.
_AFTER = 0.2
_FEWEST = 5
# Length moves in a time if it goes so far, L0, by so many standard errors, and this share of the farthest that it goes
# at any one level of force: a hold after the clamp drifts, and noise makes its ends differ.
_MOVED_L0, _SURE, _FAR = 1e-4, 5.0, 0.1


class ClampWindow(NamedTuple):
    """A clamp.

    Attributes:
        start_s, end_s: of it, s.
        load_f0: median force after its first fifth, F0.
        held_within_f0: largest distance of force from that there, F0.
        guessed: whether it was found from the force.
    """

    start_s: float
    end_s: float
    load_f0: float
    held_within_f0: float
    guessed: bool


class Velocity(NamedTuple):
    """Slope of length: value and standard error, L0/s."""

    value: float
    se: float


def clamp_window(
    time_s: Array, force_f0: Array, length_l0: Array, known_s: tuple[float, float] | None = None
) -> ClampWindow | Missing:
    """The clamp of a trial: as it is told, else the longest time at one force, not the first, while length moves.

    Args:
        time_s, force_f0, length_l0: shape (n,), s, F0 and L0.
        known_s: begin and end, s.
    """
    guessed = known_s is None
    if known_s is None:
        found = _longest_level(time_s, force_f0, length_l0)
        if found is None:
            return Missing("there is no time of 10 ms or more in which force stays at a level while length moves")
        known_s = found
    start_s, end_s = known_s
    inside = (time_s >= start_s + _AFTER * (end_s - start_s) - 5e-10) & (time_s <= end_s + 5e-10)
    if np.count_nonzero(inside) < _FEWEST:
        return Missing(f"the clamp has {samples(int(np.count_nonzero(inside)))} of force; {_FEWEST} are needed")
    load = float(np.median(force_f0[inside]))
    return ClampWindow(start_s, end_s, load, float(np.max(np.abs(force_f0[inside] - load))), guessed)


def velocity(time_s: Array, length_l0: Array, from_s: float, to_s: float) -> Velocity | Missing:
    """Slope of a straight line through length in a window, with a standard error that allows for slow noise.

    Args:
        time_s, length_l0: shape (n,), s and L0.
        from_s, to_s: the window, s.
    """
    inside = (time_s >= from_s - 5e-10) & (time_s <= to_s + 5e-10)
    count = int(np.count_nonzero(inside))
    if count < _FEWEST:
        return Missing(
            f"there are {samples(count)} in the window from {from_s:.4g} to {to_s:.4g} s; {_FEWEST} are needed"
        )
    t, length = time_s[inside] - float(np.mean(time_s[inside])), length_l0[inside]
    slope, level = np.polyfit(t, length, 1)
    rest = length - level - slope * t
    variance = float(np.sum(rest**2)) / (count - 2)
    # What a straight line leaves is curvature and slow noise: so many samples count as one.
    alike = float(np.sum(rest[1:] * rest[:-1]) / np.sum(rest**2)) if variance > 0.0 else 0.0
    apart = (1.0 + alike) / max(1.0 - alike, 2.0 / count)
    return Velocity(float(slope), float(np.sqrt(variance * max(apart, 1.0) / np.sum(t**2))))


def _longest_level(time_s: Array, force_f0: Array, length_l0: Array) -> tuple[float, float] | None:
    """The longest time in which force stays at a level other than the first while length moves."""
    away = np.flatnonzero(np.abs(force_f0 - force_f0[0]) > 2.0 * _CLAMPED_F0)
    if not away.size:
        return None
    found: list[tuple[float, float, float]] = []
    rest = np.arange(int(away[0]), force_f0.size)
    # Levels that come often: a clamp is where a histogram of force is high.
    counts, edges = np.histogram(force_f0[rest], bins=max(int(np.ptp(force_f0[rest]) / (0.5 * _CLAMPED_F0)), 1))
    for k in np.argsort(counts)[::-1][: min(5, int(np.count_nonzero(counts)))]:
        level = float(np.median(force_f0[rest][(force_f0[rest] >= edges[k]) & (force_f0[rest] <= edges[k + 1])]))
        if abs(level - force_f0[0]) <= _CLAMPED_F0:
            continue
        near = np.concatenate([[False], np.abs(force_f0[rest] - level) <= _CLAMPED_F0, [False]])
        begins, ends = np.flatnonzero(near[1:] & ~near[:-1]), np.flatnonzero(~near[1:] & near[:-1])
        for begin, end in zip(begins.tolist(), ends.tolist(), strict=True):
            first, last = int(rest[begin]), int(rest[end - 1])
            start_s, end_s = float(time_s[first]), float(time_s[last])
            if end_s - start_s < _SHORTEST_S:
                continue
            speed = velocity(time_s, length_l0, start_s, end_s)
            if isinstance(speed, Missing):
                continue
            by = abs(speed.value) * (end_s - start_s)
            if by > max(_MOVED_L0, _SURE * speed.se * (end_s - start_s)):
                found.append((start_s, end_s, by))
    farthest = max((by for _, _, by in found), default=0.0)
    moving = [(start_s, end_s) for start_s, end_s, by in found if by >= _FAR * farthest]
    return max(moving, key=lambda one: one[1] - one[0], default=None)
