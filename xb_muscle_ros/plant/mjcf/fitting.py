"""Force-length parameters with which a fibre on a spring is isometrically as strong as MuJoCo's muscle on none."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.optimize import least_squares

from xb_muscle_ros.models.parameters import PARAMETERS
from xb_muscle_ros.plant.mjcf.own_force import OwnForce
from xb_muscle_ros.plant.mjcf.relations import Relations
from xb_muscle_ros.plant.mjcf.spring import Spring
from xb_muscle_ros.plant.plant import Array

NAMES = ("fl_min", "fl_max", "fl_optimum", "fp_max", "fp_onset")
_LOWER, _UPPER = (np.array([getattr(PARAMETERS[name], bound) for name in NAMES]) for bound in ("lower", "upper"))
# Force below which the fit minds the absolute difference, F0, and number of lengths.
_FLOOR_F0, _LENGTHS = 0.1, 61
# Of full and of no activation: what pulls hard moves joints.
_WEIGHTS = np.array([[1.0], [0.3]])


def fitted(mj: Any, own: tuple[float, float, float], range_l0: tuple[float, float], spring: Spring) -> Array:
    """Values of `NAMES` by least squares at full and at no activation, relative above a tenth of F0.

    MuJoCo's curve is the force at a length of the whole muscle; here it is that of the half-sarcomeres, which a spring
    leaves shorter the harder they pull. Without a spring the values are MuJoCo's own.

    Args:
        mj: MuJoCo.
        own: the muscle's ``lmin``, ``lmax`` and ``fpmax``.
        range_l0: lengths over which the curves have to agree, L0.
        spring: in series.
    """
    start = np.array([own[0], own[1], 0.0, own[2], 0.0])
    if spring.length_l0 == 0.0:
        return start
    muscle = OwnForce(mj, *own)
    stretch = spring.length_l0 * float(np.log1p(1.0 / spring.force_f0))
    change = np.linspace(range_l0[0] - 1.0 - stretch, range_l0[1] - 1.0, _LENGTHS)

    def differences(values: Array) -> Array:
        relations = Relations(*np.array([*values, *spring]))
        active, passive = relations.active(change), relations.passive_f0(change)
        # Where a length of the half-sarcomeres leads to is known without solving for it: force, then the spring.
        length = 1.0 + change + relations.extension_l0(np.stack((active + passive, passive)))
        force = muscle.passive_f0(length.ravel()).reshape(length.shape)
        force[0] += muscle.active(length[0])
        relative = (np.stack((active + passive, passive)) - force) / np.maximum(force, _FLOOR_F0)
        found: Array = (_WEIGHTS * relative).ravel()
        return found

    start += np.array([stretch, stretch, -stretch, 0.0, stretch])
    room = 1e-6 * (_UPPER - _LOWER)
    start = np.clip(start, _LOWER + room, _UPPER - room)
    found = least_squares(  # type: ignore[operator]  # SciPy has no types
        differences, start, bounds=(_LOWER, _UPPER), x_scale=(0.1, 0.1, 0.1, 1.0, 0.1)
    )
    best: Array = found.x
    return best
