"""From excitation to activation by the first-order dynamics of MuJoCo's muscle."""

from __future__ import annotations

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.plant.mjcf.actuators import MuscleActuators
from xb_muscle_ros.plant.mjcf.kernels import next_activation
from xb_muscle_ros.plant.plant import Array


class ActivationDynamics:
    """`mju_muscleDynamics` for many muscles in one call, with MuJoCo's own order of operations.

    Source:
        Millard et al. 2013 (doi 10.1115/1.4023390), as MuJoCo has it, its smooth transition included.
    """

    def __init__(self, muscles: MuscleActuators) -> None:
        columns = (
            muscles.activation_s,
            muscles.deactivation_s,
            muscles.smoothing,
            *muscles.excitation_range.T,
            *muscles.activation_range.T,
        )
        self._names = muscles.names
        self._rows: Array = np.ascontiguousarray(np.stack(columns, axis=1))

    def after(self, activation: Array, excitation: Array, dt_s: float) -> Array:
        """Activation one step later, shape (muscle,).

        Args:
            activation, excitation: shape (muscle,), the second clipped to its range, as MuJoCo does.
            dt_s: length of the step, s.

        Raises:
            UserError: an excitation that is not finite.
        """
        out = np.empty_like(activation)
        k = next_activation(activation, excitation, dt_s, self._rows, out)
        if k >= 0:
            raise UserError(f"excitation of {self._names[k]} is {excitation[k]}; allowed are finite numbers")
        return out
