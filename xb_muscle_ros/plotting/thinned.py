"""Long records as lines: what is drawn has every peak, and no more points than anyone can see."""

from __future__ import annotations

import itertools

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

# A panel is some hundred dots wide, in print a thousand; each column of time keeps four samples.
_COLUMNS = 2000
_OF_COLUMN = 4


def thinned(time_s: Array, values: Array) -> slice | npt.NDArray[np.intp]:
    """Which samples to draw: all, or of each of 2,000 equal parts of time the first, lowest, highest and last.

    Args:
        time_s, values: shape (n,), increasing; finite.
    """
    if time_s.size <= _OF_COLUMN * _COLUMNS:
        return slice(None)
    edges = np.searchsorted(time_s, np.linspace(time_s[0], time_s[-1], _COLUMNS + 1)[1:-1])
    kept: list[int] = []
    for first, end in itertools.pairwise([0, *edges.tolist(), time_s.size]):
        if first < end:
            part = values[first:end]
            kept += [first, first + int(np.argmin(part)), first + int(np.argmax(part)), end - 1]
    return np.unique(kept)
