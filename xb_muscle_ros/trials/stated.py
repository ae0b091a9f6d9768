"""Whether lengths leave room for the amplitude and the recovery that are stated of a trial.

What is stated tells where a stretch or a pause lies that the record is too coarse, too smooth or too noisy to show. A
record that would show it, and does not, belies it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from xb_muscle_ros.trials.corners import Piece
from xb_muscle_ros.trials.trial import Array

# Stated and found differ by no more than this share of what is found.
SHARE = 0.25
# Shorter pauses look like a corner that a filter rounded: s, and samples.
LEAST_PAUSE_S, _LEAST_PAUSE_SAMPLES = 4e-3, 3
# A stretch is looked for this much around its place: s, samples, and share of the recovery (clocks differ).
_AROUND_S, _AROUND_SAMPLES, _AROUND_SHARE = 0.01, 3, 0.01
# A stretch is there where the record has this share of its area above the level beside it, to so many standard errors.
_AREA, _ERRORS = 0.5, 3.0
_FEWEST_BESIDE = 3


class Stretch(NamedTuple):
    """A conditioning stretch and the shortening back, as the protocol has them before a test stretch.

    Attributes:
        onset_s: begin of the stretch, s.
        ramp_s: duration of the stretch, and of the shortening, s.
        rise: what length rises by, in its unit.
        test_s: begin of the test stretch, s.
    """

    onset_s: float
    ramp_s: float
    rise: float
    test_s: float

    @property
    def peak_s(self) -> float:
        """Where stretch turns into shortening, s."""
        return self.onset_s + self.ramp_s

    def area_from(self, start_s: float) -> float:
        """Area under the triangle from a time up to the peak on, unit of length times s."""
        unseen = min(max(start_s - self.onset_s, 0.0) / self.ramp_s, 1.0)
        return self.rise * self.ramp_s * (1.0 - 0.5 * unseen**2)


def before(test_s: float, speed: float, rise: float, recovery_s: float) -> Stretch:
    """The conditioning stretch that is as fast as the test stretch and lies a recovery before it.

    Args:
        test_s: begin of the test stretch, s.
        speed: of the test stretch, unit of length per s.
        rise: what the conditioning stretch lengthens by, in that unit.
        recovery_s: between shortening and test stretch, s.
    """
    ramp_s = rise / speed
    return Stretch(test_s - recovery_s - 2.0 * ramp_s, ramp_s, rise, test_s)


def leaves_room_for_stretch(time_s: Array, length: Array, stretch: Stretch) -> bool:
    """Whether a record may have a stretch: it has the area of its triangle, or noise that hides it.

    Args:
        time_s, length: shape (n,), s and any unit.
        stretch: in that unit; the record begins before its peak.
    """
    step_s = _step(time_s)
    end_s = stretch.onset_s + 2.0 * stretch.ramp_s
    around_s = max(_AROUND_S, _AROUND_SAMPLES * step_s, _AROUND_SHARE * (stretch.test_s - end_s))
    low_s, high_s = stretch.onset_s - around_s, end_s + around_s
    aside_s = high_s - low_s
    past = time_s < stretch.test_s
    inside = past & (time_s >= low_s) & (time_s <= high_s)
    sides = [past & (time_s >= low_s - aside_s) & (time_s < low_s), past & (time_s > high_s)]
    sides[1] &= time_s <= high_s + aside_s
    beside = [length[side] for side in sides if int(np.sum(side)) >= _FEWEST_BESIDE]
    if not beside:
        return True
    area = float(np.sum(length[inside] - np.mean([np.median(each) for each in beside]))) * step_s
    noise = float(np.sqrt(np.mean([np.var(each) for each in beside])))
    error = noise * step_s * float(np.sqrt(2.0 * np.sum(inside)))
    return area >= _AREA * stretch.area_from(float(time_s[0])) - _ERRORS * error


def leaves_room_for_pause(time_s: Array, length: Array, down: Piece, up: Piece, recovery_s: float) -> bool:
    """Whether a pause may hide around the corner of two ramps: lengths there stay above where their lines meet.

    Args:
        time_s, length: shape (n,), s and any unit.
        down, up: shortening and stretch, which meet.
        recovery_s: duration of the pause, s.
    """
    corner_s = down.end_s
    off_s = np.abs(time_s - corner_s)
    near = off_s <= 0.25 * recovery_s
    if int(np.sum(near)) < _LEAST_PAUSE_SAMPLES:
        near = np.argsort(off_s, kind="stable")[:_LEAST_PAUSE_SAMPLES]
    above = float(np.mean(length[near])) - (down.line[0] * corner_s + down.line[1])
    shown_s = above * (1.0 / up.line[0] - 1.0 / down.line[0])
    return recovery_s - shown_s <= SHARE * recovery_s + least_pause_s(time_s)


def least_pause_s(time_s: Array) -> float:
    """What a pause lasts that cannot be told from a rounded corner, s."""
    return max(LEAST_PAUSE_S, _LEAST_PAUSE_SAMPLES * _step(time_s))


def _step(time_s: Array) -> float:
    return float(np.median(np.diff(time_s)))
