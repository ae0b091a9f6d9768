"""Measures on a made inverted pendulum whose stiffness is known."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from xb_muscle_ros.plant.leg.episode import End, Episode
from xb_muscle_ros.plant.leg.measures import BAR_M, growth, held, numbers
from xb_muscle_ros.plant.leg.study import Pair
from xb_muscle_ros.plant.leg.sway import Sway
from xb_muscle_ros.plant.translation import RampAndHold

MGH, STIFFNESS, INERTIA, HEIGHT = 620.0, 465.0, 55.0, 0.85
RATE = math.sqrt((MGH - STIFFNESS) / INERTIA)


def pendulum(speed: float, lost_nm: float = 0.0, seconds: float = 1.0, pushed: bool = False) -> Episode:
    """Exact fall of a linear inverted pendulum on a spring that has lost some torque; a push is a speed (rad/s)."""
    time = np.arange(0.0, seconds + 1e-9, 0.001)
    rest = lost_nm / (MGH - STIFFNESS)
    angle = rest * (np.cosh(RATE * time) - 1.0) + speed / RATE * np.sinh(RATE * time)
    torque = 36.0 - lost_nm + STIFFNESS * angle
    none = np.zeros((time.size, 2))
    return Episode(
        model="made",
        platform=RampAndHold() if pushed else None,
        sway=Sway(),
        driven_by={},
        muscles=(),
        time_s=time,
        com_m=HEIGHT * np.sin(angle),
        height_m=HEIGHT * np.cos(angle),
        angle_rad=np.column_stack((0.1 + angle, none)),
        torque_nm=np.column_stack((torque, none)),
        force_n=np.zeros((time.size, 0)),
        soleus_m=np.zeros(time.size),
        start_acceleration=lost_nm / INERTIA,
        load_nm_per_rad=MGH,
        end=None,
    )


@pytest.mark.parametrize("lost_nm", [0.0, 5.0])
def test_stiffness_is_that_of_the_spring_whatever_torque_was_lost(lost_nm: float) -> None:
    found = numbers(Pair(pendulum(0.0, lost_nm), pendulum(0.05, lost_nm, pushed=True)))
    for name in ("20ms", "50ms", "100ms"):
        assert found[f"stiffness_{name}_nm_per_rad"] == pytest.approx(STIFFNESS, rel=1e-9)
        assert found[f"stiffness_{name}_mgh"] == pytest.approx(0.75, rel=1e-9)
    assert found["torque_at_start_nm"] == pytest.approx(36.0 - lost_nm)
    assert found["start_acceleration_still"] == pytest.approx(lost_nm / INERTIA)


def test_way_of_the_centre_of_mass_is_split_into_push_and_history() -> None:
    still, pushed = pendulum(0.0, 5.0), pendulum(0.05, 5.0, pushed=True)
    found = numbers(Pair(still, pushed))
    alone = HEIGHT * math.sin(5.0 / (MGH - STIFFNESS) * (math.cosh(0.3 * RATE) - 1.0))
    assert found["com_300ms_without_push_m"] == pytest.approx(alone, rel=1e-9)
    total, push = found["com_300ms_m"], found["com_300ms_by_push_m"]
    assert total is not None
    assert push is not None
    assert total == pytest.approx(alone + push)
    assert push == pytest.approx(HEIGHT * 0.05 / RATE * math.sinh(0.3 * RATE), rel=0.01)


def test_an_episode_too_short_for_a_score_has_none() -> None:
    found = numbers(Pair(pendulum(0.0), pendulum(0.05, seconds=0.06, pushed=True)))
    assert found["stiffness_50ms_mgh"] is not None
    assert found["stiffness_100ms_mgh"] is None
    assert found["com_100ms_m"] is None
    assert found["time_to_fall_s"] is None


def test_time_to_fall_is_told_of_falls_alone() -> None:
    still, pushed = pendulum(0.0), pendulum(0.05, pushed=True)
    fell = dataclasses.replace(pushed, end=End(0.8, "below", fell=True))
    broke = dataclasses.replace(pushed, end=End(0.8, "muscle", fell=False))
    assert numbers(Pair(still, fell))["time_to_fall_s"] == 0.8
    assert numbers(Pair(still, broke))["time_to_fall_s"] is None


def test_growth_is_that_of_the_pendulum() -> None:
    # By the second half the falling part of the hyperbolic sine has gone.
    found = growth(pendulum(1e-9, seconds=6.0))
    assert found["e_fold_s"] == pytest.approx(1.0 / RATE, rel=0.02)
    assert growth(pendulum(0.0))["e_fold_s"] is None


def test_hold_is_measured_against_the_bar() -> None:
    assert held(pendulum(0.0))["largest_com_m"] == 0.0
    assert held(pendulum(0.0))["within_bar_s"] is None
    found = held(pendulum(0.05))
    assert found["within_bar_s"] is not None
    expected = math.asinh(BAR_M / HEIGHT * RATE / 0.05) / RATE
    assert found["within_bar_s"] == pytest.approx(expected, abs=2e-3)
