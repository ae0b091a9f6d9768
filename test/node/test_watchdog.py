"""The watchdog without a clock: ages in, behaviour out."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from xb_muscle_ros.node.rules import NO_STAMP
from xb_muscle_ros.node.samples import Inputs
from xb_muscle_ros.node.watchdog import DECAY, HOLD, ISOMETRIC, Watchdog, unfed

MS = 1_000_000


def look(dog: Watchdog, arrival_ns: int, now_ns: int, timeout_s: float) -> float:
    """How long the one fibre's sample is overdue, s; 0 where it is not."""
    one, stamp = np.zeros(1), np.array([arrival_ns])
    inputs = Inputs(one, one, one, stamp, arrival_ns, one, stamp)
    found = dog.look(inputs, NO_STAMP, now_ns, timeout_s, HOLD, np.array([True]))
    return 0.0 if found is None else float(found[0])


def test_overdue_begins_and_ends_with_one_line_each(notes: Any) -> None:
    """However often it is looked at."""
    dog = Watchdog(["left"], notes)
    assert look(dog, 0, 100 * MS, 0.1) == 0.0
    assert look(dog, 0, 101 * MS, 0.1) == pytest.approx(0.001)
    assert look(dog, 0, 300 * MS, 0.1) == pytest.approx(0.2)
    assert dog.overdue.tolist() == [True]
    assert notes.lines == ["error no length for 0.101 s, timeout_s is 0.1 s: hold"]
    assert look(dog, 350 * MS, 351 * MS, 0.1) == 0.0
    assert look(dog, 350 * MS, 352 * MS, 0.1) == 0.0
    assert notes.lines[1:] == ["info length is back after 0.350 s: hold ends"]
    assert dog.overdue.tolist() == [False]
    look(dog, 350 * MS, 999 * MS, 0.1)
    assert dog.timeouts == 2


def test_zero_is_off(notes: Any) -> None:
    """Whatever the age."""
    dog = Watchdog(["left"], notes)
    assert look(dog, 0, 10**18, 0.0) == 0.0
    assert (dog.timeouts, notes.lines) == (0, [])


@pytest.mark.parametrize(
    ("on_timeout", "length", "calcium"),
    [(HOLD, 0.01, 8.0), (ISOMETRIC, 0.03, 8.0), (DECAY, 0.03, 8.0 * math.exp(-2.5))],
)
def test_behaviours(on_timeout: str, length: float, calcium: float) -> None:
    """Length of the sample or of the model; calcium held or fallen."""
    one = np.ones(1)
    found = unfed(on_timeout, 0.5 * one, 0.2, 0.01 * one, 0.03 * one, 8.0 * one)
    assert [values.tolist() for values in found] == [[length], pytest.approx([calcium])]


def test_calcium_decays_to_nothing_without_fuss() -> None:
    """Hours later."""
    none = np.zeros(1)
    found = unfed(DECAY, none + 1e5, 0.001, none, none, none + 8.0)
    assert [values.tolist() for values in found] == [[0.0], [0.0]]
