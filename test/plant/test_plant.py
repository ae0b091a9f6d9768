"""The scenes' mechanics, without any muscle model."""

from __future__ import annotations

import math

import numpy as np
import pytest

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.plant.plant import SCENES, Plant
from xb_muscle_ros.plant.translation import RampAndHold

pytest.importorskip("mujoco", reason="needs the extra mujoco")


def lengths_m(plant: Plant, angle_rad: float) -> np.ndarray:
    """Changes of the paths, from those of the fibres."""
    plant.reset(angle_rad)
    factor = [m.l0_m / math.cos(m.pennation_rad) for m in plant.muscles]
    return plant.length_change_l0() * factor


def test_leaning_forward_stretches_the_soleus_and_slackens_its_antagonist() -> None:
    plant = Plant("ankle")
    plant.reset(plant.start_rad)
    assert plant.length_change_l0() == pytest.approx([0.0, 0.0], abs=1e-12)
    plant.reset(plant.start_rad + 0.02)
    soleus, tibialis = plant.length_change_l0()
    assert soleus > 0.01
    assert tibialis < -0.005


def test_flexing_the_knee_stretches_the_vasti() -> None:
    plant = Plant("knee")
    plant.reset(0.0)
    level = plant.length_change_l0()[0]
    plant.reset(1.5)
    assert level < 0.0 < plant.length_change_l0()[0]


@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("angle", [0.0, 0.05, 0.3, 1.2])
def test_moment_arm_is_the_slope_of_the_length(scene: str, angle: float) -> None:
    plant = Plant(scene)
    step = 1e-6
    slope = (lengths_m(plant, angle + step) - lengths_m(plant, angle - step)) / (2.0 * step)
    plant.reset(angle)
    assert plant.lengthening_m_per_rad() == pytest.approx(slope, rel=1e-6)


def test_moment_arms_are_those_of_the_literature() -> None:
    ankle = Plant("ankle")
    assert ankle.lengthening_m_per_rad() == pytest.approx([0.046, -0.046], abs=0.002)
    knee = Plant("knee")
    for angle in np.linspace(0.0, 2.3, 12):
        knee.reset(float(angle))
        assert knee.lengthening_m_per_rad()[0] == pytest.approx(0.04, rel=1e-9)


def test_velocity_is_the_rate_of_the_length() -> None:
    plant = Plant("ankle")
    plant.reset(0.05, 0.7)
    before, rate = plant.length_change_l0(), plant.velocity_l0_per_s()
    plant.step()
    mean = 0.5 * (rate + plant.velocity_l0_per_s())
    assert (plant.length_change_l0() - before) / plant.tick_s == pytest.approx(mean, rel=1e-4)


def test_body_is_the_sum_of_its_segments() -> None:
    plant = Plant("ankle")
    # Mass times height of the three segments, and their inertia about the ankle, from the table's numbers.
    moment = 6.975 * 0.2441 + 15.0 * 0.6736 + 50.85 * 1.1748
    inertia = 0.1179 + 0.2877 + 3.178 + 6.975 * 0.2441**2 + 15.0 * 0.6736**2 + 50.85 * 1.1748**2
    plant.reset(0.2)
    assert plant.load_nm() == pytest.approx(9.81 * moment * math.sin(0.2), rel=1e-12)
    assert plant.acceleration_rad_per_s2() == pytest.approx(plant.load_nm() / inertia, rel=1e-12)


def test_passive_pendulum_keeps_its_energy() -> None:
    plant = Plant("ankle")
    plant.reset(0.3)
    before = plant.energy_j
    for _ in range(3000):
        plant.step()
    # It has fallen through and swung up on the other side (angle past pi), where the energy is all there again.
    assert plant.angle_rad > math.pi
    assert plant.energy_j == pytest.approx(before, rel=1e-9)


def test_leg_swings_about_hanging_and_is_damped_as_its_joint_says() -> None:
    plant = Plant("knee")
    inertia = 0.1467 + 4.575 * 0.2609**2
    plant.reset(math.pi / 2.0 - 0.05)
    angles = []
    for _ in range(8000):
        plant.step()
        angles.append(plant.angle_rad - math.pi / 2.0)
    late = max(angles[-2000:])
    # Amplitudes of a linear pendulum fall with damping over twice the inertia.
    peak_s = (6000 + angles[-2000:].index(late)) * plant.tick_s
    assert late == pytest.approx(0.05 * math.exp(-0.1 * peak_s / (2.0 * inertia)), rel=0.01)


def test_forces_act_with_arm_and_pennation() -> None:
    plant = Plant("ankle")
    free = plant.acceleration_rad_per_s2()
    plant.apply(np.array([0.1, 0.0]))
    change = plant.acceleration_rad_per_s2() - free
    inertia = plant.load_nm() / free
    pull = 0.1 * 7098.0 * math.cos(0.4363)
    assert change == pytest.approx(-pull * plant.lengthening_m_per_rad()[0] / inertia, rel=1e-9)


def test_own_muscle_has_the_same_force_at_reference_length() -> None:
    plant = Plant("ankle", own_muscles=True)
    plant.activate(np.array([1.0, 1.0]))
    assert plant.own_force_n() == pytest.approx(plant.tendon_force_n(np.ones(2)), rel=1e-9)


def test_platform_reaches_its_displacement_at_its_speed() -> None:
    motion = RampAndHold(-0.075, 0.2, 2.0)
    times = np.arange(0.0, 1.0, 0.001)
    velocity = np.cumsum([0.001 * motion.mean_acceleration(float(t), 0.001) for t in times])
    assert np.min(velocity) == pytest.approx(-0.2, abs=1e-12)
    assert np.sum(velocity) * 0.001 == pytest.approx(-0.075, abs=1e-5)
    assert velocity[-1] == pytest.approx(0.0, abs=1e-12)


def test_short_platform_motion_never_reaches_its_speed() -> None:
    motion = RampAndHold(0.01, 1.0, 2.0)
    velocity = np.array([motion.velocity_at(float(t)) for t in np.arange(0.0, 0.3, 1e-5)])
    assert np.max(velocity) < 0.2
    assert np.sum(velocity) * 1e-5 == pytest.approx(0.01, rel=1e-4)


def test_body_lags_behind_the_platform() -> None:
    plant = Plant("ankle")
    plant.reset(0.0)
    plant.step(-2.0)
    # Backwards ground makes an upright body fall forward, by mass times height times acceleration over inertia.
    plant.reset(0.1)
    moment_over_inertia = plant.acceleration_rad_per_s2() / (9.81 * math.sin(0.1))
    plant.reset(0.0)
    plant.step(-2.0)
    assert plant.velocity_rad_per_s == pytest.approx(2.0 * moment_over_inertia * plant.tick_s, rel=1e-4)


@pytest.mark.parametrize(("field", "value"), [("speed_m_per_s", 0.0), ("acceleration_m_per_s2", -1.0)])
def test_impossible_platform(field: str, value: float) -> None:
    with pytest.raises(UserError, match=field.split("_")[0]):
        RampAndHold(**{field: value})


def test_unknown_scene() -> None:
    with pytest.raises(UserError, match="did you mean 'ankle'"):
        Plant("ankel")
