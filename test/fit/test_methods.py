"""Fits by a strain grid, led by the Gaussian form with its correction."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.fit.coordinates import fault_coordinates, parameter_coordinates
from xb_muscle_ros.fit.correction import Correction
from xb_muscle_ros.fit.data import fit_trials
from xb_muscle_ros.fit.features import F0_ANCHOR
from xb_muscle_ros.fit.methods import corrected, difference, fast_form
from xb_muscle_ros.fit.noise import FIRST, Scale
from xb_muscle_ros.fit.problem import Problem
from xb_muscle_ros.fit.report import as_json
from xb_muscle_ros.fit.run import Fitted, Settings, fit
from xb_muscle_ros.fit.solve import Objective, descend
from xb_muscle_ros.fit.training import Training
from xb_muscle_ros.models.fibre_file import Fibre, changed, load_fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.simulation.made import made
from xb_muscle_ros.trials.protocol import StretchShortenStretch
from xb_muscle_ros.work import Options

HERE = Options(processes=0, quiet=True)
NAMES = ["f", "k21", "kse"]


@pytest.fixture(scope="module")
def grid_start() -> Fibre:
    """The released set, without its smoothing, on a strain grid."""
    values = {"smoothing": 0.0, "bins": 151.0, "strain_range": 15.0}
    return changed(load_fibre("18Dec2017a", method="characteristics"), values, "test")


@pytest.fixture(scope="module")
def grid_truth(grid_start: Fibre) -> Fibre:
    """The fibre that made the data."""
    return changed(grid_start, {"f": 95.0, "k21": 19.0, "kse": 0.33}, "test")


@pytest.fixture(scope="module")
def grid_problem(grid_start: Fibre, grid_truth: Fibre) -> Problem:
    """Two trials for the fit, one held out, made by a finer grid and in finer steps."""
    random, protocol = np.random.default_rng(0), StretchShortenStretch(0.0383, 0.1)
    muscle = Muscle(changed(grid_truth, {"bins": 201.0}, "test"))
    trials = [made(muscle, protocol.trial("made", pca), random, substeps=4) for pca in (4.5, 6.1, 6.3)]
    coordinates = parameter_coordinates(grid_start, NAMES, (), {}, {})
    return Problem(grid_start, fit_trials(trials, [False, False, True]), coordinates, {})


@pytest.fixture(scope="module")
def grid_fitted(grid_problem: Problem) -> Fitted:
    return fit(grid_problem, Settings(starts=1), HERE)


def warned(fitted: Fitted) -> list[str]:
    """Lines that the fit warns with."""
    return list(as_json(fitted, {})["warnings"])


def full(problem: Problem) -> Problem:
    """With a pCa shift for each solution, a force offset for each trial, and isometric force at pCa 4.5."""
    trials = [t for t in problem.trials if not t.held_out]
    names, solutions = [t.name for t in trials], [t.solution for t in trials]
    faults = fault_coordinates(["pca_shift", "force_offset"], names, solutions, {})
    return replace(problem, coordinates=problem.coordinates + faults, features=(F0_ANCHOR,))


def test_corrected_form_has_the_grids_values_and_slopes(grid_problem: Problem) -> None:
    problem = full(grid_problem)
    z = problem.start + np.array([0.1 if c.log else 0.2 * c.prior_sd for c in problem.coordinates])
    exact, made_up = Training(problem), Training(corrected(problem, z, difference(problem, z), HERE))
    np.testing.assert_allclose(made_up.force(z), exact.force(z), atol=1e-12)
    np.testing.assert_allclose(made_up.feature_distance(z), exact.feature_distance(z), atol=1e-9)
    slopes, of_features = made_up.slopes(z)
    plain = Training(fast_form(problem)).slopes(z)[0]
    for j, c in enumerate(problem.coordinates):
        step = 0.02 * (1.0 if c.log else c.prior_sd)
        up, down = z.copy(), z.copy()
        up[j] += step
        down[j] -= step
        central = (exact.force(up) - exact.force(down)) / (2.0 * step)
        off = np.linalg.norm(slopes[:, j] - central)
        assert off < 0.03 * np.linalg.norm(central), c.label
        # The Gaussian form's own slopes are no better than the form.
        if c.group is None:
            assert np.linalg.norm(plain[:, j] - central) > 1.5 * off, c.label
        feature = (exact.feature_distance(up) - exact.feature_distance(down)) / (2.0 * step)
        np.testing.assert_allclose(of_features[:, j], feature, rtol=0.03, atol=0.03, err_msg=c.label)


def test_correction_survives_the_way_to_a_worker(grid_problem: Problem) -> None:
    problem = full(grid_problem)
    z = problem.start
    sent = corrected(problem, z, difference(problem, z), HERE)
    back = Problem.from_json(json.loads(json.dumps(sent.to_json())))
    there = z + 0.01
    np.testing.assert_array_equal(Training(back).force(there), Training(sent).force(there))
    np.testing.assert_array_equal(Training(back).feature_distance(there), Training(sent).feature_distance(there))
    assert not np.array_equal(Training(sent).force(there), Training(fast_form(problem)).force(there))


def test_level_correction_is_right_at_its_point_alone(grid_problem: Problem) -> None:
    z = grid_problem.start
    here = difference(grid_problem, z)
    level = Correction.level(here.force, here.features)
    training, exact = Training(replace(fast_form(grid_problem), correction=level)), Training(grid_problem)
    np.testing.assert_allclose(training.force(z), exact.force(z), atol=1e-12)
    assert np.abs(training.force(z + 0.3) - exact.force(z + 0.3)).max() > 1e-4


def test_only_training_trials_have_a_correction(grid_problem: Problem) -> None:
    z = grid_problem.start
    problem = corrected(grid_problem, z, difference(grid_problem, z), HERE)
    with pytest.raises(KeyError, match=grid_problem.trials[2].name):
        problem.predicted(z)


def test_led_fit_ends_where_a_descent_on_the_grid_itself_ends(grid_problem: Problem, grid_fitted: Fitted) -> None:
    """The same point to a hundredth of a standard deviation; the Gaussian form's own best point is far off."""
    objective = Objective(Training(grid_problem), Scale(*grid_fitted.scale))
    plain = descend(objective, grid_problem.start)
    sds = np.sqrt(np.diag(grid_fitted.shape.covariance))
    assert np.abs(grid_fitted.best.z - plain.z).max() < 0.02 * sds.max()
    assert grid_fitted.best.cost == pytest.approx(0.5 * np.sum(objective.residuals(grid_fitted.best.z) ** 2), rel=1e-9)
    assert grid_fitted.best.cost < plain.cost + 0.01
    gaussian = grid_fitted.starts[0]
    assert gaussian is not None
    assert 0.5 * np.sum(objective.residuals(gaussian.z) ** 2) > 10.0 * plain.cost
    assert np.abs((gaussian.z - plain.z) / sds).max() > 5.0


