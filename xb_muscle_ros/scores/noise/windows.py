"""Where a recording shows its noise: the times at which the muscle only holds."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from xb_muscle_ros.scores.steady import steady_part
from xb_muscle_ros.trials.trial import Array, Trial

# A window has at least this many samples; more than the most tell no more about noise, only about slow force.
LEAST, MOST = 20, 1000
# Calcium that moves by less than this share of its range from sample to sample stays as it is.
_CALM = 1e-4


class Window(NamedTuple):
    """Force while the muscle only holds.

    Attributes:
        step_s: between samples, s.
        force_f0: shape (n,), evenly sampled, F0; empty where the trial has no such time.
    """

    trial: str
    step_s: float
    force_f0: Array


def isometric_window(trial: Trial, most: int = MOST) -> Window:
    """The steady force of a trial before its first length change, or where it has none, late in its longest pause.

    A pause is a recovery or hold, late its last third, by when what the length change did has mostly passed.

    Args:
        most: samples it has at most, the last.
    """
    time_s = trial.force_time_s
    inside = steady_part(trial, time_s, trial.measured_f0).inside
    if inside.stop - inside.start < LEAST:
        pauses = [p for p in trial.facts.phases if p.name in ("isometric", "recovery", "hold")]
        longest = max(pauses, key=lambda p: p.end_s - p.start_s, default=None)
        if longest is not None:
            begin_s = longest.end_s - (longest.end_s - longest.start_s) / 3.0
            begin, end = np.searchsorted(time_s, [begin_s, longest.end_s])
            inside = same_calcium(trial, slice(int(begin), int(end)))
    found = slice(max(inside.start, inside.stop - most), inside.stop)
    step_s = float(np.median(np.diff(time_s[found]))) if found.stop - found.start > 1 else math.nan
    return Window(trial.facts.trial, step_s, np.asarray(trial.measured_f0[found]))


def same_calcium(trial: Trial, inside: slice) -> slice:
    """The longest part of a window in which calcium stays as it is; after a change of calcium, without its first third.

    A stimulated muscle's force comes and goes while its length is held; that is no noise.
    """
    given = trial.calcium_um[np.searchsorted(trial.calcium_time_s, trial.force_time_s[inside], side="right") - 1]
    moving = np.abs(np.diff(given)) > _CALM * np.ptp(trial.calcium_um)
    edges = [0, *(np.flatnonzero(moving) + 1).tolist(), given.size]
    begin, end = max(pairwise(edges), key=lambda part: part[1] - part[0])
    begin += (end - begin) // 3 if begin > 0 else 0
    return slice(inside.start + begin, inside.start + end)
