"""Trials at the times that tell: steps that grow with the time since length last changed its course.

A residual at one moment tells what it is for some time around, and what follows a change of length slows down as it
goes on. So a trial is looked at after each corner of length or calcium at times that are ever further apart, and a
stretch of time counts as often as it holds independent residuals.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.fit.data import FitTrial
from xb_muscle_ros.trials.trial import Array

# Steps begin so short after a corner and grow by this share of the time since.
_SHORTEST_S, _GROWTH = 0.001, 0.12
# What may be straightened, L0 and relative: 0.1 % F0 of a stiff fibre.
_LENGTH_L0, _CALCIUM = 2e-5, 1e-3
INDEPENDENT_S, _SLOWING = 0.03, 0.5
"""Residuals so far apart are as good as independent right after a corner; later by a share of the time since more."""


class Thinned(NamedTuple):
    """A trial with fewer samples.

    Attributes:
        trial: the same input at fewer times, and force averaged between them.
        weights: of its samples, shape (k,): how many independent residuals each stands for.
    """

    trial: FitTrial
    weights: Array


def thinned(trial: FitTrial) -> Thinned:
    """The trial at the times that tell; one sampled coarsely stays as it is."""
    kept, corners_s = _kept(trial)
    edges = trial.time_s[kept]
    first, last = trial.force_time_s[0], trial.force_time_s[-1]
    # A sample belongs to the step that it ends; those before the first step to the first.
    bins = np.clip(np.searchsorted(edges, trial.force_time_s, side="left"), 1, edges.size - 1)
    _, starts, counts = np.unique(bins, return_index=True, return_counts=True)
    time_s = np.add.reduceat(trial.force_time_s, starts) / counts
    force = np.add.reduceat(trial.measured_f0, starts) / counts
    step_s = (last - first) / max(trial.force_time_s.size - 1, 1)
    since_s = time_s - corners_s[np.clip(np.searchsorted(corners_s, time_s, side="right") - 1, 0, corners_s.size - 1)]
    weights = np.minimum(counts * step_s / (INDEPENDENT_S + _SLOWING * np.maximum(since_s, 0.0)), 1.0)
    made = replace(
        trial,
        time_s=edges,
        length_l0=trial.length_l0[kept],
        calcium_um=trial.calcium_um[kept],
        force_time_s=time_s,
        measured_f0=force,
    )
    return Thinned(made, weights * trial.weight)


def _kept(trial: FitTrial) -> tuple[npt.NDArray[np.intp], Array]:
    """Indices of the input's samples that are kept, and times of its corners, s."""
    t, length, calcium = trial.time_s, trial.length_l0, trial.calcium_um
    kept, here, corner, n = [0], 0, float(t[0]), t.size
    corners = [corner]
    while here < n - 1:
        longest = max(_SHORTEST_S, _GROWTH * (t[here] - corner))
        end = max(here + 1, int(np.searchsorted(t, t[here] + longest + 1e-9, side="right")) - 1)
        reach = _straight(t, length, calcium, here, end)
        if reach < end:
            corner = float(t[reach])
        if end < n - 1 and reach == end and not _goes_on(t, length, calcium, kept, here, end):
            corner = float(t[here])
            end = max(here + 1, int(np.searchsorted(t, t[here] + _SHORTEST_S + 1e-9, side="right")) - 1)
            reach = end
        if corner != corners[-1]:
            corners.append(corner)
        here = reach
        kept.append(here)
    return np.array(kept), np.array(corners)


def _straight(t: Array, length: Array, calcium: Array, here: int, end: int) -> int:
    """Last sample up to which the input is straight from `here` on, at least the next one."""
    if end <= here + 1:
        return here + 1
    span = slice(here + 1, end + 1)
    times = t[span] - t[here]
    slope = (length[end] - length[here]) / times[-1]
    off = np.abs(length[span] - length[here] - slope * times) > _LENGTH_L0
    off |= np.abs(calcium[span] - calcium[here + 1]) > _CALCIUM * np.maximum(np.abs(calcium[here + 1]), 1e-9)
    if not np.any(off):
        return end
    middle = here + max(1, (end - here) // 2)
    return _straight(t, length, calcium, here, middle)


def _goes_on(t: Array, length: Array, calcium: Array, kept: list[int], here: int, end: int) -> bool:
    """Whether the input goes on as in the step before."""
    if len(kept) < 2:
        return True
    before = kept[-2]
    if abs(calcium[end] - calcium[here]) > _CALCIUM * max(abs(float(calcium[here])), 1e-9):
        return False
    slope = (length[here] - length[before]) / (t[here] - t[before])
    ahead = min(end, here + 1 if t[here + 1] - t[here] > _SHORTEST_S else end)
    off = length[ahead] - length[here] - slope * (t[ahead] - t[here])
    return bool(abs(off) <= _LENGTH_L0)
