"""A stepping mode with one fibre, spoken to in single numbers; what is refused or fails is raised."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from xb_muscle_ros.models.batch import MuscleBatch
from xb_muscle_ros.models.muscle import Muscle, Outputs
from xb_muscle_ros.node.rules import Scale


def batch_of(muscle: Muscle) -> MuscleBatch:
    """A batch of one that steps this very muscle."""
    batch = MuscleBatch([muscle.fibre])
    batch.muscles = (muscle,)
    return batch


def emitting(take: Callable[[int, Outputs, Scale], None]) -> Any:
    """What to give a mode for its answers: hands on stamp, outputs and scale of the one fibre."""

    def emit(stamp: int, which: Any, outputs: Any, scales: Any) -> None:
        assert which is None
        take(stamp, Outputs(*outputs[0].tolist()), Scale(*scales[0].tolist()))

    return emit


class Alone:
    """Hands single numbers on as arrays of one; everything else is the mode's own.

    Attributes:
        mode: what is spoken to.
    """

    def __init__(self, mode: Any) -> None:
        self.mode = mode

    def __getattr__(self, name: str) -> Any:
        """Whatever the mode has."""
        return getattr(self.mode, name)

    def take_calcium(self, stamp: int, calcium_um: float) -> None:
        """Calcium, µM."""
        self._raise(self.mode.take_calcium(stamp, np.array([0]), np.array([calcium_um])))

    def take_length(self, stamp: int, position_m: float, velocity_m_per_s: float | None) -> None:
        """Length and velocity, m and m/s."""
        velocity = None if velocity_m_per_s is None else np.array([velocity_m_per_s])
        self._raise(self.mode.take_length(stamp, np.array([0]), np.array([position_m]), velocity))

    def save(self) -> Any:
        """The one snapshot."""
        (snapshot,) = self.mode.save()
        return snapshot

    def load(self, snapshot: Any) -> None:
        """Go on with it."""
        self.mode.load([snapshot])

    @staticmethod
    def _raise(troubles: list[Any]) -> None:
        if troubles:
            (trouble,) = troubles
            assert trouble.fibre == 0
            raise trouble.error
