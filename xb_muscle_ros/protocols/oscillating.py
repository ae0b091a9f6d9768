"""Trials of small sinusoidal length changes, and where in a trial length oscillates at which frequency."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from xb_muscle_ros.protocols.base import Planned, Run
from xb_muscle_ros.protocols.inputs import calcium_um, facts_of, sample_times
from xb_muscle_ros.scores.cycles import oscillations
from xb_muscle_ros.scores.standard_error import ForceNoise, noise_outside
from xb_muscle_ros.trials.trial import Array, Phase, Trial

NAME = "sinusoid"
OSCILLATION = "oscillation"
# Isometric time before, and at least so long are onset and what is read, s.
_LEAD_S, _ONSET_S, _READ_S = 0.1, 0.6, 0.2
# Isometric samples that tell noise.
_QUIET = 40
# Samples per second at least.
_SLOWEST_RATE_HZ = 100.0
# A model's length is straight between corners, so many of them to a sample: the harmonics that corners add to a
# sinusoid fall on its own frequency in force that is sampled, and corners of the samples alone would count by 0.2 %.
_CORNERS = 4
# A recorded length is the one that was asked for if it is within this share of its amplitude.
_SAME = 1e-4


def oscillating(
    fibre: str, pca: float, frequency_hz: float, amplitude_l0: float, cycles: float, samples_per_cycle: float
) -> Planned:
    """A trial at one frequency: isometric, onset, and whole cycles that are read.

    Raises:
        UserError: there would be too many samples.
    """
    onset, read = (
        np.ceil(max(least_s * frequency_hz, least) - 1e-9) / frequency_hz
        for least_s, least in ((_ONSET_S, 1.0), (_READ_S, cycles))
    )
    rate = max(samples_per_cycle * frequency_hz, _SLOWEST_RATE_HZ)
    edges = np.cumsum([0.0, max(_LEAD_S, _QUIET / rate), onset, read]).tolist()
    time_s = sample_times(edges[-1], rate, f"protocol {NAME}, {frequency_hz:g} Hz")
    told = {"pca": pca, "frequency_hz": frequency_hz, "amplitude_l0": amplitude_l0}
    facts = facts_of(NAME, fibre, f"sinusoid_pca{10.0 * pca:g}_{frequency_hz:g}hz", told)
    names = ("isometric", "onset", OSCILLATION)
    phases = tuple(Phase(name, *edges[k : k + 2]) for k, name in enumerate(names))
    trial = Trial(
        facts=replace(facts, pca=pca, phases=phases),
        time_s=time_s,
        length_m=1.0 + _length(time_s, amplitude_l0, frequency_hz, edges[1]),
        calcium_time_s=np.zeros(1),
        calcium_um=np.array([calcium_um(pca)]),
    )
    return with_corners(trial)


def _length(time_s: Array, amplitude_l0: float, frequency_hz: float, begin_s: float) -> Array:
    """A sinusoid about no change of length that begins by lengthening, L0, shape (n,)."""
    length: Array = amplitude_l0 * np.sin(2.0 * np.pi * frequency_hz * np.maximum(time_s - begin_s, 0.0))
    return length


def with_corners(trial: Trial) -> Planned:
    """Corners of a length that its settings tell, finer than samples; else the samples."""
    frequency, amplitude = trial.facts.setting("frequency_hz"), trial.facts.setting("amplitude_l0")
    onset = trial.phases_by_name().get("onset")
    if trial.facts.protocol == NAME and frequency is not None and amplitude is not None and onset is not None:
        told = (amplitude, frequency, onset.start_s)
        if np.abs(_length(trial.time_s, *told) - trial.length_change_l0).max() < _SAME * amplitude:
            places = np.arange(_CORNERS * (trial.time_s.size - 1) + 1) / _CORNERS
            corner_s = np.interp(places, np.arange(trial.time_s.size), trial.time_s)
            return Planned(trial, corner_s, _length(corner_s, *told))
    return Planned(trial, trial.time_s, trial.length_change_l0)


class Windows(NamedTuple):
    """What is read of a trial.

    Attributes:
        each: frequency (Hz), begin and end (s).
        told: what is said about it, one line each.
        noise: of a measured force while length is still.
    """

    each: list[tuple[float, float, float]]
    told: list[str]
    noise: ForceNoise | None


def windows_of(run: Run) -> Windows:
    """Where a trial tells that its length oscillates, or where that is seen."""
    trial = run.trial
    frequency, phase = run.setting("frequency_hz"), trial.phases_by_name().get(OSCILLATION)
    if trial.facts.protocol == NAME and frequency is not None and phase is not None:
        return Windows([(frequency, phase.start_s, phase.end_s)], [], run.noise)
    seen = oscillations(trial.time_s, trial.length_change_l0)
    if not seen:
        return Windows([], ["length does not oscillate for two cycles or more"], None)
    windows, told = [], []
    for one in seen:
        skipped = 1 if one.cycles > 2 else 0
        begin_s, end_s = float(one.start_s[skipped]), float(one.start_s[-1])
        windows.append((one.frequency_hz, begin_s, end_s))
        told.append(f"{one.frequency_hz:.4g} Hz from {begin_s:.4g} to {end_s:.4g} s")
    onset = "the first cycle of each is left out" if all(one.cycles > 2 for one in seen) else (
        "the first cycle is left out where there are three or more"
    )  # fmt: skip
    # Small oscillations pass for isometric where phases are sought.
    moving = [(float(one.start_s[0]), float(one.start_s[-1])) for one in seen]
    noise = None if run.simulated is not None else noise_outside(trial, moving)
    return Windows(windows, [f"found from length: {'; '.join(told)}; {onset}"], noise)
