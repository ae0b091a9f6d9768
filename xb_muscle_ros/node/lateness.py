"""How late ticks come: quantiles of a whole run in constant memory, cheap enough to note every tick."""

from __future__ import annotations

import math
from typing import NamedTuple

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
        counts = self._counts.copy()
        return LatenessSummary(
            self._ticks,
            self._quantile(counts, 0.5),
            self._quantile(counts, 0.99),
            self._quantile(counts, 0.999),
            self._max_ns * 1e-3,
        )

    def _quantile(self, counts: list[int], share: float) -> float:
        total = sum(counts)
        seen = 0
        for bin_, count in enumerate(counts):
            seen += count
            if count and seen >= share * total:
                # Upper edge of the bin: a quantile is never made better than it was.
                return min(_FIRST_NS * math.exp(bin_ * _GROWTH), float(self._max_ns)) * 1e-3
        return 0.0
