"""Fibres on elastic tendons where a fibre answers one length with one force, as a muscle node does."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from xb_muscle_ros.plant.plant import Architecture, Array
from xb_muscle_ros.plant.tendon import tendon_at

# Fibre and tendon together are at most some 40 F0/L0 stiff: with ticks of 1 ms this much damping takes most of a
# difference away within two of them and never overshoots.
_DAMPING_F0_S_PER_L0 = 0.05
# Movement that goes on for longer than this needs no difference in force to drive it.
_MEMORY_S = 0.01


class Junction:
    """Moves each fibre's length by the difference between its tendon's force and its own.

    A trial step that is thrown away, with which `FibreDrive` finds the balance within a tick, cannot be asked of a
    node. So the difference drives the fibre's velocity, at once (a damper) and by what it was during the last 10 ms.

    Attributes:
        length_l0, velocity_l0_per_s: of the fibres, shape (muscle,), change from rest in L0.
    """

    def __init__(self, muscles: Sequence[Architecture], path_l0: Array, force_f0: Array) -> None:
        """Stand in balance.

        Args:
            muscles: of the plant.
            path_l0: length changes on rigid tendons at the start, shape (muscle,), L0.
            force_f0: of the fibres at the start, shape (muscle,), F0.
        """
        self._cos = np.array([math.cos(m.pennation_rad) for m in muscles])
        self._l0_m = np.array([m.l0_m for m in muscles])
        self._tendons = [
            tendon_at(float(force), m.tendon_slack_m) for m, force in zip(muscles, force_f0 * self._cos, strict=True)
        ]
        self.length_l0: Array = path_l0.copy()
        self.velocity_l0_per_s: Array = np.zeros_like(path_l0)
        self._steady: Array = np.zeros_like(path_l0)

    def pull_f0(self, path_l0: Array) -> Array:
        """Pull of the tendons, as force along the fibres, shape (muscle,), F0."""
        stretch_m = (path_l0 - self.length_l0) * self._l0_m / self._cos
        along = [tendon.force_f0(float(m)) for tendon, m in zip(self._tendons, stretch_m, strict=True)]
        pull: Array = np.array(along) / self._cos
        return pull

    def advance(self, path_l0: Array, force_f0: Array, dt_s: float) -> None:
        """Move the fibres for a tick of `dt_s` (s), towards balance at the path lengths of its end."""
        driven = (self.pull_f0(path_l0) - force_f0) * self._cos / _DAMPING_F0_S_PER_L0
        self._steady = self._steady + driven * dt_s / _MEMORY_S
        self.velocity_l0_per_s = driven + self._steady
        self.length_l0 = self.length_l0 + dt_s * self.velocity_l0_per_s
