"""Stated amplitude and recovery help to find phases where lengths may hide them, and nowhere else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from xb_muscle_ros.trials.checks import belied, unrecorded
from xb_muscle_ros.trials.phases import detect_phases
from xb_muscle_ros.trials.protocol import StretchShortenStretch
from xb_muscle_ros.trials.trial import Trial


def recorded(amplitude: float, recovery_s: float, noise: float = 0.0, rate_hz: float = 1000.0) -> Trial:
    made = StretchShortenStretch(amplitude, recovery_s, lead_s=0.4).trial("f", 6.1, rate_hz)
    return replace(made, length_m=made.length_m + noise * np.random.default_rng(4).normal(size=made.time_s.size))


def stated(trial: Trial, amplitude: float | None, recovery_s: float | None) -> Trial:
    """The trial with these facts, and with the phases that are found by them."""
    phases = detect_phases(trial.time_s, trial.length_m, amplitude, recovery_s, 1.0)
    facts = replace(trial.facts, amplitude_l0=amplitude, recovery_s=recovery_s, phases=phases)
    return replace(trial, facts=facts)


@pytest.mark.parametrize("noise", [0.0, 1e-4, 1e-3])
@pytest.mark.parametrize("recovery_s", [0.015, 0.1, 10.0])
def test_a_pause_that_lengths_have_not_is_not_made(noise: float, recovery_s: float) -> None:
    trial = stated(recorded(0.0383, 0.001, noise), 0.0383, recovery_s)
    assert trial.facts.phases == detect_phases(trial.time_s, trial.length_m, l0=1.0)
    assert "recovery" not in trial.phases_by_name()
    (fact,) = belied(trial)
    assert fact.what.startswith(f"recovery_s is {recovery_s:g} s, but the test stretch at 0.56")
    assert fact.what.endswith("s has no pause before it")
    assert not list(belied(stated(trial, 0.0383, 0.001)))


@pytest.mark.parametrize("noise", [0.0, 1e-4])
@pytest.mark.parametrize(("amplitude", "recovery_s"), [(0.0383, 0.1), (0.0038, 0.1), (0.05, 0.1), (0.04, 0.001)])
def test_a_stretch_that_lengths_have_not_is_not_made(noise: float, amplitude: float, recovery_s: float) -> None:
    trial = stated(recorded(0.0, 0.0, noise), amplitude, recovery_s)
    assert [phase.name for phase in trial.facts.phases] == ["isometric", "test_stretch", "hold"]
    (fact,) = belied(trial)
    said = f"amplitude_l0 is {amplitude:g} L0 and recovery_s {recovery_s:g} s, but lengths show no conditioning stretch"
    assert fact.what.startswith(f"{said} from 0.0000 s to the test stretch at ")
    assert float(fact.what.split()[-2]) == pytest.approx(0.4, abs=1e-3)
    assert "give amplitude 0" in fact.remedy
    assert not list(belied(stated(trial, 0.0, recovery_s)))


@pytest.mark.parametrize(("noise", "recovery_s"), [(0.0, 0.001), (1e-4, 0.1), (1e-3, 1.0), (1e-3, 0.1)])
def test_a_stretch_that_lengths_may_hide_is_placed(noise: float, recovery_s: float) -> None:
    trial = stated(recorded(0.0012, recovery_s, noise), 0.0012, recovery_s)
    assert "conditioning_stretch" in trial.phases_by_name()
    assert not list(belied(trial))


@pytest.mark.parametrize("begin_s", [0.45, 0.5, 0.58, 0.65])
def test_a_record_that_begins_within_or_after_the_conditioning_stretch_is_taken(begin_s: float) -> None:
    whole = recorded(0.0383, 0.2)
    late = whole.time_s >= begin_s
    trial = stated(replace(whole, time_s=whole.time_s[late], length_m=whole.length_m[late]), 0.0383, 0.2)
    assert "conditioning_stretch" not in trial.phases_by_name() or begin_s < 0.484
    assert not list(belied(trial))
    assert not list(unrecorded(trial))


@pytest.mark.parametrize("amplitude", [0.0, 0.0038])
def test_a_stretch_that_is_seen_is_not_stated_as_none_or_small(amplitude: float) -> None:
    trial = recorded(0.0383, 0.1)
    (fact,) = belied(replace(trial, facts=replace(trial.facts, amplitude_l0=amplitude)))
    assert "but the conditioning stretch at 0.4000 s has 0.0381" in fact.what


def test_an_amplitude_without_recovery_of_a_lone_stretch_is_told() -> None:
    trial = recorded(0.0, 0.0)
    (line,) = unrecorded(stated(trial, 0.04, None))
    assert "amplitude_l0 is 0.04 L0, but lengths from 0 s show no conditioning stretch before the test" in line
    assert "at 0.4000 s" in line
    assert not list(unrecorded(stated(trial, 0.0, None)))
