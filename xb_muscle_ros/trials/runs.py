"""Runs of samples with one direction, and what in a record is no ramp of its own.

A motor gives way under the force of a whole muscle and comes back; a record may end as the motor sets off for the
next trial; and a step-ramp goes down in two speeds. Directions of single samples tell none of that.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.trials.trial import Array

# A ramp has to last this many samples at 1 kHz and above, and fewer where samples are further apart.
LASTING_SAMPLES, FEWEST_IN_RAMP = 6, 3
LASTING_S = 6e-3
# Levels before and after a give differ by less than this fraction of the largest give.
SAME_LEVEL = 0.25
# A quick release lasts no longer (s) and is no slower (L0/s): faster than a fibre follows, short against a ramp.
RELEASE_S = 0.03
RELEASE_L0_PER_S = 1.0
# In a step-ramp the step is this large (L0) beyond the ramp, and this much faster.
STEP_L0 = 0.015
STEP_FASTER = 1.6


class Run(NamedTuple):
    """Samples ``first`` to ``last`` (inclusive) of one direction: +1 stretch, 0 isometric, -1 shortening."""

    direction: int
    first: int
    last: int

    @property
    def samples(self) -> int:
        """How many there are."""
        return self.last - self.first + 1


def samples_of(duration_s: float, time_s: Array, least: int, most: int) -> int:
    """How many samples a duration has, within bounds; by the median step."""
    step_s = float(np.median(np.diff(time_s))) if time_s.size > 1 else duration_s
    return int(np.clip(np.ceil(duration_s / step_s - 1e-9), least, most))


def lasting_samples(time_s: Array) -> int:
    """How many samples a ramp has to last."""
    return samples_of(LASTING_S, time_s, FEWEST_IN_RAMP, LASTING_SAMPLES)


def split(directions: npt.NDArray[np.int64]) -> list[Run]:
    """Runs of equal directions."""
    edges = [0, *(np.flatnonzero(np.diff(directions)) + 1).tolist(), directions.size]
    return [Run(int(directions[a]), a, b - 1) for a, b in itertools.pairwise(edges)]


def merge(runs: Sequence[Run]) -> list[Run]:
    """Neighbours of equal direction become one."""
    merged = list(runs[:1])
    for run in runs[1:]:
        if run.direction == merged[-1].direction:
            merged[-1] = merged[-1]._replace(last=run.last)
        else:
            merged.append(run)
    return merged


def without_departure(runs: list[Run], lasting: int) -> list[Run]:
    """Runs without a ramp that the end of the record cuts off at its begin; its samples go to the run before."""
    if len(runs) > 1 and runs[-1].direction != 0 and runs[-1].samples < lasting:
        return [*runs[:-2], runs[-2]._replace(last=runs[-1].last)]
    return runs


def without_give(runs: list[Run], length: Array, give: float) -> list[Run]:
    """Runs without excursions up to ``give`` (in the unit of length) that come back to where they began."""
    if give <= 0.0:
        return runs
    return _ramps_without_pauses(_levels_without_excursions(runs, length, give), length, give)


def _levels_without_excursions(runs: list[Run], length: Array, give: float) -> list[Run]:
    kept: list[Run] = []
    i = 0
    while i < len(runs):
        run, end = runs[i], i
        if run.direction == 0:
            level = _level(length, run)
            for j in range(i + 1, len(runs)):
                if float(np.max(np.abs(length[runs[j].first : runs[j].last + 1] - level))) > give:
                    break
                if runs[j].direction == 0 and abs(_level(length, runs[j]) - level) <= SAME_LEVEL * give:
                    end = j
        kept.append(run._replace(last=runs[end].last))
        i = end + 1
    return merge(kept)


def _ramps_without_pauses(runs: list[Run], length: Array, give: float) -> list[Run]:
    """A pause within a ramp is a give where the record stays near the straight line from begin to end of the ramp."""
    kept: list[Run] = []
    for run in runs:
        kept.append(run)
        while len(kept) > 2 and kept[-1].direction == kept[-3].direction != 0 and kept[-2].direction == 0:
            whole = Run(run.direction, kept[-3].first, run.last)
            part = length[whole.first : whole.last + 1]
            if float(np.max(np.abs(part - np.linspace(part[0], part[-1], part.size)))) > give:
                break
            kept[-3:] = [whole]
    return kept


def with_steps(runs: list[Run], time_s: Array, length: Array, l0: float) -> list[Run]:
    """Runs in which the quick step that begins a ramp of shortening is a run of its own."""
    return [part for run in runs for part in _step_and_ramp(run, time_s, length, l0)]


def _step_and_ramp(run: Run, time_s: Array, length: Array, l0: float) -> list[Run]:
    if run.direction >= 0 or run.samples < 4 * LASTING_SAMPLES:
        return [run]
    # Rounded at its end like the step at its begin, so the ramp is what lies between.
    ramp = slice(run.first + run.samples // 2, run.last + 1 - run.samples // 8)
    middle_s = float(np.mean(time_s[ramp]))
    slope, level = np.polyfit(time_s[ramp] - middle_s, length[ramp], 1)
    beyond = length[run.first : run.last + 1] - (level + slope * (time_s[run.first : run.last + 1] - middle_s))
    if beyond[0] < STEP_L0 * l0:
        return [run]
    end = run.first + int(np.argmax(beyond < 0.15 * beyond[0]))
    duration_s = float(time_s[end] - time_s[run.first])
    if end - run.first < 2 or not 0.0 < duration_s <= RELEASE_S:
        return [run]
    speed = float(length[run.first] - length[end]) / duration_s
    if speed < max(RELEASE_L0_PER_S * l0, STEP_FASTER * abs(float(slope))):
        return [run]
    return [run._replace(last=end), run._replace(first=end + 1)]


def _level(length: Array, run: Run) -> float:
    return float(np.median(length[run.first : run.last + 1]))
