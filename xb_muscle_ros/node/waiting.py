"""Wait for an absolute time on the steady clock, with the interpreter free for other threads meanwhile."""

from __future__ import annotations

import ctypes
import sys
import time
from collections.abc import Callable

_CLOCK_MONOTONIC = 1
_TIMER_ABSTIME = 1
_PR_SET_TIMERSLACK = 29
_SECOND_NS = 1_000_000_000


class _Timespec(ctypes.Structure):
    _fields_ = (("tv_sec", ctypes.c_long), ("tv_nsec", ctypes.c_long))


def make_waiter() -> Callable[[int], None]:
    """Return a function that waits until a time of `time.monotonic_ns`; made and used in one and the same thread.

    On Linux the kernel gets the deadline itself, so that nothing that happens between reading the clock and going to
    sleep adds to the lateness.
    """
    if not sys.platform.startswith("linux"):
        return _sleep_until
    libc = ctypes.CDLL(None)
    # By default the kernel may wake an ordinary thread 50 µs late to save power; this thread wants 1 ns.
    libc.prctl(_PR_SET_TIMERSLACK, ctypes.c_ulong(1), 0, 0, 0)
    nanosleep = libc.clock_nanosleep
    deadline = _Timespec()
    reference = ctypes.byref(deadline)

    def wait(deadline_ns: int) -> None:
        deadline.tv_sec, deadline.tv_nsec = divmod(deadline_ns, _SECOND_NS)
        # A signal ends the wait early; then wait on for the same deadline.
        while nanosleep(_CLOCK_MONOTONIC, _TIMER_ABSTIME, reference, None) != 0:
            if time.monotonic_ns() >= deadline_ns:
                return

    return wait


def _sleep_until(deadline_ns: int) -> None:
    rest_ns = deadline_ns - time.monotonic_ns()
    while rest_ns > 0:
        time.sleep(rest_ns * 1e-9)
        rest_ns = deadline_ns - time.monotonic_ns()
