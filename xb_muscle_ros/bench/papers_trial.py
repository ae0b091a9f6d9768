"""The trial that the paper times (van der Zee et al. 2026): AMP 3.83 % L0, RT 1 ms, pCa 6.1, 2.34 s."""

from __future__ import annotations

import numpy as np

from xb_muscle_ros.models.muscle import Array, Muscle
from xb_muscle_ros.trials.protocol import StretchShortenStretch

STEP_S = 1e-4
_DURATION_S, _LEAD_S = 2.34, 2.0
PCA = 6.1
# States are kept at 1 kHz.
_EVERY = 10


def corners() -> tuple[Array, Array]:
    """Times (s) and length changes (L0) of the trial's corners."""
    moving_s = float(StretchShortenStretch(0.0383, 0.001, lead_s=0.0, hold_s=0.0).corners()[0][-1])
    hold_s = _DURATION_S - _LEAD_S - moving_s
    return StretchShortenStretch(0.0383, 0.001, lead_s=_LEAD_S, hold_s=hold_s).corners()


def sample_s() -> Array:
    """Times at which force is looked at, s: 1 kHz, the last one at the last corner."""
    time_s = np.arange(round(_DURATION_S / STEP_S) + 1) * STEP_S
    # The variable stepper ends at the last corner.
    return np.minimum(time_s[::_EVERY], corners()[0][-1])


class PapersTrial:
    """The trial for one muscle, from rest; its states come with the number of steps tried.

    Attributes:
        steps: of the fixed stepper.
    """

    def __init__(self, muscle: Muscle) -> None:
        """Settle the muscle."""
        self._muscle = muscle
        self._corners = corners()
        time_s = np.arange(round(_DURATION_S / STEP_S) + 1) * STEP_S
        self.steps = time_s.size - 1
        self._dt_s, self._length_l0 = np.diff(time_s), np.interp(time_s, *self._corners)
        self._sample_s = sample_s()
        self._calcium_um = np.full(time_s.size, 10.0 ** (6.0 - PCA))
        self._start = muscle.settle(0.0, float(self._calcium_um[0]))

    def fixed(self, substeps: int = 1) -> tuple[Array, int]:
        """With steps of 1e-4 s, or so many in each."""
        steps = list[int]()
        states = self._muscle.run(
            self._start, self._dt_s, self._length_l0, self._calcium_um, substeps, every=_EVERY, counts=steps
        )
        return states, steps[0]

    def variable(self, tolerance: float) -> tuple[Array, int]:
        """With variable steps from corner to corner."""
        calcium_um = self._calcium_um[: self._corners[0].size]
        steps = list[int]()
        states = self._muscle.follow(self._start, *self._corners, calcium_um, self._sample_s, tolerance, counts=steps)
        return states, steps[0]

    def force_f0(self, found: tuple[Array, int]) -> Array:
        """Force of the states, F0."""
        return self._muscle.outputs_of(found[0])["force_f0"]
