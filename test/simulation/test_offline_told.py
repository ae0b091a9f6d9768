"""What replay says of a trial whose simulation fails, or whose model pushes."""

from __future__ import annotations

import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from xb_muscle_ros.errors import StateViolation, UserError, naming
from xb_muscle_ros.models.fibre_file import load_fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.simulation.offline import pushing, simulate_trial
from xb_muscle_ros.trials.readers.csv import read_csv
from xb_muscle_ros.trials.readers.mapping import build_mapping
from xb_muscle_ros.trials.trial import Trial, TrialFacts


@pytest.fixture(scope="module")
def muscle() -> Muscle:
    return Muscle(load_fibre("18Dec2017a"))


def shortening() -> Trial:
    """From 1.3 to 0.7 L0 at 20 L0/s, full calcium."""
    time_s = np.arange(400) * 1e-3
    length = np.interp(time_s, [0.0, 0.3, 0.33], [1.3, 1.3, 0.7])
    return Trial(TrialFacts("18Dec2017a", "vmax"), time_s, length, np.zeros(1), np.array([10.0**1.5]))


def test_a_model_that_pushes_is_told_once_with_trial_force_and_time(muscle: Muscle) -> None:
    trial = shortening()
    simulated = simulate_trial(muscle, trial)
    told = pushing(trial, simulated, "3state_coop")
    assert told is not None
    assert told.startswith("trial vmax: model 3state_coop pushes, force falls to -0.")
    assert f"at t = {trial.time_s[int(np.argmin(simulated.force_n))]:g} s" in told
    assert "in model 3state_coop_slack the series spring goes slack" in told
    slack = Muscle(load_fibre("18Dec2017a", "3state_coop_slack"))
    there = simulate_trial(slack, trial)
    assert there.force_n.min() >= 0.0
    assert pushing(trial, there, "3state_coop_slack") is None


def test_the_handed_shortening_pushes_as_documented_and_goes_slack_where_asked(
    muscle: Muscle, shared_cases: Path
) -> None:
    columns = {"time": {"column": "time_s", "unit": "s"}, "length": {"column": "length_l0", "unit": "L0"}}
    mapping = build_mapping({"fibre": "18Dec2017a", "pca": 4.5, "columns": columns}, "here")
    trial = read_csv(shared_cases / "numeric" / "vmax.csv", mapping)
    assert simulate_trial(muscle, trial).force_n.min() / muscle.fibre.f0_n == pytest.approx(-0.54, abs=0.01)
    slack = Muscle(load_fibre("18Dec2017a", "3state_coop_slack"))
    assert simulate_trial(slack, trial).force_n.min() >= 0.0


def test_a_failing_simulation_names_its_trial(muscle: Muscle) -> None:
    trial = shortening()
    absurd = replace(trial, length_m=np.where(trial.time_s > 0.2, -0.2, trial.length_m))
    with pytest.raises(UserError, match=r"^trial vmax: fibre 18Dec2017a, sample 201: length change is -1\.2 L0"):
        simulate_trial(muscle, absurd)


def test_naming_keeps_the_kind_of_error_and_its_facts() -> None:
    with pytest.raises(StateViolation, match=r"^trial x: fibre f: state q0 became 2") as caught, naming("trial x"):
        raise StateViolation("f", "q0", 0.1, 2.0, "0 to 1", "check")
    assert (caught.value.state, caught.value.time_s) == ("q0", 0.1)


def test_an_error_that_names_a_state_goes_to_another_process_whole() -> None:
    error = StateViolation("f", "q0", 0.1, 2.0, "0 to 1", "check")
    error.args = (f"trial x: {error}",)
    there = pickle.loads(pickle.dumps(error))
    assert (str(there), there.state, there.time_s) == (str(error), "q0", 0.1)
