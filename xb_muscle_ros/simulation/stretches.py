"""From state to state through single stretches, for trials of the paper's protocol that begin alike."""

from __future__ import annotations

import numpy as np

from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.scores.stiffness import WINDOW_S
from xb_muscle_ros.trials.protocol import SPEED_L0_PER_S
from xb_muscle_ros.trials.trial import Array

# Samples that a stretch's SRS is fitted to: 1 kHz, the ten after onset.
_SAMPLE_S = np.arange(1, 11) * (WINDOW_S / 10.0)


def followed(muscle: Muscle, state: Array, time_s: Array, length_l0: Array, calcium: float) -> Array:
    """States at times from now, straight from one length to the next; every time is a corner, where steps land."""
    corner_s = np.concatenate([[0.0], time_s])
    lengths = np.concatenate([state[-3:-2], length_l0])
    return muscle.follow(state, corner_s, lengths, np.full(corner_s.size, calcium), time_s)


def waited(muscle: Muscle, state: Array, duration_s: float, calcium: float) -> Array:
    """State after holding the length."""
    after: Array = followed(muscle, state, np.array([duration_s]), state[-3:-2], calcium)[-1]
    return after


def stretched_and_back(muscle: Muscle, state: Array, amplitude_l0: float, calcium: float) -> Array:
    """State after a stretch of an amplitude (L0) and the way back, at the paper's speed."""
    ramp = amplitude_l0 / SPEED_L0_PER_S
    after: Array = followed(muscle, state, np.array([ramp, 2.0 * ramp]), np.array([amplitude_l0, 0.0]), calcium)[-1]
    return after


def onset_stiffness(muscle: Muscle, state: Array, calcium: float) -> float:
    """SRS of a stretch that begins at this state, F0/L0."""
    lengths = state[-3] + SPEED_L0_PER_S * _SAMPLE_S
    force = muscle.outputs_of(followed(muscle, state, _SAMPLE_S, lengths, calcium))["force_f0"]
    return float(np.polyfit(lengths, force, 1)[0])
