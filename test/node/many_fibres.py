"""Three fibres of one node, what they answer, and one that fails."""

from __future__ import annotations

from typing import Any

import numpy as np

from xb_muscle_ros.errors import StateViolation
from xb_muscle_ros.models.batch import MuscleBatch
from xb_muscle_ros.models.muscle import Muscle

NAMES = ("left", "right", "back")


class Answers:
    """What was emitted, by fibre and stamp."""

    def __init__(self, count: int = 3) -> None:
        self.count = count
        self.messages: list[tuple[int, list[int]]] = []
        self.rows: dict[int, list[tuple[int, tuple[float, ...], tuple[float, ...]]]] = {i: [] for i in range(count)}

    def emit(self, stamp: int, which: Any, outputs: Any, scales: Any) -> None:
        """Take a message to pieces."""
        fibres = list(range(self.count)) if which is None else which.tolist()
        self.messages.append((stamp, fibres))
        for i, row, scale in zip(fibres, outputs.tolist(), scales.tolist(), strict=True):
            self.rows[i].append((stamp, tuple(row), tuple(scale)))


def fibres(*indices: int) -> Any:
    """As the inlet hands them over."""
    return np.array(indices, dtype=np.intp)


def fragile(batch: MuscleBatch, index: int) -> MuscleBatch:
    """The batch with one fibre that cannot be stretched beyond 0.1 L0, alone or with others."""

    class Fragile(Muscle):
        def step(self, state: Any, length_change_l0: float, calcium_um: float, dt_s: float) -> Any:
            if length_change_l0 > 0.1:
                raise StateViolation(self.fibre.name, "q2", 1e-4, -1.0, "0 to 1", "take a smaller step")
            return super().step(state, length_change_l0, calcium_um, dt_s)

    made = MuscleBatch([m.fibre for m in batch.muscles])
    weak = Fragile(batch.muscles[index].fibre)
    made.muscles = (*made.muscles[:index], weak, *made.muscles[index + 1 :])
    together = made.step

    def step(states: Any, change: Any, calcium: Any, dt_s: float) -> Any:
        weak.step(states[index], float(change[index]), float(calcium[index]), dt_s)
        return together(states, change, calcium, dt_s)

    made.step = step
    return made
