"""Sway before the push: the body is led to and fro about its ankles, and its muscles remember."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.plant.leg.body import Body
from xb_muscle_ros.plant.leg.drives import Drive
from xb_muscle_ros.plant.leg.stance import Stance

SWAY_S = 4.0
"""How long the body sways: a whole number of cycles at the frequencies that are allowed."""
_SOLEUS = "soleus_r"
_FURTHEST_RAD = 0.3


@dataclass(frozen=True)
class Sway:
    """Forward from the stance and back, whole cycles of a raised cosine: velocity is 0 at both ends.

    Attributes:
        fibre_l0: change of soleus length from the stance to the foremost posture, in L0; 0: no sway.
        frequency_hz: a multiple of 0.25.
    """

    fibre_l0: float = 0.0
    frequency_hz: float = 1.0

    def __post_init__(self) -> None:
        """Refuse sway that does not end where it began, or that is none.

        Raises:
            UserError: a number out of range.
        """
        if not 0.0 <= self.fibre_l0 <= 0.1:
            raise UserError(f"sway is {100.0 * self.fibre_l0:g} % of soleus fibre length; allowed is 0 to 10")
        cycles = self.frequency_hz * SWAY_S
        if not (0.25 <= self.frequency_hz <= 5.0 and cycles == round(cycles)):
            raise UserError(f"sway frequency is {self.frequency_hz:g} Hz; allowed are multiples of 0.25 up to 5")

    @property
    def label(self) -> str:
        """In words."""
        return f"sway {100.0 * self.fibre_l0:g} % at {self.frequency_hz:g} Hz" if self.fibre_l0 else "no sway"

    def angle(self, time_s: float) -> tuple[float, float]:
        """Share of the foremost angle, and its rate (1/s), at a time since the sway began."""
        turn = 2.0 * math.pi * self.frequency_hz
        return 0.5 * (1.0 - math.cos(turn * time_s)), 0.5 * turn * math.sin(turn * time_s)


def foremost_rad(body: Body, stance: Stance, fibre_l0: float) -> float:
    """Dorsiflexion from the stance that lengthens soleus (fibre and tendon) by a share of its fibres' optimal length.

    Raises:
        UserError: the ankle does not go so far.
    """
    at = body.muscles.index(_SOLEUS)
    wanted_m = fibre_l0 * float(body.l0_m[at])

    def length_m(angle_rad: float) -> float:
        qpos = stance.qpos.copy()
        qpos[body.coordinates("ankle_angle")] += angle_rad
        body.place(qpos)
        return float(body.data.actuator_length[at])

    start = length_m(0.0)
    if length_m(_FURTHEST_RAD) - start < wanted_m:
        raise UserError(f"the ankle does not reach a soleus change of {100.0 * fibre_l0:g} %; take a smaller --sway")
    found = brentq(lambda angle: length_m(angle) - start - wanted_m, 0.0, _FURTHEST_RAD, xtol=1e-14)
    return float(found)


def lead(body: Body, drive: Drive, stance: Stance, sway: Sway, angle_rad: float) -> None:
    """Sway once through, from settled muscles at the stance; the last tick before the stance is done at the end.

    The body is an inverted pendulum: ankles turn, all other joints are held. Lengths of muscles depend on joint angles
    alone, so that the floor has no part in it.

    Args:
        body, drive, stance: with muscles settled.
        sway: how.
        angle_rad: see `foremost_rad`.
    """
    if not sway.fibre_l0:
        return
    data, mj = body.data, body.mj
    coordinates, dofs = body.coordinates("ankle_angle"), body.dofs("ankle_angle")
    for k in range(round(SWAY_S / body.tick_s)):
        share, rate = sway.angle(k * body.tick_s)
        data.qpos[:] = stance.qpos
        data.qpos[coordinates] += share * angle_rad
        data.qvel[:] = 0.0
        data.qvel[dofs] = rate * angle_rad
        mj.mj_fwdPosition(body.model, data)
        mj.mj_fwdVelocity(body.model, data)
        drive.advance()
    data.qpos[:] = stance.qpos
    data.qvel[:] = 0.0


def com_way_m(body: Body, stance: Stance, angle_rad: float) -> float:
    """Way of the centre of mass from the stance to the foremost posture, m."""
    body.place(stance.qpos)
    return float(np.linalg.norm((body.com_m - body.ankle_m)[1:]) * math.sin(angle_rad))
