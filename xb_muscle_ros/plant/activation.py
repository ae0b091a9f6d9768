"""From excitation to calcium: the activation stage, and the calcium that sustains an activation."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.plant.mjcf.kernels import next_activation
from xb_muscle_ros.plant.plant import Array

RISE_S, FALL_S = 0.01, 0.04
"""Time constants of MuJoCo's muscle."""
_RELAXED_PCA, _FULL_PCA, _POINTS = 9.0, 4.0, 201


class CalciumTable:
    """Isometric force of one fibre by calcium, at one length; read both ways."""

    def __init__(self, muscle: Muscle, length_l0: float) -> None:
        """Settle the fibre at pCa 9 to 4.

        Args:
            muscle: of any model.
            length_l0: length change.
        """
        pca = np.linspace(_RELAXED_PCA, _FULL_PCA, _POINTS)
        self._log_um = 6.0 - pca
        force = np.array([muscle.outputs(muscle.settle(length_l0, 10.0**x)).force_f0 for x in self._log_um])
        # What the fibre bears passively is no activation; a fibre that settles to rounding may seem to lose force.
        self._active: Array = np.maximum.accumulate(force - force[0])

    def activation(self, calcium_um: float) -> float:
        """Isometric force beyond the passive, F0, at a calcium, µM."""
        return float(np.interp(np.log10(calcium_um), self._log_um, self._active))

    def calcium_um(self, activation: float) -> float:
        """The other way; pCa 4 where the fibre has no such force."""
        return float(10.0 ** np.interp(activation, self._active, self._log_um))


class ReflexActivation:
    """Activation of muscles that a reflex excites on top of what holds the start."""

    def __init__(self, activation: Array, tick_s: float) -> None:
        """In equilibrium.

        Args:
            activation: at the start, 0 to 1, shape (muscle,).
            tick_s: time between calls.
        """
        self._start = activation
        self._now = activation
        self._tick_s = tick_s
        # Both time constants, a switch between them, and the ranges of excitation and activation.
        row = [RISE_S, FALL_S, 0.0, 0.0, 1.0, 0.0, math.inf]
        self._rows: Array = np.tile(row, (activation.size, 1))

    def __call__(self, added: Array) -> Array:
        """Activation of the next tick, shape (muscle,); that of the start, to the bit, where nothing was added yet.

        Args:
            added: excitation on top of that of the start, 0 or above, shape (muscle,); together at most 1.
        """
        after = np.empty_like(self._now)
        next_activation(self._now, self._start + added, self._tick_s, self._rows, after)
        self._now = after
        return after


def reflex_calcium(
    activation: Array, calcium_um: Array, calcium_of: Callable[[Array], Array], tick_s: float
) -> Callable[[Array], Array]:
    """`ReflexActivation` as calcium (µM).

    Args:
        activation, calcium_um: at the start, shape (muscle,).
        calcium_of: calcium that sustains activations, shape (muscle,) both.
        tick_s: time between calls.
    """
    stage = ReflexActivation(activation, tick_s)

    def level(added: Array) -> Array:
        now = stage(added)
        changed = now != activation
        # A table read backwards would give the start but for rounding.
        return np.where(changed, calcium_of(now), calcium_um) if changed.any() else calcium_um

    return level
