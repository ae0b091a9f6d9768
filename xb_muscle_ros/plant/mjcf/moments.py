"""Isometric moments of a joint over its range: cross-bridge muscles beside MuJoCo's own."""

from __future__ import annotations

import copy
from typing import Any, NamedTuple

import numpy as np

from xb_muscle_ros.errors import UserError, suggest
from xb_muscle_ros.plant.engine import mujoco
from xb_muscle_ros.plant.mjcf.muscles import CrossBridgeMuscles
from xb_muscle_ros.plant.mjcf.table import Table
from xb_muscle_ros.plant.plant import Array

_LOCAL = 0.1
"""Share of the peak below which a moment is not divided by."""


class Moments(NamedTuple):
    """Moments about one joint; all muscles that turn it one way together, shape (posture, 2): towards + and towards -.

    Attributes:
        angle_rad: of the joint, shape (posture,).
        own_nm, fibres_nm: of MuJoCo's muscles and of the fibres, N·m, both counted positive.
    """

    angle_rad: Array
    own_nm: Array
    fibres_nm: Array

    @property
    def of_peak(self) -> Array:
        """Largest difference, as a share of the peak moment of MuJoCo's muscles, by direction, shape (2,)."""
        share: Array = np.abs(self.fibres_nm - self.own_nm).max(axis=0) / self.own_nm.max(axis=0)
        return share

    @property
    def of_local(self) -> Array:
        """Largest difference as a share of the moment at the same posture, where that is over a tenth of the peak."""
        large = self.own_nm > _LOCAL * self.own_nm.max(axis=0)
        difference = np.abs(self.fibres_nm - self.own_nm)
        share: Array = np.where(large, difference / np.where(large, self.own_nm, 1.0), 0.0).max(axis=0)
        return share


class JointMoments:
    """A model twice, with its own muscles and with fibres, at postures along one joint."""

    def __init__(self, model: Any, table: Table = None) -> None:
        """Build the fibres; `model` stays as it is.

        Raises:
            UserError: see `CrossBridgeMuscles`.
        """
        self._mj = mujoco()
        self._own, self._plain = model, copy.copy(model)
        self.muscles = CrossBridgeMuscles(self._plain, table)
        self._own_data, self._plain_data = self._mj.MjData(self._own), self._mj.MjData(self._plain)

    def along(self, joint: str, activation: float, qpos: Array, postures: int = 31) -> Moments:
        """Moments over the whole range of a joint, all muscles at one activation and at rest.

        Args:
            joint: a hinge with a range.
            activation: 0 to 1.
            qpos: of the other joints; those coupled to it by an equality follow.
            postures: how many, equally spaced.

        Raises:
            UserError: no such joint.
        """
        names = [self._own.joint(i).name for i in range(self._own.njnt)]
        if joint not in names:
            raise UserError(f"joint '{joint}' is not known{suggest(joint, names)}")
        number = names.index(joint)
        first, last = self._own.jnt_range[number].tolist()
        angles = np.linspace(first, last, postures)
        sums = np.array([self._at(number, float(angle), activation, qpos) for angle in angles])
        return Moments(angles, sums[:, 0], sums[:, 1])

    def _at(self, joint: int, angle: float, activation: float, qpos: Array) -> Array:
        """Sums over muscles by direction, of MuJoCo's own and of the fibres, shape (2, 2)."""
        place, direction = self._coupled(joint, angle, qpos)
        own, plain, index = self._own_data, self._plain_data, self.muscles.index
        for data in (own, plain):
            data.qpos[:], data.qvel[:] = place, 0.0
        own.act[:] = activation
        self._mj.mj_forward(self._own, own)
        self._mj.mj_fwdPosition(self._plain, plain)
        plain.ctrl[index] = -self.muscles.isometric_force_n(plain, activation)
        self._mj.mj_forward(self._plain, plain)
        arms = self._arms(direction)
        pulls = np.stack((own.actuator_force[index], plain.actuator_force[index]))
        each = pulls * arms
        return np.stack((np.maximum(each, 0.0).sum(axis=1), np.maximum(-each, 0.0).sum(axis=1)), axis=1)

    def _arms(self, direction: Array) -> Array:
        """Moment arms of the muscles by MuJoCo's own transmission, along the joint and what is coupled to it."""
        dense = np.zeros((self._own.nu, self._own.nv))
        data = self._own_data
        self._mj.mju_sparse2dense(
            dense, data.actuator_moment.ravel(), data.moment_rownnz, data.moment_rowadr, data.moment_colind.ravel()
        )
        arms: Array = (dense @ direction)[self.muscles.index]
        return arms

    def _coupled(self, joint: int, angle: float, qpos: Array) -> tuple[Array, Array]:
        """Positions with a joint at an angle, and how all velocities go with that of the joint."""
        model = self._own
        place, direction = np.array(qpos), np.zeros(model.nv)
        place[model.jnt_qposadr[joint]], direction[model.jnt_dofadr[joint]] = angle, 1.0
        change = angle - model.qpos0[model.jnt_qposadr[joint]]
        for k in np.flatnonzero(model.eq_type == self._mj.mjtEq.mjEQ_JOINT):
            if model.eq_obj2id[k] != joint:
                continue
            other, factors = model.eq_obj1id[k], model.eq_data[k, :5]
            address = model.jnt_qposadr[other]
            place[address] = model.qpos0[address] + float(np.polyval(factors[::-1], change))
            slope = np.polyval(np.polyder(factors[::-1]), change)
            direction[model.jnt_dofadr[other]] = float(slope)
        return place, direction
