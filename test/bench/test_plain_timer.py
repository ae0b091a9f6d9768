"""The plain timer's account of its deadlines adds up."""

from __future__ import annotations

import random

import pytest

pytest.importorskip("rclpy", reason="needs ROS 2")

PERIOD = 1_000_000


def test_calls_and_skipped_deadlines_are_all_there_were() -> None:
    """A timer as rcl has it: on time, late within a period, late by more with and without a skip."""
    from xb_muscle_ros.bench.plain_timer import Deadlines

    chance = random.Random(1)
    account = Deadlines(PERIOD)
    deadline, calls, skipped, overruns = 10 * PERIOD, 0, 0, 0
    now = deadline
    for _ in range(2000):
        now = max(now + 1, deadline) + chance.choice([10_000, 400_000, 1_300_000, 2_700_000])
        # rcl asks for the time before the callback does: what passes in between is not skipped.
        asked = now - chance.choice([0, 350_000])
        following = deadline + PERIOD
        while following < asked:
            following += PERIOD
        # The first deadline is found from the next one, as if none had been skipped.
        if calls == 0:
            following = deadline + PERIOD
        account.met(now, following)
        calls += 1
        skipped += (following - deadline) // PERIOD - 1
        overruns += max((now - deadline) // PERIOD, (following - deadline) // PERIOD - 1)
        deadline = following
    assert account.summary().ticks == calls
    assert account.missed == (overruns, skipped)
    # Every deadline until the last one is one or the other.
    assert calls + skipped == (deadline - 10 * PERIOD) // PERIOD
    assert skipped > 500
