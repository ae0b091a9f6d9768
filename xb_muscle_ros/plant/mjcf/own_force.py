"""Isometric force of MuJoCo's own muscle by length, from MuJoCo's own functions."""

from __future__ import annotations

from typing import Any

import numpy as np

from xb_muscle_ros.plant.plant import Array

# An operating range that makes MuJoCo's length argument the fibre's length in L0, and force 1 F0.
_UNIT_RANGE = np.array([0.0, 1.0])


class OwnForce:
    """Active and passive force of one muscle by fibre length.

    Source:
        MuJoCo's documentation, "Muscle actuators": `mju_muscleGain` and `mju_muscleBias`.
    """

    def __init__(self, mj: Any, fl_min: float, fl_max: float, fp_max: float) -> None:
        self._mj = mj
        # range, force, scale, lmin, lmax, vmax, fpmax, fvmax
        self._prm = np.array([0.0, 1.0, 1.0, 1.0, fl_min, fl_max, 1.0, fp_max, 1.0])

    def active(self, length_l0: Array) -> Array:
        """Share of the active force at lengths in L0."""
        return np.array([-self._mj.mju_muscleGain(x, 0.0, _UNIT_RANGE, 1.0, self._prm) for x in length_l0.tolist()])

    def passive_f0(self, length_l0: Array) -> Array:
        """Passive force at lengths in L0."""
        return np.array([-self._mj.mju_muscleBias(x, _UNIT_RANGE, 1.0, self._prm) for x in length_l0.tolist()])
