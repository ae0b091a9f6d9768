"""The watchdog without a clock: ages in, behaviour out."""

from __future__ import annotations

import math
from typing import Any

import pytest

from xb_muscle_ros.node.watchdog import DECAY, HOLD, ISOMETRIC, Watchdog, unfed

MS = 1_000_000


def test_overdue_begins_and_ends_with_one_line_each(notes: Any) -> None:
    """However often it is looked at."""
    dog = Watchdog(notes)
    assert dog.overdue_s(0, 100 * MS, 0.1, HOLD) <= 0.0
    assert dog.overdue_s(0, 101 * MS, 0.1, HOLD) == pytest.approx(0.001)
    assert dog.overdue_s(0, 300 * MS, 0.1, HOLD) == pytest.approx(0.2)
    assert dog.barking
    assert notes.lines == ["error no length for 0.101 s, timeout_s is 0.1 s: hold"]
    assert dog.overdue_s(350 * MS, 351 * MS, 0.1, HOLD) < 0.0
    assert dog.overdue_s(350 * MS, 352 * MS, 0.1, HOLD) < 0.0
    assert notes.lines[1:] == ["info length is back after 0.350 s: hold ends"]
    assert not dog.barking
    dog.overdue_s(350 * MS, 999 * MS, 0.1, HOLD)
    assert dog.timeouts == 2


def test_zero_is_off(notes: Any) -> None:
    """Whatever the age."""
    dog = Watchdog(notes)
    assert dog.overdue_s(0, 10**18, 0.0, HOLD) <= 0.0
    assert (dog.timeouts, notes.lines) == (0, [])


@pytest.mark.parametrize(
    ("on_timeout", "length", "calcium"),
    [(HOLD, 0.01, 8.0), (ISOMETRIC, 0.03, 8.0), (DECAY, 0.03, 8.0 * math.exp(-2.5))],
)
def test_behaviours(on_timeout: str, length: float, calcium: float) -> None:
    """Length of the sample or of the model; calcium held or fallen."""
    assert unfed(on_timeout, 0.5, 0.2, 0.01, 0.03, 8.0) == (length, pytest.approx(calcium))


def test_calcium_decays_to_nothing_without_fuss() -> None:
    """Hours later."""
    assert unfed(DECAY, 1e5, 0.001, 0.0, 0.0, 8.0) == (0.0, 0.0)
