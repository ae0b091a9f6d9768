"""What every muscle is given: the paper's conditions as corners of length, and the samples that SRS is read off."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from xb_muscle_ros.scores.conditions import Condition
from xb_muscle_ros.scores.stiffness import WINDOW_S
from xb_muscle_ros.trials.protocol import SPEED_L0_PER_S, StretchShortenStretch
from xb_muscle_ros.trials.trial import Array

LEAD_S = 0.05
"""Isometric time before the first stretch: trials begin in equilibrium."""
SAMPLES = 10


class Path(NamedTuple):
    """Length of one trial.

    Attributes:
        corner_s, corner_l0: s and length change in L0, straight between them.
        sample_s: where force is looked at, ascending, s.
    """

    corner_s: Array
    corner_l0: Array
    sample_s: Array

    def length_l0(self) -> Array:
        """Length change at the samples, L0."""
        length: Array = np.interp(self.sample_s, self.corner_s, self.corner_l0)
        return length


def path_of(condition: Condition) -> Path:
    """A condition up to 10 ms after the onset of the test stretch, sampled each millisecond of these."""
    protocol = StretchShortenStretch(
        condition.amplitude_l0,
        condition.recovery_s,
        lead_s=LEAD_S,
        hold_s=0.0,
        test_stretch_l0=SPEED_L0_PER_S * WINDOW_S,
    )
    corner_s, corner_l0 = protocol.corners()
    share = np.arange(1, SAMPLES + 1) / SAMPLES
    return Path(corner_s, corner_l0, corner_s[-2] + share * (corner_s[-1] - corner_s[-2]))


def onset_stiffness(path: Path, force_f0: Array) -> float:
    """SRS of the test stretch from the forces at a path's samples, F0/L0."""
    return float(np.polyfit(path.length_l0(), force_f0, 1)[0])
