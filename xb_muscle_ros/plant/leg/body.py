"""MyoLeg on a level floor: where its joints, soles and centre of mass are. Knows nothing of muscle models."""

from __future__ import annotations

import copy
import functools
from typing import Any

import numpy as np

from xb_muscle_ros.plant.engine import mujoco, myo_sim, quiet
from xb_muscle_ros.plant.plant import GRAVITY_M_S2, Array

MODEL = "myolegs"
TICK_S = 0.001
SIDES = ("r", "l")
_SOLE = ("foot_col1", "foot_col3", "bofoot_col2")
"""Capsules that a foot stands on: two along the heel and midfoot, one across the toes."""


@functools.cache
def _compiled() -> Any:
    """MyoLeg, standing on a plane.

    The model's own platform is a cylinder, for which MuJoCo finds contacts by iteration, to about 1 µm. A body that is
    not stable makes that noise grow; contacts with a plane are exact.

    Raises:
        UserError: no MuJoCo, or no myo-sim.
    """
    mj, library = mujoco(), myo_sim()
    with quiet(mj):
        spec = library.load_spec(MODEL, build_kwargs={"postures": ["standing"]})
        geoms = list(spec.worldbody.geoms)
        floor = next(geom for geom in geoms if geom.type == mj.mjtGeom.mjGEOM_PLANE)
        platform = next(geom for geom in geoms if geom.type == mj.mjtGeom.mjGEOM_CYLINDER and geom.contype)
        floor.pos = [0.0, 0.0, platform.pos[2] + platform.size[1]]
        platform.contype = platform.conaffinity = 0
        model = spec.compile()
    model.opt.timestep = TICK_S
    # The constraint solver stops where it cannot get better, not at 1e-8 of the body's weight.
    model.opt.tolerance = 1e-14
    return model


