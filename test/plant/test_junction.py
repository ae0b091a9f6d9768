"""Fibres on elastic tendons that answer once per tick."""

from __future__ import annotations

import numpy as np
import pytest

from xb_muscle_ros.plant.junction import Junction
from xb_muscle_ros.plant.plant import Architecture

MUSCLES = (Architecture("a", 1000.0, 0.05, 0.4, 0.25), Architecture("b", 500.0, 0.1, 0.0, 0.1))
TICK_S = 1e-3


def spring_f0(length_l0: np.ndarray, stiffness: float = 30.0) -> np.ndarray:
    """A fibre that is a spring."""
    return np.array([0.3, 0.2]) + stiffness * length_l0


def test_it_starts_in_balance_and_stays() -> None:
    """To rounding."""
    junction = Junction(MUSCLES, np.zeros(2), spring_f0(np.zeros(2)))
    assert junction.pull_f0(np.zeros(2)) == pytest.approx(spring_f0(np.zeros(2)), rel=1e-12)
    for _ in range(100):
        junction.advance(np.zeros(2), spring_f0(junction.length_l0), TICK_S)
    assert np.abs(junction.length_l0).max() < 1e-12


@pytest.mark.parametrize("stiffness", [3.0, 30.0, 300.0])
def test_it_follows_stretches_of_fibres_soft_and_stiff(stiffness: float) -> None:
    """At up to 0.6 L0/s within 0.1 % of F0, stiffer than expected or not; then it comes to rest in balance."""
    junction = Junction(MUSCLES, np.zeros(2), spring_f0(np.zeros(2)))
    worst = 0.0
    for k in range(1, 1001):
        path = np.full(2, 0.05 * (1.0 - np.cos(2.0 * np.pi * 2.0 * min(k, 500) * TICK_S)))
        junction.advance(path, spring_f0(junction.length_l0, stiffness), TICK_S)
        lag = junction.pull_f0(path) - spring_f0(junction.length_l0, stiffness)
        worst = max(worst, float(np.abs(lag).max()))
        if k == 125:
            assert np.all(junction.velocity_l0_per_s > 0.0)
            assert np.all(junction.length_l0 < path)
    assert worst < 1e-3
    assert np.abs(lag).max() < 1e-6


def test_it_settles_on_a_fibre_that_resists_velocity() -> None:
    """A damper answers a change of velocity as hard as a very stiff spring; the stiffness is learnt."""
    junction = Junction(MUSCLES, np.zeros(2), spring_f0(np.zeros(2)))
    path = np.zeros(2)
    for _ in range(400):
        path = path + 1e-4
        force = spring_f0(junction.length_l0, 1.0) + 0.5 * junction.velocity_l0_per_s
        junction.advance(path, force, TICK_S)
    lag = junction.pull_f0(path) - spring_f0(junction.length_l0, 1.0) - 0.5 * junction.velocity_l0_per_s
    assert np.abs(lag).max() < 1e-3
