"""A held-out trial's own faults from its isometric force."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.fit.calibration import calibrated_force, own_faults
from xb_muscle_ros.fit.coordinates import fault_coordinates
from xb_muscle_ros.fit.correction import Correction
from xb_muscle_ros.fit.data import FitTrial, fit_trials
from xb_muscle_ros.fit.problem import Problem
from xb_muscle_ros.measurement.artefacts import ARTEFACTS, ORDINARY, Scope
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.trials.trial import Trial

Maker = Callable[..., list[Trial]]


def rmsd(force: np.ndarray, trial: FitTrial) -> float:
    return float(np.sqrt(np.mean((force - trial.measured_f0) ** 2)))


def problem_with(truth: Fibre, trials: tuple[FitTrial, ...], *names: str) -> Problem:
    """The fibre that made the trials, with faults of other trials than these."""
    return Problem(truth, trials, fault_coordinates(names, ["another"], ["pCa 5"], {}), {})


def test_one_fault_at_most_of_a_trial_or_solution_needs_a_simulation() -> None:
    """What `calibrated_force` counts on."""
    assert [f.name for f in ARTEFACTS.values() if f.on_input and f.scope is not Scope.STUDY] == ["pca_shift"]


def test_shift_of_a_held_out_solution(truth: Fibre, made_trials: Maker) -> None:
    (trial,) = fit_trials(made_trials((6.3,), 1, pca_shift=-0.05), [True])
    problem = problem_with(truth, (trial,), "pca_shift")
    found = calibrated_force(problem, problem.start, trial)
    assert found.own == {"pca_shift": pytest.approx(-0.05, abs=5e-3)}
    assert rmsd(found.force_f0, trial) < 3e-3 < rmsd(problem.predicted(problem.start, [trial])[0], trial)


def test_offset_of_a_held_out_trial_where_calcium_tells_nothing(truth: Fibre, made_trials: Maker) -> None:
    (trial,) = fit_trials(made_trials((4.5,), 1, force_offset=0.008), [True])
    problem = problem_with(truth, (trial,), *ORDINARY)
    found = calibrated_force(problem, problem.start, trial)
    assert set(found.own) == {"pca_shift", "force_offset"}
    # Half of it: prior and trust in the model's isometric force have the same SD.
    assert found.own["force_offset"] == pytest.approx(0.004, abs=1e-3)
    assert rmsd(found.force_f0, trial) < 0.6 * rmsd(problem.predicted(problem.start, [trial])[0], trial)


def test_shift_and_offset_share_what_is_missing_by_their_priors(truth: Fibre, made_trials: Maker) -> None:
    """On the steep part of the curve the shift has nearly all."""
    (trial,) = fit_trials(made_trials((6.3,), 1, pca_shift=0.05, force_offset=0.003), [True])
    problem = problem_with(truth, (trial,), *ORDINARY)
    found = calibrated_force(problem, problem.start, trial)
    assert found.own["pca_shift"] == pytest.approx(0.05, abs=0.01)
    assert abs(found.own["force_offset"]) < 2e-3
    inside = trial.steady
    assert np.mean(found.force_f0[inside]) == pytest.approx(np.mean(trial.measured_f0[inside]), abs=1e-3)


def test_what_the_fit_knows_of_a_solution_is_left_unless_asked_for(truth: Fibre, made_trials: Maker) -> None:
    (trial,) = fit_trials(made_trials((6.3,), 1, pca_shift=-0.05), [True])
    coordinates = fault_coordinates(
        ["pca_shift", "force_offset"], ["another"], [trial.solution], {"force_offset": 0.01}
    )
    problem = Problem(truth, (trial,), coordinates, {})
    assert [(c.label, c.prior_sd) for c in own_faults(problem, trial)] == [(f"force_offset[{trial.name}]", 0.01)]
    found = calibrated_force(problem, np.array([-0.05, 0.0]), trial)
    assert list(found.own) == ["force_offset"]
    assert rmsd(found.force_f0, trial) < 3e-3
    anew = calibrated_force(problem, problem.start, trial, known=False)
    assert anew.own["pca_shift"] == pytest.approx(-0.05, abs=5e-3)


def test_faults_of_the_study_are_those_of_the_point(truth: Fibre, made_trials: Maker) -> None:
    (trial,) = fit_trials(made_trials((6.1,), 1, length_gain=0.05, time_shift=2e-3, pca_shift=0.03), [True])
    problem = problem_with(truth, (trial,), "pca_shift", "length_gain", "time_shift")
    z = np.array([{"length_gain": 0.05, "time_shift": 2e-3}.get(c.name, 0.0) for c in problem.coordinates])
    assert rmsd(calibrated_force(problem, z, trial).force_f0, trial) < 3e-3
    assert rmsd(calibrated_force(problem, problem.start, trial).force_f0, trial) > 5e-3


def test_a_correction_is_added(truth: Fibre, made_trials: Maker) -> None:
    (trial,) = fit_trials(made_trials((4.5,), 1), [True])
    plain = problem_with(truth, (trial,), "force_offset")
    added = np.full(trial.time_s.size, 0.02)
    corrected = replace(plain, correction=Correction.level(plain.start, {trial.name: added}, np.empty(0)))
    first, second = (calibrated_force(problem, problem.start, trial) for problem in (plain, corrected))
    assert second.own["force_offset"] == pytest.approx(first.own["force_offset"] - 0.01, abs=1e-3)
    assert np.mean(second.force_f0 - first.force_f0) == pytest.approx(0.01, abs=1e-3)


def test_nothing_to_tell_it_by_leaves_the_prediction(truth: Fibre, made_trials: Maker) -> None:
    (trial,) = fit_trials(made_trials((6.3,), 1, pca_shift=-0.05), [True])
    problem = problem_with(truth, (trial,), *ORDINARY)
    predicted = problem.predicted(problem.start, [trial])[0]
    for poor in (replace(trial, steady_s=None), replace(trial, moves=False)):
        found = calibrated_force(problem, problem.start, poor)
        assert not found.own
        np.testing.assert_array_equal(found.force_f0, predicted)
    bare = Problem(truth, (trial,), (), {})
    assert not calibrated_force(bare, bare.start, trial).own


def test_a_prior_that_says_nothing_ends_at_the_bounds(truth: Fibre, made_trials: Maker) -> None:
    (trial,) = fit_trials(made_trials((6.3,), 1, pca_shift=-0.2), [True])
    coordinates = fault_coordinates(["pca_shift"], [], ["pCa 4.5"], {"pca_shift": float("inf")})
    problem = Problem(truth, (trial,), coordinates, {})
    assert calibrated_force(problem, problem.start, trial).own["pca_shift"] == pytest.approx(-0.2, abs=0.01)


def test_no_solution_is_an_error(truth: Fibre, made_trials: Maker) -> None:
    (trial,) = fit_trials(made_trials((6.3,), 1), [True])
    jump = replace(trial, length_l0=np.where(np.arange(trial.length_l0.size) > 150, 1e6, 0.0))
    problem = problem_with(truth, (trial,), *ORDINARY)
    with pytest.raises(UserError, match=trial.name):
        calibrated_force(problem, problem.start, jump)
