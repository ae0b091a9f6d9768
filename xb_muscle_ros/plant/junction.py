"""Fibres on elastic tendons where a fibre answers one length with one force, as a muscle node does."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from xb_muscle_ros.plant.plant import Architecture, Array
from xb_muscle_ros.plant.tendon import tendon_at

# Stiffness of a fibre over its force, 1/L0: what cross-bridges have (35 to 40), and half as much again. A guess that is
# too high makes differences die away more slowly, one that is too low lets them grow.
_STIFFNESS_PER_FORCE, _LEAST_FORCE_F0 = 60.0, 0.05
_MARGIN, _FORGETTING, _STIFFEST_F0_PER_L0 = 1.3, 0.95, 1e5
_ITERATIONS = 6


class Junction:
    """Moves each fibre to where its tendon is expected to pull as it does.

    A trial step that is thrown away, with which `FibreDrive` finds the balance within a tick, cannot be asked of a
    node. So the fibre's next force is foretold: it goes on changing as in the last tick, and by a stiffness times what
    its movement differs from the last tick's. The stiffness is learnt from the forces on the way. What is left of the
    difference after the fibre's answer, less than 1 % of the force in the scenes here, the next tick makes good.

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
        none = np.zeros_like(path_l0)
        self._force, self._force_change = force_f0, none
        self._move, self._last_move = none, none
        self._stiffness = none

    def pull_f0(self, path_l0: Array) -> Array:
        """Pull of the tendons, as force along the fibres, shape (muscle,), F0."""
        return self._pull(path_l0 - self.length_l0)

    def advance(self, path_l0: Array, force_f0: Array, dt_s: float) -> None:
        """Move the fibres for a tick.

        Args:
            path_l0: length changes on rigid tendons at the end of the tick, shape (muscle,), L0.
            force_f0: of the fibres at its beginning, shape (muscle,), F0.
            dt_s: length of the tick, s.
        """
        change = force_f0 - self._force
        self._learn(force_f0, change)
        self._force, self._force_change = force_f0, change
        move = self._move
        for _ in range(_ITERATIONS):
            stretch = path_l0 - self.length_l0 - move
            pull = self._pull(stretch)
            excess = force_f0 + change + self._stiffness * (move - self._move) - pull
            move = move - excess / (self._stiffness + self._tendon_stiffness(stretch))
        self._last_move, self._move = self._move, move
        self.velocity_l0_per_s = move / dt_s
        self.length_l0 = self.length_l0 + move

    def _learn(self, force_f0: Array, change: Array) -> None:
        """Bring the stiffness up to date: never below what was seen of late, and forgotten slowly."""
        more = self._move - self._last_move
        seen = np.divide(change - self._force_change, more, out=np.zeros_like(more), where=np.abs(more) > 1e-9)
        least = _STIFFNESS_PER_FORCE * np.maximum(force_f0, _LEAST_FORCE_F0)
        kept = np.maximum(_MARGIN * seen, _FORGETTING * self._stiffness)
        self._stiffness = np.clip(kept, least, _STIFFEST_F0_PER_L0)

    def _pull(self, stretch_l0: Array) -> Array:
        stretch_m = stretch_l0 * self._l0_m / self._cos
        along = [tendon.force_f0(float(m)) for tendon, m in zip(self._tendons, stretch_m, strict=True)]
        pull: Array = np.array(along) / self._cos
        return pull

    def _tendon_stiffness(self, stretch_l0: Array) -> Array:
        """Slope of `_pull`, F0/L0."""
        stretch_m = stretch_l0 * self._l0_m / self._cos
        slopes = [tendon.stiffness_f0_per_m(float(m)) for tendon, m in zip(self._tendons, stretch_m, strict=True)]
        slope: Array = np.array(slopes) * self._l0_m / self._cos**2
        return slope
