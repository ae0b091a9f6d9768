"""Ticks at absolute deadlines of the steady clock, in a thread of their own, so that messages do not delay them."""

from __future__ import annotations

import ctypes
import sys
import threading
import time
from collections.abc import Callable

from xb_muscle_ros.node.lateness import Lateness
from xb_muscle_ros.node.privileges import take_priority
from xb_muscle_ros.node.status import Log

# How long another thread may keep the interpreter while a tick waits for it (the default is 5 ms).
_SWITCH_INTERVAL_S = 1e-4

_CLOCK_MONOTONIC = 1
_TIMER_ABSTIME = 1
_PR_SET_TIMERSLACK = 29
_SECOND_NS = 1_000_000_000


class Ticker:
    """Calls for one tick per period; those that come too late are made up for within bounds, more are dropped.

    Attributes:
        lateness: of ticks since `forget`.
        overruns: deadlines that had passed before their tick was reached, since `forget`.
        dropped: of those, ticks that were not made up for.
        begun_ns: steady time of the last start.
    """

    def __init__(self, ready: Callable[[], bool], tick: Callable[[int], None], done: Callable[[], None]) -> None:
        """Keep what is called, all of it in the thread.

        Args:
            ready: before every tick that is due; False: there is nothing to tick, and deadlines count from here.
            tick: takes the deadline, ns of the steady clock.
            done: once after one tick or several that were made up for.
        """
        self._ready = ready
        self._tick = tick
        self._done = done
        self._thread: threading.Thread | None = None
        self._stop = False
        self._switch_interval = 0.0
        self.begun_ns = 0
        self.forget()

    @property
    def running(self) -> bool:
        """Whether the thread runs."""
        return self._thread is not None

    def forget(self) -> None:
        """Start the statistics anew."""
        self.lateness = Lateness()
        self.overruns = 0
        self.dropped = 0

    def start(
        self, period_ns: int, max_catch_up: Callable[[], int], priority: int, log: Log, begin: Callable[[], None]
    ) -> None:
        """Start the thread.

        Args:
            period_ns: of the ticks.
            max_catch_up: most ticks made up for at once, asked anew at each.
            priority: under SCHED_FIFO; 0: ordinary scheduling.
            log: told if the priority is not permitted.
            begin: called first in the thread.
        """

        def run() -> None:
            if priority and take_priority(priority, log):
                log.info(f"ticks run under SCHED_FIFO with priority {priority}")
            begin()
            self._run(period_ns, max_catch_up)

        self._stop = False
        self._switch_interval = sys.getswitchinterval()
        sys.setswitchinterval(_SWITCH_INTERVAL_S)
        # A sample may be asked for its age before the thread has begun.
        self.begun_ns = time.monotonic_ns()
        self._thread = threading.Thread(target=run, name="ticks", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End the thread at its next tick, and wait for that."""
        if self._thread is not None:
            self._stop = True
            self._thread.join()
            self._thread = None
            sys.setswitchinterval(self._switch_interval)

    def _run(self, period: int, max_catch_up: Callable[[], int]) -> None:
        wait = make_waiter()
        # While inactive no sample could come; its age counts from here.
        self.begun_ns = time.monotonic_ns()
        deadline = self.begun_ns + period
        while not self._stop:
            wait(deadline)
            if not self._ready():
                # Settling takes as long as it takes; ticks count from its end.
                deadline = time.monotonic_ns() + period
                continue
            late = time.monotonic_ns() - deadline
            missed = late // period
            made_up = min(missed, max_catch_up())
            self.overruns += missed
            self.dropped += missed - made_up
            for i in range(made_up + 1):
                self.lateness.note(late - i * period)
                self._tick(deadline + i * period)
            self._done()
            deadline += (missed + 1) * period


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