class Body:
    """The model and one state of it.

    Left and right joints have mirrored axes: equal angles are a symmetric posture. The body faces along -y.

    Attributes:
        mj: the engine's module.
        model, data: MuJoCo's.
        muscles: names of the actuators.
        l0_m: optimal fibre length of each, as MuJoCo's muscle reads it, shape (muscle,).
        optimal_m: length of the actuator at which the fibre is as long, on a rigid tendon, shape (muscle,).
        tick_s: length of one step.
    """

    FORWARD = np.array([0.0, -1.0, 0.0])

    def __init__(self) -> None:
        """Stand in MyoLeg's own posture.

        Raises:
            UserError: no MuJoCo, or no myo-sim.
        """
        self.mj = mujoco()
        self.model = copy.copy(_compiled())
        self.data = self.mj.MjData(self.model)
        self.mj.mj_resetDataKeyframe(self.model, self.data, 0)
        self.mj.mj_forward(self.model, self.data)
        names = self.mj.mjtObj
        self.muscles = tuple(self._name(names.mjOBJ_ACTUATOR, i) for i in range(self.model.nu))
        span, fibres = self.model.actuator_lengthrange, self.model.actuator_gainprm[:, :2]
        self.l0_m: Array = (span[:, 1] - span[:, 0]) / (fibres[:, 1] - fibres[:, 0])
        self.optimal_m: Array = span[:, 0] + (1.0 - fibres[:, 0]) * self.l0_m
        self.tick_s = float(self.model.opt.timestep)
        self._talus = [self.model.body(f"talus_{side}").id for side in SIDES]
        self._floor = self.model.geom("floor").id
        self._sole = self._ends()

    def length_change_l0(self) -> Array:
        """Lengths of fibres and tendons beyond optimal fibres and slack tendons, shape (muscle,), L0."""
        change: Array = (self.data.actuator_length - self.optimal_m) / self.l0_m
        return change

    def _name(self, kind: Any, index: int) -> str:
        return str(self.mj.mj_id2name(self.model, kind, index) or "")

    def _ends(self) -> list[tuple[int, float]]:
        """Capsule and end (+1 or -1) of what a foot stands on, right foot first: two at the heel, two at the toes."""
        found = []
        for side in SIDES:
            for name in _SOLE:
                geom = self.model.geom(f"{name}_{side}").id
                along = self.data.geom_xmat[geom].reshape(3, 3)[:, 2]
                backward = 1.0 if along @ self.FORWARD < 0.0 else -1.0
                found += [(geom, 1.0), (geom, -1.0)] if name.startswith("bofoot") else [(geom, backward)]
        return found

    def dofs(self, joint: str) -> list[int]:
        """Degrees of freedom of a joint without its side, right first."""
        return [int(self.model.joint(f"{joint}_{side}").dofadr[0]) for side in SIDES]

    def coordinates(self, joint: str) -> list[int]:
        """Entries of ``qpos`` of a joint without its side, right first."""
        return [int(self.model.joint(f"{joint}_{side}").qposadr[0]) for side in SIDES]

    def angle_rad(self, joint: str) -> float:
        """Mean of both sides."""
        return float(np.mean(self.data.qpos[self.coordinates(joint)]))

    def muscle_torque_nm(self, joint: str) -> float:
        """Sum of both sides, of all muscles, along the joint's angle."""
        return float(np.sum(self.data.qfrc_actuator[self.dofs(joint)]))

    def moved(self, qpos: Array, change: Array) -> Array:
        """A posture after a small change along the degrees of freedom, shape (nv,)."""
        made = qpos.copy()
        self.mj.mj_integratePos(self.model, made, change, 1.0)
        return made

    def difference(self, start: Array, end: Array) -> Array:
        """The change along the degrees of freedom, shape (nv,), that leads from one posture to another."""
        change = np.zeros(self.model.nv)
        self.mj.mj_differentiatePos(self.model, change, 1.0, start, end)
        return change

    def coupled(self, qpos: Array) -> Array:
        """A posture whose knee coordinates follow its knee angles, as the model's joint equalities have it."""
        model, made = self.model, qpos.copy()
        for joint, leader, coefficients in zip(model.eq_obj1id, model.eq_obj2id, model.eq_data[:, :5], strict=True):
            made[model.jnt_qposadr[joint]] = np.polyval(coefficients[::-1], qpos[model.jnt_qposadr[leader]])
        return made

    def place(self, qpos: Array) -> None:
        """Put joints somewhere, at rest; positions of bodies follow."""
        self.data.qpos[:] = qpos
        self.data.qvel[:] = 0.0
        self.mj.mj_fwdPosition(self.model, self.data)

    def heights_m(self) -> Array:
        """Of the sole's points above the floor, negative where pressed in, shape (8,): see `sole_points`."""
        heights: Array = self.sole_points()[:, 2] - self.data.geom_xpos[self._floor, 2]
        return heights

    def sole_points(self) -> Array:
        """Lowest points of heel (two) and toes (two) of the right, then the left foot, shape (8, 3), m."""
        data, model = self.data, self.model
        points = [
            data.geom_xpos[geom]
            + end * model.geom_size[geom, 1] * data.geom_xmat[geom].reshape(3, 3)[:, 2]
            - np.array([0.0, 0.0, model.geom_size[geom, 0]])
            for geom, end in self._sole
        ]
        return np.array(points)

    def foot(self, side: int) -> tuple[Array, Array]:
        """Position (3,) and orientation (3, 3) of the right (0) or left (1) foot."""
        index = self.model.body(f"calcn_{SIDES[side]}").id
        return self.data.xpos[index].copy(), self.data.xmat[index].reshape(3, 3).copy()

    def foot_jacobian(self, side: int) -> Array:
        """Velocity and rotation of a foot by degree of freedom, shape (6, nv)."""
        index = self.model.body(f"calcn_{SIDES[side]}").id
        made = np.zeros((6, self.model.nv))
        self.mj.mj_jacBody(self.model, self.data, made[:3], made[3:], index)
        return made

    @property
    def ankle_m(self) -> Array:
        """Midway between the ankles, shape (3,)."""
        middle: Array = self.data.xpos[self._talus].mean(axis=0)
        return middle

    @property
    def com_m(self) -> Array:
        """Centre of mass, shape (3,)."""
        position: Array = self.data.subtree_com[0].copy()
        return position

    @property
    def mass_kg(self) -> float:
        """Of the whole body."""
        return float(self.model.body_subtreemass[0])

    @property
    def load_nm_per_rad(self) -> float:
        """Stiffness that both ankles together need to carry the body as an inverted pendulum: m·g·h."""
        return self.mass_kg * GRAVITY_M_S2 * float(self.com_m[2] - self.ankle_m[2])

    def contact_forces_n(self) -> Array:
        """Force on the body of each contact, along the floor's normal and its two tangents, shape (contact, 3)."""
        found, force = np.zeros((self.data.ncon, 3)), np.zeros(6)
        for i in range(self.data.ncon):
            self.mj.mj_contactForce(self.model, self.data, i, force)
            found[i] = force[:3]
        return found

    def frame_accelerates(self, forward_m_per_s2: float) -> None:
        """Let the platform accelerate from now on: seen from it, the body feels the opposite.

        Exact for a translation that is prescribed.
        """
        self.model.opt.gravity[:] = -forward_m_per_s2 * self.FORWARD
        self.model.opt.gravity[2] = -GRAVITY_M_S2
