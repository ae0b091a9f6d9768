"""What scripts/diagnose_recordings.py does to recordings before they are diagnosed."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from xb_muscle_ros.trials.trial import Phase, Trial, TrialFacts

_SCRIPT = Path(__file__).parents[2] / "scripts" / "recorded_trials.py"


@pytest.fixture(scope="module")
def cases() -> ModuleType:
    spec = importlib.util.spec_from_file_location("recorded_trials", _SCRIPT)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


def _trial(name: str = "ramp", length_l0: float = 0.0, wobble_l0: float = 0.0) -> Trial:
    """A ramp of 0.1 L0 from 2 to 3 s, stimulated from 1 to 4 s."""
    time = np.arange(501) / 100.0
    length = 1.0 + length_l0 + np.interp(time, [2.0, 3.0], [0.0, 0.1])
    length += wobble_l0 * (-1.0) ** np.arange(501)
    phases = (Phase("isometric", 0.0, 2.0), Phase("stretch", 2.0, 3.0), Phase("hold", 3.0, 5.0))
    facts = TrialFacts(fibre="m", trial=name, phases=phases)
    return Trial(facts, time, length, np.array([0.0, 1.0, 4.0]), np.array([0.1, 8.0, 0.1]), time, 0.5 + 0.0 * time)


def test_straight_length_takes_out_the_wobble_and_keeps_the_ramp(cases: ModuleType) -> None:
    straight = cases.straight_length(_trial(wobble_l0=0.001))
    assert straight.length_change_l0 == pytest.approx(_trial().length_change_l0, abs=2e-5)


def test_stimulated_ends_where_calcium_falls(cases: ModuleType) -> None:
    trial = cases.stimulated(_trial())
    assert trial.time_s[-1] == trial.force_time_s[-1] == 4.0
    assert trial.facts.phases[-1] == Phase("hold", 3.0, 4.0)
    assert trial.time_s.size == 401
    # Force of the first second of stimulation, 1 to 2 s, does not count: how fast calcium comes is assumed.
    assert trial.force_n.size == 301
    assert not np.any((trial.force_time_s >= 1.0) & (trial.force_time_s < 2.0))


def test_a_trial_without_stimulation_is_kept_whole(cases: ModuleType) -> None:
    trial = _trial()
    passive = Trial(trial.facts, trial.time_s, trial.length_m, np.zeros(1), np.full(1, 0.1))
    assert cases.stimulated(passive).time_s[-1] == 5.0


def test_chosen_follows_the_order_of_the_patterns_and_matches_whole_names(cases: ModuleType) -> None:
    trials = [_trial(name) for name in ("a1", "b1", "a10")]
    assert [t.facts.trial for t in cases.chosen(trials, ("b1", r"a1"))] == ["b1", "a1"]


def test_at_rest_takes_each_trials_length_and_force_before_anything_happens(cases: ModuleType) -> None:
    trials = []
    for stretch, force in ((0.0, 0.02), (0.1, 0.05), (0.2, 0.08)):
        trial = _trial(length_l0=stretch)
        time, none = trial.time_s, np.full(1, 0.1)
        measured = np.where(time < 1.0, force, 9.0)
        trials.append(Trial(trial.facts, time, trial.length_m, np.zeros(1), none, time, measured))
    length, force = cases.at_rest(trials, 0.9)
    assert length == pytest.approx([0.0, 0.1, 0.2])
    assert force == pytest.approx([0.02, 0.05, 0.08])


def test_soft_spring_finds_the_spring_that_made_the_forces(cases: ModuleType) -> None:
    length = np.linspace(-0.05, 0.2, 26)
    force = 1.5 * np.logaddexp(0.0, 40.0 * (length - 0.08)) / 40.0
    found = cases.soft_spring(length, force, 130.0)
    again = found["kpe"] * 130.0 * np.logaddexp(0.0, found["pe_sharpness"] * (length - found["lpe0"]))
    assert again / found["pe_sharpness"] == pytest.approx(force, abs=1e-3)
