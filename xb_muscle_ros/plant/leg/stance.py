"""A posture in static equilibrium, and the least muscle that holds it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import lsq_linear

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.plant.leg.body import Body
from xb_muscle_ros.plant.leg.statics import Demand, demand, measured, residual_by_posture
from xb_muscle_ros.plant.plant import Array

RESIDUAL = 1e-6
"""Largest generalised force that may be missing, N·m and N."""
# Costs beside the sum of squared activations: of joints away from the posture aimed at (1/rad; knees are coupled, the
# toes' axis runs over their contacts, so that hardly anything else holds their angle), and of soles that are not level.
_HOLD = {
    "hip_flexion": 3.0, "hip_adduction": 3.0, "hip_rotation": 3.0, "knee_angle": 10.0,
    "ankle_angle": 3.0, "subtalar_angle": 10.0, "mtp_angle": 30.0,
}  # fmt: skip
_PITCH, _LEVEL_PER_M = 1.0, 300.0
# Weights that make equations of costs: of the lead (1/m), and of the generalised forces.
_LEAD_PER_M, _BALANCE = 1e4, 1e3
_SINK_M = 5e-4
_LARGEST_M, _LARGEST_RAD = 1.5e-4, 0.02
_FREE_STEPS, _STEPS = 30, 150


@dataclass(frozen=True)
class Aim:
    """What stance is looked for.

    Attributes:
        lead_m: way of the centre of mass before the ankles.
        knee_rad: flexion that the knees are kept near.
        tone: least activation of every muscle.
    """

    lead_m: float = 0.05
    knee_rad: float = 0.087
    tone: float = 0.02

    def __post_init__(self) -> None:
        """Refuse what no one stands like.

        Raises:
            UserError: a number out of range.
        """
        for name, value, low, high, unit in (
            ("centre of mass before the ankles", self.lead_m, 0.0, 0.1, "m"),
            ("knee flexion", self.knee_rad, 0.03, 0.4, "rad"),
            ("muscles' least activation", self.tone, 0.005, 0.2, "of 1"),
        ):
            if not low <= value <= high:
                raise UserError(f"the stance's {name} is {value:g}; allowed is {low:g} to {high:g} ({unit})")


@dataclass(frozen=True, eq=False)
class Stance:
    """A posture that its muscles' isometric forces hold.

    Attributes:
        aim: what was looked for.
        qpos: posture, shape (nq,).
        force_n: pull of each muscle, shape (muscle,).
        activation: at which MuJoCo's muscle pulls so, shape (muscle,).
        residual: largest generalised force that is missing, N·m and N.
        lead_m: way of the centre of mass before the ankles.
        heights_m: of the sole's points, see `Body.heights_m`; contacts carry below 1 mm.
    """

    aim: Aim
    qpos: Array
    force_n: Array
    activation: Array
    residual: float
    lead_m: float
    heights_m: Array


def find_stance(body: Body, aim: Aim) -> Stance:
    """Minimise the sum of squared activations over activations and posture, in static equilibrium.

    Sequential least squares with bounds, symmetric, the equations of equilibrium and the lead as heavy rows; steps are
    kept so small that no contact jumps, and the posture is frozen by and by. Then Newton steps of least norm, in all
    degrees of freedom and both legs apart, until nothing is missing: an unstable body makes every error grow.

    Args:
        body: its state is lost.
        aim: what to look for.

    Raises:
        UserError: there is no such stance.
    """
    qpos = _upright(body, aim)
    posture, activation = _optimised(body, aim, qpos)
    posture, activation = _polished(body, aim, posture, activation)
    found = demand(body, posture)
    residual = float(np.max(np.abs(found.residual(activation))))
    lead, heights = float(measured(body)[0]), measured(body)[1:]
    if residual > RESIDUAL or abs(lead - aim.lead_m) > 2e-3 or not np.all((activation > 0.0) & (activation < 1.0)):
        raise UserError(
            f"no stance found with the centre of mass {aim.lead_m:g} m before the ankles, knees at {aim.knee_rad:g} "
            f"rad and activations from {aim.tone:g}: {residual:.2g} N·m are missing, the lead is {lead:.4f} m, "
            f"activations reach {activation.max():.2f}; take --lead near 0.05 and --tone near 0.02"
        )
    return Stance(aim, posture, found.force_n(activation), activation, residual, lead, heights)


def _upright(body: Body, aim: Aim) -> Array:
    """MyoLeg's own posture with bent knees, leaning, soles level and a little in the floor."""
    qpos = body.data.qpos.copy()
    body.place(qpos)
    position, orientation = body.foot(0)
    lean = aim.lead_m / float(body.com_m[2] - body.ankle_m[2])
    qpos[body.coordinates("knee_angle")] = aim.knee_rad
    qpos[body.coordinates("hip_flexion")] = 0.5 * aim.knee_rad
    qpos[body.coordinates("ankle_angle")] = 0.5 * aim.knee_rad + lean
    qpos = body.coupled(qpos)
    body.place(qpos)
    turn = orientation @ body.foot(0)[1].T
    pitch = np.zeros(body.model.nv)
    pitch[3] = math.atan2(turn[2, 1], turn[2, 2])
    qpos = body.moved(qpos, pitch)
    body.place(qpos)
    qpos[:3] += position - body.foot(0)[0]
    qpos[0] = 0.0
    body.place(qpos)
    qpos[2] -= float(np.mean(body.heights_m())) + _SINK_M
    return qpos


