"""What tests of realtime threads share: settings, and waiting for the thread."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from xb_muscle_ros.node.realtime import Settings

SETTINGS = Settings(
    rate_hz=500.0,
    extrapolate=False,
    extrapolation_limit_s=0.02,
    max_catch_up=10,
    timeout_s=0.0,
    on_timeout="isometric",
    decay_s=0.1,
)


class Waiting:
    """Waits for a realtime thread.

    Attributes:
        realtime: the thread.
        emitted: one entry for each message that it sent.
        notes: what it said.
    """

    realtime: Any
    emitted: list[Any]
    notes: Any

    def until(self, condition: Callable[[], Any]) -> None:
        """Wait until something holds."""
        end = time.monotonic() + 10.0
        while not condition():
            assert time.monotonic() < end, (self.notes.lines, self.realtime.status())
            time.sleep(0.002)

    def emit_more(self, count: int) -> None:
        """Wait for some more messages."""
        target = len(self.emitted) + count
        self.until(lambda: len(self.emitted) >= target)

    def rounds(self, count: int) -> None:
        """Wait for the thread to come round some times, whether it steps or not."""
        ticker, seen = self.realtime._ticker, list[None]()
        ready = ticker._ready

        def counted() -> bool:
            seen.append(None)
            return bool(ready())

        ticker._ready = counted
        self.until(lambda: len(seen) >= count)
        ticker._ready = ready
