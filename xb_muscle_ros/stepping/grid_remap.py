"""What happens to a strain grid after a step: renumbering, or interpolation back to where it was.

The text below is compiled beside the step of `grid_kernels`; one of `roll`, `linear` and `conservative` becomes the
model's `regrid`.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

# Places in the state vector and the parameter vector: see `models.grid_codegen`.
N_OTHERS = 0
BINS = 0
RANGE = 0
REGRID = 0


# BEGIN COMPILED
def forget_traces(s: Array, bins: int) -> None:
    """Set densities below 1e-150 to zero: as denormal numbers they would slow every loop down a hundredfold."""
    for i in range(bins):
        s[i] = s[i] if abs(s[i]) > 1e-150 else 0.0


def roll(s: Array, p: Array, work: Array) -> None:
    """Renumber bins that have moved by whole bins: exact, since no strain changes. What rolls off has long detached."""
    bins = int(p[BINS])
    forget_traces(s, bins)
    if REGRID >= 0 and p[REGRID] < 0.5:
        return
    dx = 2.0 * p[RANGE] / (bins - 1)
    steps = int(math.floor(s[bins + N_OTHERS] / dx + 0.5))
    if steps == 0:
        return
    old = work[4]
    for i in range(bins):
        old[i] = s[i]
    for i in range(bins):
        source = i - steps
        s[i] = old[source] if 0 <= source < bins else 0.0
    s[bins + N_OTHERS] -= steps * dx


def taken_back(s: Array, p: Array, old: Array) -> float:
    """Copy the bins to `old` and put the grid back to zero shift; returns how many bins it had moved by."""
    bins = int(p[BINS])
    forget_traces(s, bins)
    moved = s[bins + N_OTHERS] * (bins - 1) / (2.0 * p[RANGE])
    for i in range(bins):
        old[i] = s[i]
    s[bins + N_OTHERS] = 0.0
    return float(moved)


def linear(s: Array, p: Array, work: Array) -> None:
    """Linear interpolation back to the grid."""
    bins = int(p[BINS])
    old = work[4]
    moved = taken_back(s, p, old)
    if moved == 0.0:
        return
    # All bins have moved by the same, so the weights are the same for all.
    whole = int(math.floor(-moved))
    part = -moved - whole
    first = min(max(0, -whole), bins)
    last = max(min(bins, bins - 1 - whole), first)
    for i in range(first):
        s[i] = 0.0
    for i in range(first, last):
        s[i] = old[i + whole] + part * (old[i + whole + 1] - old[i + whole])
    for i in range(last, bins):
        s[i] = 0.0


def conservative(s: Array, p: Array, work: Array) -> None:
    """Interpolate the heads below each edge instead of their density, so that heads are neither lost nor made.

    The heads below an edge grow from edge to edge. Cubics whose slope at an edge is the density there, to fourth order,
    grow too as long as it is at most three times either neighbour's (Fritsch and Carlson 1980); held to that, the
    interpolation makes no density negative.
    """
    bins = int(p[BINS])
    old = work[4]
    edge = work[5]
    inside = work[6]
    moved = taken_back(s, p, old)
    if moved == 0.0:
        return
    whole = int(math.floor(-moved))
    t = -moved - whole
    edge[0] = 0.0
    for i in range(1, bins):
        left = old[i - 2] if i >= 2 else 0.0
        right = old[i + 1] if i + 1 < bins else 0.0
        smooth = (7.0 * (old[i - 1] + old[i]) - left - right) / 12.0
        edge[i] = max(0.0, min(smooth, 3.0 * min(old[i - 1], old[i])))
    # Heads between an edge and the place that lies t bins above it.
    a = t * t * (3.0 - 2.0 * t)
    b = t * (1.0 - t) * (1.0 - t)
    c = t * t * (t - 1.0)
    for i in range(bins - 1):
        inside[i] = a * old[i] + b * edge[i] + c * edge[i + 1]
    inside[bins - 1] = a * old[bins - 1] + b * edge[bins - 1]
    for i in range(bins):
        k = i + whole
        upper = inside[k + 1] if 0 <= k + 1 < bins else 0.0
        own = old[k] - inside[k] if 0 <= k < bins else 0.0
        s[i] = own + upper