def _symmetric(body: Body) -> Array:
    """Directions of symmetric change: up, pitch, and every joint in both legs, shape (nv, direction)."""
    legs = (body.model.nv - 6) // 2
    made = np.zeros((body.model.nv, 2 + legs))
    made[2, 0] = made[3, 1] = 1.0
    for k in range(legs):
        made[[6 + k, 6 + legs + k], 2 + k] = 1.0
    return made


def _holding(body: Body, along: Array) -> Array:
    """Cost of change along each direction, see `_HOLD`."""
    cost = np.zeros(body.model.nv)
    cost[3] = _PITCH
    for joint, weight in _HOLD.items():
        cost[body.dofs(joint)[0]] = weight
    made: Array = cost @ along
    return made


def _optimised(body: Body, aim: Aim, start: Array) -> tuple[Array, Array]:
    """Posture, and activations of all muscles, both legs alike; see `find_stance`."""
    along = _symmetric(body)
    holding = np.diag(_holding(body, along))
    directions, half = along.shape[1], body.model.nu // 2
    both = np.tile(np.eye(half), (2, 1))
    level = _LEVEL_PER_M * (np.eye(8) - np.kron(np.eye(2), np.full((4, 4), 0.25)))
    lower = np.concatenate((np.full(directions, -1.0), np.full(half, aim.tone)))
    posture, activation = start, np.full(half, max(0.05, aim.tone))
    for step in range(_STEPS):
        now = demand(body, posture)
        at = measured(body)
        missing = now.residual(both @ activation)
        by_posture, by_measure = residual_by_posture(body, posture, both @ activation, along)
        by_activation = -(now.arms * now.active_n) @ both
        scale = _BALANCE / np.maximum(1.0, np.abs(by_posture).max(axis=1) / 1e3)
        away = np.linalg.lstsq(along, body.difference(start, posture), rcond=None)[0]
        frozen = 0.0 if step < _FREE_STEPS else 10.0 ** ((step - _FREE_STEPS) / 15.0)
        none = np.zeros((directions, half))
        rows = np.vstack(
            (
                np.hstack((by_posture, by_activation)) * scale[:, None],
                np.hstack((np.zeros((half, directions)), np.eye(half))),
                np.hstack((holding, none)),
                np.hstack((frozen * np.eye(directions), none)),
                np.hstack((level @ by_measure[1:], np.zeros((8, half)))),
                np.concatenate((_LEAD_PER_M * by_measure[0], np.zeros(half)))[None],
            )
        )
        wanted = np.concatenate(
            (
                (by_activation @ activation - missing) * scale,
                np.zeros(half),
                -holding @ away,
                np.zeros(directions),
                -level @ at[1:],
                [_LEAD_PER_M * (aim.lead_m - at[0])],
            )
        )
        # Followed untyped, SciPy's function has the name of its module.
        found = lsq_linear(rows, wanted, (lower, np.ones(directions + half)), method="bvls", tol=1e-14).x  # type: ignore[operator]
        change, gain = found[:directions], found[directions:] - activation
        share = min(1.0, _LARGEST_M / _largest(by_measure[1:] @ change), _LARGEST_RAD / _largest(change))
        posture = body.moved(posture, share * along @ change)
        activation = activation + share * gain
        if share == 1.0 and _largest(change) < 1e-9:
            break
    return posture, both @ activation


def _largest(values: Array) -> float:
    return max(float(np.max(np.abs(values))), 1e-300)


def _polished(body: Body, aim: Aim, posture: Array, activation: Array) -> tuple[Array, Array]:
    """Newton steps of least norm (activations, and posture in 1 mrad or mm) until rounding is all that is missing."""
    every, unit = np.eye(body.model.nv), 1e-3
    free = activation > aim.tone + 1e-3
    for _ in range(12):
        now: Demand = demand(body, posture)
        missing = now.residual(activation)
        if _largest(missing) < 1e-9:
            break
        by_posture, _ = residual_by_posture(body, posture, activation, every)
        by_activation = -(now.arms * now.active_n)[:, free]
        step = -np.linalg.lstsq(np.hstack((unit * by_posture, by_activation)), missing, rcond=1e-10)[0]
        posture = body.moved(posture, unit * step[: body.model.nv])
        activation = activation.copy()
        activation[free] += step[body.model.nv :]
    return posture, activation
