"""Activation is that of MuJoCo's muscle, to the bit."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from xb_muscle_ros.plant.mjcf.activation import ActivationDynamics
from xb_muscle_ros.plant.mjcf.actuators import read_muscles

mujoco = pytest.importorskip("mujoco")


@pytest.mark.parametrize("smoothing", [0.0, 0.3])
def test_follows_excitation_as_mujocos_muscle_does(arm: Callable[..., Any], smoothing: float) -> None:
    model = arm()
    model.actuator_dynprm[:, 2] = smoothing
    model.actuator_ctrllimited[0], model.actuator_ctrlrange[0] = 1, (0.1, 0.8)
    model.actuator_actlimited[1], model.actuator_actrange[1] = 1, (0.2, 0.9)
    dynamics = ActivationDynamics(read_muscles(model))
    data = mujoco.MjData(model)
    data.act[:] = activation = np.array([0.3, 0.5])
    rng = np.random.default_rng(4)
    for _ in range(400):
        data.ctrl[:] = excitation = rng.uniform(-0.2, 1.2, 2)
        mujoco.mj_step(model, data)
        activation = dynamics.after(activation, excitation, model.opt.timestep)
        assert activation.tobytes() == data.act.tobytes()
