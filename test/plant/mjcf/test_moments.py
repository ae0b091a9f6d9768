"""Isometric moments of ankle and knee are those of MuJoCo's muscles over the joints' ranges."""

from __future__ import annotations

from typing import Any

import pytest

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.plant.mjcf.moments import JointMoments

pytest.importorskip("mujoco")


@pytest.mark.slow
def test_ankle_and_knee_agree_at_full_activation(leg: Any) -> None:
    moments = JointMoments(leg)
    for joint in ("ankle_angle_r", "knee_angle_r"):
        found = moments.along(joint, 1.0, leg.key_qpos[0], 5)
        assert (found.own_nm.max(axis=0) > 50.0).all()
        assert (found.of_local < 0.05).all()
        assert (found.of_peak < 0.05).all()


@pytest.mark.slow
def test_a_joint_that_is_not_there_is_named(leg: Any) -> None:
    with pytest.raises(UserError, match=r"joint 'ankle_angle' is not known; did you mean 'ankle_angle_[rl]'"):
        JointMoments(leg).along("ankle_angle", 1.0, leg.key_qpos[0])
