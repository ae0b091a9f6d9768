"""MuJoCo's muscle on a slide joint."""

from __future__ import annotations

import importlib
import time
from collections.abc import Mapping
from typing import Any

import numpy as np

from xb_muscle_ros.bench.peers.conditions import Path
from xb_muscle_ros.bench.peers.muscle import F0_N, L0_M, Cost, Peer
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.trial import Array

# The slide's position is the muscle's length change. Lengths of its range are 0.75 to 1.05 L0 by MuJoCo's default, so
# this length range makes L0 the optimal length and leaves no tendon, which in MuJoCo would be rigid.
_XML = """
<mujoco>
 <option gravity="0 0 0"/>
 <worldbody>
  <body>
   <joint name="slide" type="slide" axis="1 0 0"/>
   <geom size="0.01" mass="1e12" contype="0" conaffinity="0"/>
  </body>
 </worldbody>
 <actuator>
  <muscle name="muscle" joint="slide" force="{force}" lengthrange="{low} {high}"/>
 </actuator>
</mujoco>
"""
_RANGE = (0.75, 1.05)
# The muscle moves the body by some 1e-7 L0 in a trial.
_ARRIVES_L0 = 1e-6


def peers() -> tuple[list[Peer], str]:
    """Rows of the comparison (one: there is no elastic tendon), and MuJoCo's version.

    Raises:
        UserError: MuJoCo is not installed.
    """
    try:
        mujoco: Any = importlib.import_module("mujoco")
    except ImportError as error:
        raise UserError(
            f"MuJoCo cannot be imported ({error}); install it with pip install 'xb_muscle_ros[mujoco]'"
        ) from None

    def take(values: Mapping[str, float]) -> MujocoMuscle:
        return MujocoMuscle(mujoco)

    vmax = MujocoMuscle(mujoco).vmax_l0_per_s
    return [Peer("mujoco", "MuJoCo muscle", take, {"vmax_l0_per_s": vmax}, (), "none")], str(mujoco.__version__)


class MujocoMuscle:
    """See `muscle.PeerMuscle`. Its force depends on length, velocity and activation at the time, and on nothing before.

    Attributes:
        least_activation: that it takes.
        vmax_l0_per_s: MuJoCo's default.
    """

    least_activation = 0.0

    def __init__(self, mujoco: Any) -> None:
        self._mujoco = mujoco
        low, high = ((r - 1.0) * L0_M for r in _RANGE)
        self._model = mujoco.MjModel.from_xml_string(_XML.format(force=F0_N, low=low, high=high))
        self._data = mujoco.MjData(self._model)
        self.vmax_l0_per_s = float(self._model.actuator_gainprm[0, 6])

    def isometric_f0(self, activation: float) -> float:
        """Force at rest, F0."""
        return self._force(activation, 0.0, 0.0)

    def force_f0(self, activation: float, path: Path) -> Array:
        """Force at the samples, F0; at a corner with the velocity before it."""
        part = np.clip(np.searchsorted(path.corner_s, path.sample_s, side="left"), 1, path.corner_s.size - 1) - 1
        velocity = (np.diff(path.corner_l0) / np.diff(path.corner_s))[part]
        return np.array([self._force(activation, *at) for at in zip(path.length_l0(), velocity, strict=True)])

    def cost(self, activation: float, path: Path, repeats: int) -> list[Cost]:
        """With MuJoCo's own time step and with 1 ms; steps end at corners, so that force has no error at any step."""
        default = float(self._mujoco.MjOption().timestep)
        return [
            Cost(
                f"mj_step, {1e3 * step:g} ms", [self._stepped(activation, path, step) for _ in range(repeats + 1)][1:],
                0.0, step == default,
            )
            for step in (default, 1e-3)
        ]  # fmt: skip

    def _stepped(self, activation: float, path: Path, step_s: float) -> float:
        """Seconds for a trial, step by step inside MuJoCo; the body moves at the speed that it is given."""
        model, data, mj_step = self._model, self._data, self._mujoco.mj_step
        self._mujoco.mj_resetData(model, data)
        data.act[0] = data.ctrl[0] = activation
        begin = time.perf_counter()
        for duration, rise in zip(np.diff(path.corner_s).tolist(), np.diff(path.corner_l0).tolist(), strict=True):
            data.qvel[0] = rise * L0_M / duration
            whole = int(duration / step_s)
            model.opt.timestep = step_s
            if whole:
                mj_step(model, data, whole)
            model.opt.timestep = duration - whole * step_s
            if model.opt.timestep > 0.0:
                mj_step(model, data)
        seconds = time.perf_counter() - begin
        arrived = float(data.qpos[0]) / L0_M
        if abs(arrived - path.corner_l0[-1]) > _ARRIVES_L0:
            raise UserError(f"MuJoCo's muscle is at {arrived:.6g} L0 at the end, not at {path.corner_l0[-1]:.6g}")
        return seconds

    def _force(self, activation: float, length_l0: float, velocity_l0_per_s: float) -> float:
        data = self._data
        data.act[0] = data.ctrl[0] = activation
        data.qpos[0], data.qvel[0] = length_l0 * L0_M, velocity_l0_per_s * L0_M
        self._mujoco.mj_forward(self._model, data)
        return -float(data.actuator_force[0]) / F0_N
