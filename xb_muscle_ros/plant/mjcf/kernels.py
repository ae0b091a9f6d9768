"""What is computed for every muscle in every tick beside the fibres, compiled."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from numba import njit

Array = npt.NDArray[np.float64]

_LEAST = 1e-15
"""MuJoCo's mjMINVAL: by less nothing is divided."""


@njit(cache=True)
def next_activation(activation: Array, excitation: Array, dt_s: float, rows: Array, out: Array) -> int:
    """One explicit Euler step of `mju_muscleDynamics`.

    Args:
        activation, excitation, out: shape (muscle,).
        dt_s: s.
        rows: shape (muscle, 7): both time constants (s), width of their transition, least and most excitation, least
            and most activation.

    Returns:
        place of the first excitation that is not finite, else -1.
    """
    for k in range(activation.size):
        if not math.isfinite(excitation[k]):
            return k
        now = activation[k]
        wanted = min(max(excitation[k], rows[k, 3]), rows[k, 4])
        inside = min(max(now, 0.0), 1.0)
        rising = rows[k, 0] * (0.5 + 1.5 * inside)
        falling = rows[k, 1] / (0.5 + 1.5 * inside)
        rise = wanted - now
        width = rows[k, 2]
        if width < _LEAST:
            constant = rising if rise > 0.0 else falling
        else:
            constant = falling + (rising - falling) * _sigmoid(rise / width + 0.5)
        changed = now + rise / max(_LEAST, constant) * dt_s
        out[k] = min(max(changed, rows[k, 5]), rows[k, 6])
    return -1


@njit(cache=True)
def _sigmoid(x: float) -> float:
    """MuJoCo's quintic from 0 at x = 0 to 1 at x = 1."""
    if x <= 0.0:
        return 0.0
    if x >= 1.0:
        return 1.0
    return x * x * x * (3.0 * x * (2.0 * x - 5.0) + 10.0)


@njit(cache=True)
def looked_up(share: Array, tables: Array, row: npt.NDArray[np.int64], out: Array) -> int:
    """Values of tables over 0 to 1 in equal steps, linear in between.

    Args:
        share: shape (muscle,), 0 to 1.
        tables: shape (table, point).
        row: table of each muscle, shape (muscle,).
        out: receives values, shape (muscle,).

    Returns:
        place of the first share that is not 0 to 1, else -1.
    """
    last = tables.shape[1] - 1
    for k in range(share.size):
        # Written so that a NaN fails the comparison.
        if not 0.0 <= share[k] <= 1.0:
            return k
        place = share[k] * last
        below = min(int(place), last - 1)
        table = tables[row[k]]
        out[k] = table[below] + (place - below) * (table[below + 1] - table[below])
    return -1
