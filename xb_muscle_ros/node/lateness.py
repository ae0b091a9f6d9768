"""How late ticks come: quantiles of a whole run in constant memory, cheap enough to note every tick."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

# Bins grow by 1 %, from 100 ns to beyond 100 s: a quantile is at most 1 % off.
_FIRST_NS = 100.0
_GROWTH = math.log(1.01)
_BINS = 2100


class LatenessSummary(NamedTuple):
    """Lateness over all ticks so far, µs; zeros where there was none."""

    ticks: int
    p50_us: float
    p99_us: float
    p999_us: float
    max_us: float


class Lateness:
    """Histogram of lateness with logarithmic bins.

    One thread notes, another may summarise at any time: a count is at most one tick behind.
    """

    def __init__(self) -> None:
        self._counts = [0] * _BINS
        self._ticks = 0
        self._max_ns = 0

    def note(self, late_ns: int) -> None:
        """Count one tick that came `late_ns` after its deadline, ns."""
        bin_ = 0 if late_ns <= _FIRST_NS else min(int(math.log(late_ns / _FIRST_NS) / _GROWTH) + 1, _BINS - 1)
        self._counts[bin_] += 1
        self._ticks += 1
        if late_ns > self._max_ns:
            self._max_ns = late_ns

    def summary(self) -> LatenessSummary:
        """Quantiles of all ticks noted so far."""
        # What another thread notes meanwhile is left for the next time.
        seen = np.cumsum(self._counts)
        bins = np.searchsorted(seen, np.array([0.5, 0.99, 0.999]) * seen[-1])
        # Upper edges of bins: a quantile is never made better than it was.
        p50, p99, p999 = np.minimum(_FIRST_NS * np.exp(bins * _GROWTH), self._max_ns) * 1e-3
        return LatenessSummary(self._ticks, float(p50), float(p99), float(p999), self._max_ns * 1e-3)
