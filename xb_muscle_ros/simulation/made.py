"""Recordings made by a model: a trial with the force that a fibre would have shown, and noise like the real."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.signal import lfilter

from xb_muscle_ros.measurement.recording import given_calcium, given_length, recorded_force
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.simulation.offline import simulate_trial
from xb_muscle_ros.trials.trial import Array, Trial

# Of a real recording at 1 kHz (rat soleus fibre 18Dec2017a): SD 0.03 to 0.14 % F0, lag-1 autocorrelation 0.91 to 0.98.
NOISE_SD_F0 = 1e-3
NOISE_AUTOCORRELATION = 0.95


def coloured_noise(
    random: np.random.Generator, n: int, sd: float = NOISE_SD_F0, autocorrelation: float = NOISE_AUTOCORRELATION
) -> Array:
    """First-order autoregressive noise.

    Args:
        sd: standard deviation, F0.
        autocorrelation: correlation of one sample with the next, 0 up to below 1.
    """
    innovations = random.normal(size=n) * sd * np.sqrt(1.0 - autocorrelation**2)
    innovations[0] = random.normal() * sd
    return lfilter([1.0], [1.0, -autocorrelation], innovations)


def made(
    muscle: Muscle,
    trial: Trial,
    random: np.random.Generator,
    noise_sd_f0: float = NOISE_SD_F0,
    substeps: int = 1,
    **faults: float,
) -> Trial:
    """A trial with measured force that a fibre and a faulty measurement made.

    Args:
        trial: what it is said to be given.
        noise_sd_f0: standard deviation of the noise, F0.
        substeps: steps of the fibre between two samples.
        faults: values by name of `measurement.artefacts.ARTEFACTS`.

    Raises:
        UserError, StateViolation: see `simulate_trial`.
    """
    length = 1.0 + given_length(trial.length_change_l0, faults)
    given = replace(
        trial,
        length_m=length * trial.facts.reference_length_m,
        calcium_um=given_calcium(trial.calcium_um, faults),
    )
    force = simulate_trial(muscle, given, substeps).force_n / trial.facts.f0_n
    recorded = recorded_force(trial.time_s, force, faults) + coloured_noise(random, force.size, noise_sd_f0)
    return replace(trial, force_time_s=trial.time_s, force_n=recorded * trial.facts.f0_n)
