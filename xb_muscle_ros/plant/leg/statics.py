"""What a posture asks of its muscles, and what MuJoCo's muscle would give."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from xb_muscle_ros.plant.leg.body import Body
from xb_muscle_ros.plant.plant import Array

_STEP_RAD = 1e-7


class Demand(NamedTuple):
    """At one posture at rest.

    Attributes:
        load: generalised force that muscles must give so that nothing accelerates, shape (nv,), N·m and N.
        arms: shape (nv, muscle), m: a pull of 1 N gives these generalised forces.
        active_n: pull of MuJoCo's muscle at activation 1 beyond its passive pull, shape (muscle,).
        passive_n: its passive pull.
    """

    load: Array
    arms: Array
    active_n: Array
    passive_n: Array

    def residual(self, activation: Array) -> Array:
        """Generalised force that is missing, shape (nv,)."""
        missing: Array = self.load - self.arms @ self.force_n(activation)
        return missing

    def force_n(self, activation: Array) -> Array:
        """Isometric pull at activations, shape (muscle,)."""
        force: Array = self.active_n * activation + self.passive_n
        return force


def demand(body: Body, qpos: Array) -> Demand:
    """What a posture asks for.

    Inverse dynamics at rest without acceleration: forces of contacts, joint limits and joint equalities are then known
    functions of how far these are displaced, so that no solver stands between posture and load. Contacts have no
    tangential force: MuJoCo's friction is viscous where nothing moves, and whatever pulls sideways creeps.
    """
    mj, model, data = body.mj, body.model, body.data
    data.qpos[:] = qpos
    data.qvel[:] = 0.0
    data.qacc[:] = 0.0
    mj.mj_inverse(model, data)
    moment = np.zeros((model.nu, model.nv))
    mj.mju_sparse2dense(moment, data.actuator_moment, data.moment_rownnz, data.moment_rowadr, data.moment_colind)
    curves = zip(
        data.actuator_length,
        model.actuator_lengthrange,
        model.actuator_acc0,
        model.actuator_gainprm,
        model.actuator_biasprm,
        strict=True,
    )
    pulls = np.array(
        [
            (mj.mju_muscleGain(at, 0.0, span, acc0, gain[:9]), mj.mju_muscleBias(at, span, acc0, bias[:9]))
            for at, span, acc0, gain, bias in curves
        ]
    )
    return Demand(data.qfrc_inverse.copy(), -moment.T, -pulls[:, 0], -pulls[:, 1])


def residual_by_posture(body: Body, qpos: Array, activation: Array, along: Array) -> tuple[Array, Array]:
    """Central differences of what is missing, and of what is measured of the posture.

    Args:
        body: its state is lost.
        qpos: posture.
        activation: shape (muscle,).
        along: directions of change, shape (nv, direction).

    Returns:
        Change of the residual, shape (nv, direction), and of `measured`, shape (9, direction).
    """
    residuals, measures = [], []
    for column in along.T:
        ends = []
        for sign in (1.0, -1.0):
            at = body.moved(qpos, sign * _STEP_RAD * column)
            ends.append((demand(body, at).residual(activation), measured(body)))
        residuals.append((ends[0][0] - ends[1][0]) / (2.0 * _STEP_RAD))
        measures.append((ends[0][1] - ends[1][1]) / (2.0 * _STEP_RAD))
    return np.array(residuals).T, np.array(measures).T


def measured(body: Body) -> Array:
    """Way of the centre of mass before the ankles, and heights of the sole's points, shape (9,), m."""
    lead = float((body.com_m - body.ankle_m) @ body.FORWARD)
    return np.concatenate(([lead], body.heights_m()))
