"""One episode: stand, sway or not, be pushed or not, and stand or fall."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.plant.drives import beyond
from xb_muscle_ros.plant.leg.body import Body
from xb_muscle_ros.plant.leg.drives import Drive
from xb_muscle_ros.plant.leg.stance import Stance
from xb_muscle_ros.plant.leg.sway import Sway, foremost_rad, lead
from xb_muscle_ros.plant.plant import Array
from xb_muscle_ros.plant.translation import RampAndHold

JOINTS = ("ankle_angle", "knee_angle", "hip_flexion")
LOW = 0.9
"""Share of its height at the start below which the centre of mass has fallen."""


@dataclass(frozen=True)
class End:
    """Why an episode was over before its time.

    Attributes:
        time_s: last tick.
        reason: in words.
        fell: the body fell; else the muscles could not go on.
    """

    time_s: float
    reason: str
    fell: bool


@dataclass(frozen=True, eq=False)
class Episode:
    """What one model made of one condition, a row per tick; arrays are read-only.

    Attributes:
        model: name of a parameter set, or ``mujoco``.
        platform: how the ground moves; None: it rests.
        sway: before it.
        driven_by: see `Drive`.
        muscles: names, in the order of the columns of `force_n`.
        time_s: shape (n,), from the platform's first motion.
        com_m: shape (n,), way of the centre of mass over the platform, forward, from its start.
        height_m: shape (n,), of the centre of mass above the ankles' height at the start.
        angle_rad: shape (n, joint), mean of both sides, of `JOINTS`; dorsiflexion and flexion positive.
        torque_nm: shape (n, joint), of all muscles, sum of both sides, positive where it resists the angle.
        force_n: shape (n, muscle), pull on the tendons.
        soleus_m: shape (n,), path of the right soleus.
        start_acceleration: largest of all degrees of freedom at the first tick, rad/s² and m/s².
        load_nm_per_rad: m·g·h, see `Body.load_nm_per_rad`.
        end: why it was over early; None: it was not.
        beyond: which muscle was first beyond the lengths that a fibre has, and when; empty: none was.
    """

    model: str
    platform: RampAndHold | None
    sway: Sway
    driven_by: dict[str, dict[str, float]]
    muscles: tuple[str, ...]
    time_s: Array
    com_m: Array
    height_m: Array
    angle_rad: Array
    torque_nm: Array
    force_n: Array
    soleus_m: Array
    start_acceleration: float
    load_nm_per_rad: float
    end: End | None
    beyond: str = ""


def play(
    body: Body, drive: Drive, stance: Stance, platform: RampAndHold | None, sway: Sway, duration_s: float
) -> Episode:
    """Play an episode; the same arguments give the same bits.

    Args:
        body: its state is lost.
        drive: of the body, for the stance.
        stance: where it starts.
        platform: how the ground moves; None: it rests.
        sway: before it.
        duration_s: from the platform's first motion, or until the body falls.

    Raises:
        UserError: the ankle does not sway so far.
    """
    mj, model, data = body.mj, body.model, body.data
    angle = foremost_rad(body, stance, sway.fibre_l0) if sway.fibre_l0 else 0.0
    mj.mj_resetData(model, data)
    body.frame_accelerates(0.0)
    body.place(stance.qpos)
    drive.reset()
    lead(body, drive, stance, sway, angle)
    load, ankle, feet = body.load_nm_per_rad, body.ankle_m, feet_of(body)
    first = body.com_m
    soleus = body.muscles.index("soleus_r")
    rows: list[Array] = []
    acceleration, end, outside = 0.0, None, ""
    for k in range(round(duration_s / body.tick_s) + 1):
        at = k * body.tick_s
        body.frame_accelerates(0.0 if platform is None else platform.mean_acceleration(at, body.tick_s))
        mj.mj_step1(model, data)
        com = body.com_m
        seen = (at, (com - first) @ body.FORWARD, com[2] - ankle[2], *map(body.angle_rad, JOINTS))
        length = data.actuator_length[soleus]
        if not outside and (said := beyond(body.muscles, body.length_change_l0())):
            outside = f"{said}, from t = {at:.3f} s on"
        try:
            drive.advance()
        except UserError as error:
            end = End(at, str(error), fell=False)
            break
        mj.mj_step2(model, data)
        if k == 0:
            acceleration = float(np.max(np.abs(data.qacc)))
        torque = -np.array([body.muscle_torque_nm(joint) for joint in JOINTS])
        rows.append(np.concatenate((seen, torque, [length], -data.actuator_force)))
        if why := fallen(com, first[2] - ankle[2], ankle, feet, body):
            end = End(at, why, fell=True)
            break
    table = np.array(rows)
    table.setflags(write=False)
    joints = len(JOINTS)
    return Episode(
        model=drive.model,
        platform=platform,
        sway=sway,
        driven_by=drive.driven_by,
        muscles=body.muscles,
        time_s=table[:, 0],
        com_m=table[:, 1],
        height_m=table[:, 2],
        angle_rad=table[:, 3 : 3 + joints],
        torque_nm=table[:, 3 + joints : 3 + 2 * joints],
        soleus_m=table[:, 3 + 2 * joints],
        force_n=table[:, 4 + 2 * joints :],
        start_acceleration=acceleration,
        load_nm_per_rad=load,
        end=end,
        beyond=outside,
    )


def feet_of(body: Body) -> tuple[float, float]:
    """Rearmost and foremost of the sole's points, forward, m."""
    along = body.sole_points() @ body.FORWARD
    return float(along.min()), float(along.max())


def fallen(com: Array, height_m: float, ankle: Array, feet: tuple[float, float], body: Body) -> str:
    """How the body has fallen; empty: it has not."""
    along = float(com @ body.FORWARD)
    if along > feet[1]:
        return "the centre of mass is before the toes"
    if along < feet[0]:
        return "the centre of mass is behind the heels"
    if com[2] - ankle[2] < LOW * height_m:
        return f"the centre of mass is below {LOW:g} of its height"
    return ""
