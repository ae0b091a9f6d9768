"""MuJoCo's muscle on its slide, beside MuJoCo's own functions of length and velocity."""

from __future__ import annotations

import numpy as np
import pytest

from xb_muscle_ros.bench import papers_trial
from xb_muscle_ros.bench.peers import mujoco_muscle
from xb_muscle_ros.bench.peers.conditions import Path, path_of
from xb_muscle_ros.bench.peers.muscle import PeerMuscle
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.scores.conditions import CONDITIONS

mujoco = pytest.importorskip("mujoco", reason="the extra mujoco is not installed")


@pytest.fixture
def muscle() -> PeerMuscle:
    """The only one."""
    found, version = mujoco_muscle.peers()
    assert version == mujoco.__version__
    return found[0].take({})


def test_isometric_force_at_optimal_length_is_activation(muscle: PeerMuscle) -> None:
    """In F0: no passive force at L0."""
    assert [muscle.isometric_f0(a) for a in (0.0, 0.3, 1.0)] == pytest.approx([0.0, 0.3, 1.0], abs=1e-9)


def test_forces_are_those_of_the_engine_for_the_lengths_that_were_sent(muscle: PeerMuscle) -> None:
    """`mju_muscleGain` and `mju_muscleBias`, with the parameters of an MJCF file that names none."""
    path = path_of(CONDITIONS[-1])
    parameters = np.array([0.75, 1.05, 1.0, 200.0, 0.5, 1.6, 1.5, 1.3, 1.2])
    lengths = np.array([0.75, 1.05])
    expected = [
        -0.4 * mujoco.mju_muscleGain(1.0 + change, 0.4545, lengths, 1.0, parameters)
        - mujoco.mju_muscleBias(1.0 + change, lengths, 1.0, parameters)
        for change in path.length_l0()
    ]
    np.testing.assert_allclose(muscle.force_f0(0.4, path), expected, rtol=1e-9)


def test_a_timed_trial_goes_through_the_lengths(muscle: PeerMuscle) -> None:
    """The trial itself says so if it does not arrive; an error of force there is none."""
    costs = muscle.cost(0.5, Path(*papers_trial.corners(), papers_trial.sample_s()), 2)
    assert [cost.integrator for cost in costs] == ["mj_step, 2 ms", "mj_step, 1 ms"]
    assert all(len(cost.seconds) == 2 and min(cost.seconds) > 0.0 for cost in costs)


def test_without_mujoco_one_line_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """As elsewhere in the package."""
    monkeypatch.setitem(__import__("sys").modules, "mujoco", None)
    with pytest.raises(UserError, match=r"install it with pip install 'xb_muscle_ros\[mujoco\]'"):
        mujoco_muscle.peers()