def test_grid_fit_finds_the_values_that_made_the_data(grid_fitted: Fitted, grid_truth: Fibre) -> None:
    found = as_json(grid_fitted, {})
    assert found["method"] == "characteristics"
    for row in found["parameters"]:
        true, (low, high) = grid_truth.values[row["name"]], row["interval"]
        assert row["value"] == pytest.approx(true, rel=0.01)
        assert row["interval_closed"] == [True, True]
        margin = (high / low) ** 0.5
        assert low / margin < true < high * margin
    assert found["heldout_rmsd_f0"] < 0.0015
    assert found["before"]["heldout_rmsd_f0"] > 0.01
    assert found["settled"]
    assert 0.0 < found["mismatch_f0"] < 1e-5
    assert not any("bins" in line or "settle" in line for line in found["warnings"])


def test_interrupted_grid_fit_goes_on_where_it_was(
    grid_problem: Problem, grid_fitted: Fitted, tmp_path: Path, descents_begun: Callable[[int], list[int]]
) -> None:
    options = replace(HERE, journal=tmp_path / "journal.jsonl")
    begun = descents_begun(3)
    with pytest.raises(KeyboardInterrupt):
        fit(grid_problem, Settings(1, level=None), options)
    before = len(begun)
    found = fit(grid_problem, Settings(1, level=None), options)
    np.testing.assert_array_equal(found.best.z, grid_fitted.best.z)
    again = fit(grid_problem, Settings(1, level=None), options)
    np.testing.assert_array_equal(again.best.z, grid_fitted.best.z)
    # The start and the first round were kept; the second round was not.
    assert len(begun) >= before + 1
    assert found.mismatch_f0 == grid_fitted.mismatch_f0


def test_bins_wider_than_attachment_are_told(grid_problem: Problem, grid_fitted: Fitted) -> None:
    coarse = replace(grid_problem, fibre=changed(grid_problem.fibre, {"bins": 101.0}, "test"))
    line = next(line for line in warned(replace(grid_fitted, problem=coarse)) if "bins" in line)
    assert "take 145 bins or more" in line


def test_a_fit_that_did_not_settle_is_told(grid_fitted: Fitted) -> None:
    assert any("did not settle" in line for line in warned(replace(grid_fitted, method_settled=False)))


def test_where_the_grid_has_no_solution_a_fit_says_so(grid_problem: Problem) -> None:
    from xb_muscle_ros.fit.rounds import refined

    start = descend(Objective(Training(fast_form(grid_problem)), FIRST), grid_problem.start)
    narrow = changed(grid_problem.fibre, {"strain_range": 1.5, "regrid": 0.0}, "test")
    with pytest.raises(UserError, match="method characteristics has no solution where the Gaussian form fits best"):
        refined(replace(grid_problem, fibre=narrow), start, None, HERE)


def test_isometric_force_alone_can_be_met(grid_problem: Problem) -> None:
    """Features have no samples that would tell when the correction holds."""
    coordinates = parameter_coordinates(grid_problem.fibre, ["f"], (), {}, {})
    wanted = tuple(replace(F0_ANCHOR, pca=pca, value=value) for pca, value in ((4.5, 1.05), (6.1, 0.55)))
    found = fit(Problem(grid_problem.fibre, (), coordinates, {}, wanted), Settings(1, level=None), HERE)
    assert found.method_settled
    objective = Objective(Training(found.problem), Scale(*found.scale))
    plain = descend(objective, found.problem.start)
    np.testing.assert_allclose(found.best.z, plain.z, atol=1e-3)


def test_models_with_one_method_need_no_correction(problem: Problem) -> None:
    assert fast_form(problem) is problem
    hill = load_fibre("18Dec2017a", "hill_se", "characteristics")
    without_heads = replace(problem, fibre=hill, coordinates=())
    assert fast_form(without_heads) is without_heads
