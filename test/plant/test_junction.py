"""Fibres on elastic tendons that answer once per tick."""

from __future__ import annotations

import numpy as np
import pytest

from xb_muscle_ros.plant.junction import Junction
from xb_muscle_ros.plant.plant import Architecture

MUSCLES = (Architecture("a", 1000.0, 0.05, 0.4, 0.25), Architecture("b", 500.0, 0.1, 0.0, 0.1))
TICK_S = 1e-3


def spring_f0(length_l0: np.ndarray) -> np.ndarray:
    """A stiff fibre."""
    return np.array([0.3, 0.2]) + 30.0 * length_l0


def test_it_starts_in_balance_and_stays() -> None:
    """To rounding."""
    junction = Junction(MUSCLES, np.zeros(2), spring_f0(np.zeros(2)))
    assert junction.pull_f0(np.zeros(2)) == pytest.approx(spring_f0(np.zeros(2)), rel=1e-12)
    for _ in range(100):
        junction.advance(np.zeros(2), spring_f0(junction.length_l0), TICK_S)
    assert np.abs(junction.length_l0).max() < 1e-12


def lag_f0(junction: Junction, path: np.ndarray) -> np.ndarray:
    """How much more the tendons pull than the fibres."""
    return junction.pull_f0(path) - spring_f0(junction.length_l0)


def test_it_finds_the_new_balance_after_a_stretch() -> None:
    """A slow stretch is followed with a tenth of the difference that a damper alone would need."""
    junction = Junction(MUSCLES, np.zeros(2), spring_f0(np.zeros(2)))
    path = np.zeros(2)
    for _ in range(200):
        path = path + 1e-5
        before = lag_f0(junction, path)
        last = junction.length_l0
        junction.advance(path, spring_f0(junction.length_l0), TICK_S)
    speed = (junction.length_l0 - last) / TICK_S
    assert np.all(np.abs(before) < 0.1 * 0.05 * speed)
    for _ in range(200):
        junction.advance(path, spring_f0(junction.length_l0), TICK_S)
    assert junction.pull_f0(path) == pytest.approx(spring_f0(junction.length_l0), abs=1e-7)
    assert np.all((junction.length_l0 > 0.0) & (junction.length_l0 < path))
