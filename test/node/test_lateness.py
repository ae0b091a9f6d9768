"""Quantiles of lateness, and waiting for a deadline."""

from __future__ import annotations

import time

import numpy as np
import pytest

from xb_muscle_ros.node.lateness import Lateness
from xb_muscle_ros.node.ticker import make_waiter


def test_quantiles_are_those_of_the_data() -> None:
    """Within the 1 % of a bin, and never better than true."""
    rng = np.random.default_rng(1)
    late_ns = np.exp(rng.normal(np.log(50e3), 1.5, 20000)).astype(np.int64)
    lateness = Lateness()
    for value in late_ns.tolist():
        lateness.note(value)
    summary = lateness.summary()
    assert summary.ticks == late_ns.size
    assert summary.max_us == late_ns.max() * 1e-3
    for share, found in ((0.5, summary.p50_us), (0.99, summary.p99_us), (0.999, summary.p999_us)):
        true_us = np.quantile(late_ns, share, method="inverted_cdf") * 1e-3
        assert true_us * 0.9999 <= found <= true_us * 1.0101


@pytest.mark.parametrize("late_ns", [-5, 0, 1, 100, 10**15])
def test_any_lateness_can_be_noted(late_ns: int) -> None:
    """Early, in time, and absurdly late."""
    lateness = Lateness()
    lateness.note(late_ns)
    assert lateness.summary().ticks == 1
    assert lateness.summary().max_us == max(late_ns, 0) * 1e-3


def test_nothing_noted_is_zero() -> None:
    """A report before the first tick."""
    assert Lateness().summary() == (0, 0.0, 0.0, 0.0, 0.0)


def test_waiter_never_wakes_early() -> None:
    """A deadline that has passed is not waited for."""
    wait = make_waiter()
    for _ in range(20):
        deadline = time.monotonic_ns() + 1_000_000
        wait(deadline)
        assert time.monotonic_ns() >= deadline
    begin = time.monotonic_ns()
    wait(begin - 1_000_000_000)
    assert time.monotonic_ns() - begin < 500_000_000
