"""What several protocols are made of: lengths between corners, samples of them, and options that all have."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.protocols.base import Option, Planned, Settings
from xb_muscle_ros.trials.protocol import ALLOWED
from xb_muscle_ros.trials.trial import Array, Phase, Trial, TrialFacts

MOST_SAMPLES = 20_000_000


def pca_option(*default: float) -> Option:
    """The option for pCa of the bathing solution."""
    return Option("pca", default, ALLOWED["pca"], "pCa of the bathing solution")


def rate_option(default_hz: float) -> Option:
    """The option for samples per second."""
    return Option("rate", (default_hz,), ALLOWED["rate_hz"], "samples per second", many=False)


def calcium_um(pca: float) -> float:
    """Free calcium (µM) at a pCa."""
    return float(10.0 ** (6.0 - pca))


def sample_times(duration_s: float, rate_hz: float, what: str) -> Array:
    """Even samples from 0 on, on whole nanoseconds, as a bag holds them, shape (n,), s.

    Args:
        what: begins the message.

    Raises:
        UserError: there would be too many.
    """
    count = int(np.floor(duration_s * rate_hz * (1.0 + 1e-12))) + 1
    if count > MOST_SAMPLES:
        raise UserError(
            f"{what}: {duration_s:g} s at {rate_hz:g} samples per second are {count} samples; allowed are "
            f"{MOST_SAMPLES}: take a lower rate"
        )
    times: Array = np.round(np.arange(count) / rate_hz * 1e9) / 1e9
    return times


def planned_between(
    facts: TrialFacts, steps: Sequence[tuple[str, float, float]], pca: float, rate_hz: float
) -> Planned:
    """A trial of straight pieces of length at one calcium.

    Args:
        facts: of the trial; its phases, L0 and F0 are set here.
        steps: of each piece its phase, duration (s) and rise (L0); one of no duration is left out.
        pca: of the bath, all the time.

    Raises:
        UserError: there would be too many samples.
    """
    pieces = [step for step in steps if step[1] > 0.0]
    corner_s = np.cumsum([0.0, *(duration for _, duration, _ in pieces)])
    corner_l0 = np.cumsum([0.0, *(rise for *_, rise in pieces)])
    time_s = sample_times(float(corner_s[-1]), rate_hz, f"protocol {facts.protocol}")
    phases = tuple(Phase(name, *corner_s[i : i + 2].tolist()) for i, (name, *_) in enumerate(pieces))
    trial = Trial(
        facts=replace(facts, pca=pca, phases=phases, reference_length_m=1.0, f0_n=1.0),
        time_s=time_s,
        length_m=1.0 + np.interp(time_s, corner_s, corner_l0),
        calcium_time_s=np.zeros(1),
        calcium_um=np.array([calcium_um(pca)]),
    )
    return Planned(trial, corner_s, corner_l0)


def facts_of(protocol: str, fibre: str, trial: str, settings: Mapping[str, float]) -> TrialFacts:
    """Facts of a trial that a protocol makes; `settings` are its numbers, by name with unit."""
    return TrialFacts(fibre=fibre, trial=trial, protocol=protocol, settings=tuple(settings.items()))


def planned_at_each_pca(
    protocol: str,
    fibre: str,
    stem: str,
    steps: Sequence[tuple[str, float, float]],
    settings: Settings,
    told: Mapping[str, float] = MappingProxyType({}),
) -> list[Planned]:
    """The same lengths at each pCa of the settings.

    Args:
        stem: names of trials begin with it.
        steps: see `planned_between`.
        told: numbers of the protocol for all trials, by name with unit.

    Raises:
        UserError: there would be too many samples.
    """
    made = []
    for pca in settings["pca"]:
        facts = facts_of(protocol, fibre, f"{stem}_pca{10.0 * pca:g}", {"pca": pca, **told})
        made.append(planned_between(facts, steps, pca, settings["rate"][0]))
    return made
