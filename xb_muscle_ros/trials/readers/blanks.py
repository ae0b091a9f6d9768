"""Short runs of blank samples are filled by straight lines, and that is told; longer ones are refused."""

from __future__ import annotations

import numpy as np

from xb_muscle_ros.trials.readers.table import Places
from xb_muscle_ros.trials.trial import Array

# What a converter or a spreadsheet drops; a muscle does little in that time.
LONGEST_S = 0.002
_SHOWN = 3
_ROUNDING = 1.0 + 1e-6


def fill(values: Array, blank: Places, time_s: Array) -> Array:
    """Values with straight lines over time where they are blank.

    Args:
        values, blank, time_s: shape (n,) each; neither the first nor the last is blank.
    """
    filled = values.copy()
    filled[blank] = np.interp(time_s[blank], time_s[~blank], values[~blank])
    return filled


def too_long(blank: Places, time_s: Array, longest_s: float) -> Places:
    """Which blanks are in runs that are too long to be filled, or have no value on one of their sides.

    A run is as long as the time from its first blank to the next value.
    """
    bad = np.zeros_like(blank)
    for first, end in _runs(blank):
        if first == 0 or end == blank.size or time_s[end] - time_s[first] > longest_s * _ROUNDING:
            bad[first:end] = True
    return bad


def told(blank: Places, time_s: Array) -> str:
    """How many blanks there are, in how many runs, and when."""
    runs = _runs(blank)
    places = [
        f"{time_s[first]:.6g} s" if end - first == 1 else f"{time_s[first]:.6g} to {time_s[end - 1]:.6g} s"
        for first, end in runs[:_SHOWN]
    ]
    more = f", and {len(runs) - _SHOWN} later" if len(runs) > _SHOWN else ""
    count = int(np.count_nonzero(blank))
    what = "1 blank sample was" if count == 1 else f"{count} blank samples in {len(runs)} runs were"
    what = what.replace("in 1 runs", "in one run")
    return f"{what} filled by straight lines, at {', '.join(places)}{more}"


def _runs(blank: Places) -> list[tuple[int, int]]:
    """First of each run of blanks, and the place behind its last."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], blank, [False])).astype(np.int8)))
    return [(int(first), int(end)) for first, end in edges.reshape(-1, 2)]
