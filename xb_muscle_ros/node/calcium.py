"""Calcium by stamp, as lockstep needs it; a value is a number, or one for each of some fibres."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Any

from xb_muscle_ros.node.rules import NO_STAMP

KEPT = 1024
"""Samples of calcium ahead of length."""


class CalciumHistory:
    """Calcium by stamp, held until the next one; keeps only what a later question can need."""

    def __init__(self) -> None:
        self._kept: deque[tuple[int, Any]] = deque(maxlen=KEPT)

    @property
    def full(self) -> bool:
        """Whether the oldest values may have been given up for newer ones."""
        return len(self._kept) == KEPT

    @property
    def last_stamp(self) -> int:
        """Stamp of the newest value, ns, or `NO_STAMP`."""
        return self._kept[-1][0] if self._kept else NO_STAMP

    def add(self, stamp: int, calcium_um: Any) -> None:
        """Put a value (µM) that holds from `stamp` (ns) on in the place of all that held from then or later on."""
        self.cut(stamp)
        self._kept.append((stamp, calcium_um))

    def at(self, stamp: int) -> Any:
        """Newest value (µM) with a stamp not after `stamp` (ns); None where there is none. Questions ascend in time."""
        kept = self._kept
        while len(kept) > 1 and kept[1][0] <= stamp:
            kept.popleft()
        return kept[0][1] if kept and kept[0][0] <= stamp else None

    def cut(self, stamp: int) -> None:
        """Forget values that hold from `stamp` (ns) or later on."""
        while self._kept and self._kept[-1][0] >= stamp:
            self._kept.pop()

    def kept(self) -> tuple[tuple[int, Any], ...]:
        """Stamps (ns) and values (µM) that later questions can need."""
        return tuple(self._kept)

    def each(self, change: Callable[[Any], Any]) -> CalciumHistory:
        """The same stamps with other values."""
        made = CalciumHistory()
        made._kept.extend((stamp, change(value)) for stamp, value in self._kept)
        return made
