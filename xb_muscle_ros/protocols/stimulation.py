"""Isometric trials of a stimulated fibre, and when a trial was stimulated."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.protocols.base import Planned, Run
from xb_muscle_ros.protocols.calcium import PulseTransient
from xb_muscle_ros.protocols.inputs import sample_times
from xb_muscle_ros.trials.trial import Phase, Trial, TrialFacts

# Calcium, or without it force, that passes this share of its rise tells when stimulation began.
_BEGUN = 0.02
# Noise does not rise above so many of its standard deviations.
_SPREADS = 3.0


def stimulated(
    facts: TrialFacts, transient: PulseTransient, pulses_s: Sequence[float], duration_s: float, rate_hz: float
) -> Planned:
    """An isometric trial with calcium that pulses make.

    Calcium holds from sample to sample, so its samples are the middles of the transient's between two of them.

    Args:
        facts: of the trial; phases are set here.
        pulses_s: times of the pulses, s.

    Raises:
        UserError: there would be too many samples, or so few that they miss the rise of calcium.
    """
    if rate_hz * transient.rise_s < 1.0 - 1e-9:
        raise UserError(
            f"--rate is {rate_hz:g} samples per second, but calcium rises with a time constant of "
            f"{1e3 * transient.rise_s:g} ms; needed are {1.0 / transient.rise_s:.0f} or more (one for each)"
        )
    time_s = sample_times(duration_s, rate_hz, f"protocol {facts.protocol}")
    phases = (Phase("isometric", 0.0, float(time_s[-1])),)
    trial = Trial(
        facts=TrialFacts(facts.fibre, facts.trial, phases=phases, protocol=facts.protocol, settings=facts.settings),
        time_s=time_s,
        length_m=np.ones(time_s.size),
        calcium_time_s=time_s,
        calcium_um=transient.at(time_s + 0.5 / rate_hz, pulses_s),
    )
    return Planned(trial)


def begun_s(run: Run) -> tuple[float, str]:
    """When stimulation began, s, and what tells it."""
    told = run.setting("first_pulse_s")
    if told is not None:
        return told, ""
    calcium = run.trial.calcium_um
    if np.ptp(calcium) > 0.05 * np.max(calcium):
        over = np.flatnonzero(calcium > calcium[0] + _BEGUN * (np.max(calcium) - calcium[0]))
        if over.size:
            return float(run.trial.calcium_time_s[over[0]]), "stimulation is taken to begin where calcium rises"
    # What comes before the last sample that is as low as rest is no rise, whatever noise does.
    top = int(np.argmax(run.force_f0))
    rest = float(np.median(run.force_f0[: max(top // 4, 1)]))
    spread = 1.4826 * float(np.median(np.abs(run.force_f0[: max(top // 4, 1)] - rest)))
    least = max(_BEGUN * (float(run.force_f0[top]) - rest), _SPREADS * spread)
    low = np.flatnonzero(run.force_f0[:top] - rest <= least)
    begin = int(low[-1]) + 1 if low.size else 0
    share = 100.0 * least / max(float(run.force_f0[top]) - rest, 1e-12)
    return float(run.time_s[begin]), f"stimulation is taken to begin where force rises by {share:.2g} % of its peak"
