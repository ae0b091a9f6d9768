"""The one isometric force: permeabilised fibres at rest, stimulated muscles on their plateau, or none and why."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from xb_muscle_ros.evaluate.bags import answer
from xb_muscle_ros.fit.data import fit_trials
from xb_muscle_ros.models.fibre_file import load_fibre
from xb_muscle_ros.replay.report import record
from xb_muscle_ros.scores.noise.windows import isometric_window
from xb_muscle_ros.scores.readout import isometric_force
from xb_muscle_ros.scores.steady import steady_part
from xb_muscle_ros.trials.importing import Imported, import_recordings
from xb_muscle_ros.trials.readers.mapping import load_mapping
from xb_muscle_ros.trials.readers.settings import ImportSettings
from xb_muscle_ros.trials.simulated import MOMENTS, Simulated
from xb_muscle_ros.trials.trial import Array, Phase, Trial, TrialFacts

TIME = np.arange(3001) * 1e-3


def muscle(force: Array, moves_at_s: float | None = 2.5, on_s: float = 1.0, off_s: float = 9.0) -> Trial:
    """Three seconds of a stimulated muscle; its calcium rises and falls within 50 ms."""
    since = TIME - on_s
    calcium = 0.05 + 8.0 * np.where(since > 0.0, 1.0 - np.exp(-since / 0.05), 0.0)
    calcium = np.where(off_s < TIME, 0.05 + 8.0 * np.exp(-(TIME - off_s) / 0.06), calcium)
    phases: tuple[Phase, ...] = (Phase("isometric", 0.0, 3.0),)
    length = np.ones(TIME.size)
    if moves_at_s is not None:
        phases = (Phase("isometric", 0.0, moves_at_s), Phase("stretch", moves_at_s, 3.0))
        length += 0.2 * np.clip(TIME - moves_at_s, 0.0, None)
    return Trial(TrialFacts("f", "whole", phases=phases), TIME, length, TIME, calcium, TIME, force)


def rising(tau_s: float, level: float = 0.8, on_s: float = 1.0) -> Array:
    """Force that comes to a level, F0."""
    return np.where(on_s < TIME, level * (1.0 - np.exp(-(TIME - on_s) / tau_s)), 0.0)


def test_a_stimulated_muscle_has_the_force_of_its_plateau() -> None:
    """Over the whole phase it would be 0.43, over four fifths of it 0.34."""
    trial = muscle(rising(0.1) + np.where(TIME > 2.5, 0.5, 0.0))
    assert isometric_force(trial, TIME, trial.measured_f0).value == pytest.approx(0.8, abs=0.005)


def test_all_commands_take_the_same_force() -> None:
    random = np.random.default_rng(3)
    noise = 1e-3 * lfilter([1.0], [1.0, -0.9], np.sqrt(1.0 - 0.81) * random.standard_normal(TIME.size))
    trial = muscle(rising(0.1) + noise)
    expected = isometric_force(trial, TIME, trial.measured_f0).value
    assert expected is not None
    simulated = Simulated(TIME, trial.force_n, TIME, TIME, dict.fromkeys(MOMENTS, TIME))
    assert record(trial, simulated, load_fibre("18Dec2017a")).measured["isometric_f0"].value == expected
    assert answer(trial, TIME, trial.measured_f0)["isometric_f0"].value == expected
    (fitted,) = fit_trials([trial], [False], whole=True)
    assert float(np.mean(fitted.measured_f0[fitted.steady])) == expected
    # The noise of a study is taken there too: a rise is none.
    assert np.mean(isometric_window(trial).force_f0) == pytest.approx(expected, abs=1e-3)


@pytest.mark.parametrize(
    ("force", "moves_at_s", "why"),
    [
        (rising(2.0), 2.5, "force has not settled before length changes at 2.5 s"),
        (rising(0.5), 1.4, "force has not settled before length changes at 1.4 s"),
        (np.clip(TIME - 1.0, 0.0, None), 2.5, "force has not settled before length changes at 2.5 s"),
    ],
)
def test_force_that_still_rises_is_none(force: Array, moves_at_s: float, why: str) -> None:
    assert isometric_force(muscle(force, moves_at_s), TIME, force) == (None, None, why)


def test_a_short_tetanus_has_no_plateau() -> None:
    trial = muscle(np.exp(-(((TIME - 1.1) / 0.05) ** 2)), None, off_s=1.1)
    found = isometric_force(trial, TIME, trial.measured_f0)
    assert found.value is None
    assert found.why.startswith("force has not settled before activation ends at 1.1")


def test_a_tetanus_that_ends_is_taken_while_it_lasts() -> None:
    trial = muscle(np.where(TIME < 2.02, rising(0.05), 0.0), None, off_s=2.0)
    assert isometric_force(trial, TIME, trial.measured_f0).value == pytest.approx(0.8, abs=0.01)


def test_a_muscle_that_was_activated_later_is_at_rest() -> None:
    force = 0.1 + rising(0.05, on_s=2.6)
    trial = muscle(force, 2.5, on_s=2.6)
    assert isometric_force(trial, TIME, force).value == pytest.approx(0.1)


def fibre(force: Array, *phases: Phase) -> Trial:
    facts = TrialFacts("f", "skinned", 6.0, phases=phases)
    return Trial(facts, TIME, np.ones(TIME.size), np.zeros(1), np.ones(1), TIME, force)


def test_a_fibre_in_its_bath_has_the_mean_of_four_fifths() -> None:
    """What leaks from the stretch is left out."""
    force = np.where(TIME <= 0.8, 0.5, 0.7)
    trial = fibre(force, Phase("isometric", 0.0, 1.0), Phase("test_stretch", 1.0, 1.1))
    assert isometric_force(trial, TIME, force) == pytest.approx((0.5, None, ""))


def test_a_fibre_that_has_not_come_to_rest_has_the_force_of_its_steady_part() -> None:
    """A rise towards 1 F0 with 0.5 s: over all of the record the mean is 0.83."""
    noise = 2e-3 * np.random.default_rng(0).standard_normal(TIME.size)
    force = 1.0 - np.exp(-TIME / 0.5) + noise
    found = isometric_force(fibre(force, Phase("isometric", 0.0, 3.0)), TIME, force)
    assert found.value == pytest.approx(0.98, abs=0.015)
    assert found.why.startswith("force has not settled at first: it rises by 0.")
    slow = 1.0 - np.exp(-TIME / 3.0) + noise
    none = isometric_force(fibre(slow, Phase("isometric", 0.0, 3.0)), TIME, slow)
    assert none.value is None
    assert none.why.startswith("force has not settled at constant calcium: it rises by 0.5")


@pytest.mark.parametrize("noise_f0", [0.002, 0.02, 0.1])
def test_noise_is_no_rise(noise_f0: float) -> None:
    for seed in range(20):
        force = 0.1 + noise_f0 * np.random.default_rng(seed).standard_normal(TIME.size)
        trial = fibre(force, Phase("isometric", 0.0, 1.0), Phase("test_stretch", 1.0, 1.1))
        assert steady_part(trial, TIME, force) == (slice(0, 801), "", "")


def test_a_spike_is_no_rise() -> None:
    force = np.full(TIME.size, 0.1)
    force[[400, 401, 800]] = 2.0
    trial = fibre(force, Phase("isometric", 0.0, 1.0), Phase("test_stretch", 1.0, 1.1))
    assert steady_part(trial, TIME, force) == (slice(0, 801), "", "")


def test_none_is_told_with_its_reason() -> None:
    force = np.ones(TIME.size)
    assert steady_part(fibre(force), TIME, force).why == "the phases of the trial are not known"
    stretched = fibre(force, Phase("test_stretch", 0.0, 0.1))
    assert steady_part(stretched, TIME, force).why == "the trial begins with test stretch"
    short = fibre(force, Phase("isometric", 0.0, 0.0015), Phase("test_stretch", 0.0015, 0.1))
    assert steady_part(short, TIME, force).why == "2 samples before length changes; 3 are needed"


@pytest.mark.parametrize("trial", ["fig6and7A_trial45", "fig6and7A_trial50", "fig7C_trial65", "fig6and7A_trial43"])
def test_recorded_whole_muscles(trial: str, shared_data: Path, repo_root: Path, tmp_path: Path) -> None:
    """Cat soleus: F0 is the force of trial 43, and the others of this muscle come within 6 % of it at 0 to 6 mm."""
    name = "cat_soleus_herzog_leonard_2002"
    where = repo_root / "scripts" / "datasets" / f"{name}.yaml"
    source = shared_data / "recordings" / name / f"{trial}.csv"
    events = import_recordings([source], ImportSettings(load_mapping(where), where.name), tmp_path)
    (found,) = (event.trial for event in events if isinstance(event, Imported))
    force = isometric_force(found, found.force_time_s, found.measured_f0).value
    assert force == pytest.approx(1.0, abs=0.06)
