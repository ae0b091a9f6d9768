"""Whole fits of made data."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.fit import run as fit_run
from xb_muscle_ros.fit.coordinates import Choice, fault_coordinates, parameter_coordinates
from xb_muscle_ros.fit.data import fit_trials
from xb_muscle_ros.fit.problem import Problem
from xb_muscle_ros.fit.report import as_json, mean_rmsd, write_fitted
from xb_muscle_ros.fit.run import Fitted, Settings, fit
from xb_muscle_ros.fit.table import table
from xb_muscle_ros.models.fibre_file import Fibre, load_fibre
from xb_muscle_ros.trials.trial import Trial
from xb_muscle_ros.work import Options

Maker = Callable[..., list[Trial]]
HERE = Options(processes=0, quiet=True)
PROVENANCE = {"fibre_of_trials": "made", "start": "test", "json": "fit.json"}


def warned(fitted: Fitted) -> list[str]:
    """Lines that the fit warns with."""
    return list(as_json(fitted, PROVENANCE)["warnings"])


@pytest.fixture(scope="module")
def fitted(problem: Problem) -> Fitted:
    return fit(problem, Settings(starts=2), HERE)


def test_finds_the_values_that_made_the_data(fitted: Fitted, truth: Fibre) -> None:
    found = as_json(fitted, PROVENANCE)
    for row in found["parameters"]:
        assert row["value"] == pytest.approx(truth.values[row["name"]], rel=0.02)
    assert found["heldout_rmsd_f0"] < 0.002
    assert found["before"]["heldout_rmsd_f0"] > 0.01
    # What is left is the noise.
    assert found["train_rmsd_f0"] == pytest.approx(1e-3, rel=0.4)
    assert found["settled"]
    # Attachment and detachment of stretched heads go hand in hand in two trials, and that is said.
    assert [line.split(" (")[0] for line in found["warnings"]] == ["f and k21 are hardly told apart"]


def test_intervals_hold_the_truth_and_are_narrow(fitted: Fitted, truth: Fibre) -> None:
    for row in as_json(fitted, PROVENANCE)["parameters"]:
        low, high = row["interval"]
        assert row["interval_closed"] == [True, True]
        assert low < row["value"] < high
        assert 1.001 < high / low < 1.2
        # Twice the interval's half width: chance alone would break a tighter bound now and then.
        margin = (high / low) ** 0.5
        assert low / margin < truth.values[row["name"]] < high * margin


def test_report_is_plain_json_and_fits_a_terminal(fitted: Fitted) -> None:
    found = as_json(fitted, PROVENANCE)
    assert json.loads(json.dumps(found, allow_nan=False)) == found
    text = table(found)
    assert "amp383_rt100ms_pca63" in text
    assert "held out" in text


def test_written_fibre_file_says_where_it_comes_from(fitted: Fitted, tmp_path: Path) -> None:
    found = as_json(fitted, PROVENANCE)
    made = write_fitted(tmp_path / "fitted.yaml", fitted, found)
    back = load_fibre(tmp_path / "fitted.yaml")
    assert back.values == made.values
    assert "2 trials" in back.source
    text = (tmp_path / "fitted.yaml").read_text()
    assert "Trials held out: amp383_rt100ms_pca63." in text
    assert "Seed 1, 2 starts" in text


@pytest.mark.slow
def test_a_fit_is_the_same_wherever_and_again(problem: Problem, fitted: Fitted, tmp_path: Path) -> None:
    journal = tmp_path / "journal.jsonl"
    again = fit(problem, Settings(starts=2), Options(processes=2, quiet=True, journal=journal))
    np.testing.assert_array_equal(again.best.z, fitted.best.z)
    size = journal.stat().st_size
    third = fit(problem, Settings(starts=2), replace(HERE, journal=journal))
    assert as_json(third, PROVENANCE) == as_json(again, PROVENANCE)
    assert journal.stat().st_size == size


def test_interrupted_fit_goes_on_where_it_was(
    problem: Problem, fitted: Fitted, tmp_path: Path, descents_begun: Callable[[int], list[int]]
) -> None:
    options = replace(HERE, journal=tmp_path / "journal.jsonl")
    begun = descents_begun(2)
    with pytest.raises(KeyboardInterrupt):
        fit(problem, Settings(starts=2), options)
    found = fit(problem, Settings(starts=2), options)
    np.testing.assert_array_equal(found.best.z, fitted.best.z)
    # One descent before, the other start, and the polish; the first start was kept.
    assert len(begun) == 2 + 2


def test_pca_shift_of_a_solution_is_found(start: Fibre, made_trials: Maker) -> None:
    trials = fit_trials(made_trials((4.5, 6.1)) + made_trials((6.3,), 4, pca_shift=0.06), [False] * 3)
    coordinates = parameter_coordinates(start, ["f", "k21", "kse"], (), {}, {})
    coordinates += fault_coordinates(["pca_shift"], [], [t.solution for t in trials], {})
    found = as_json(fit(Problem(start, trials, coordinates, {}), Settings(1, level=None), HERE), PROVENANCE)
    shifts = {row["group"]: row["value"] for row in found["parameters"] if row["name"] == "pca_shift"}
    assert shifts["pCa 6.3"] == pytest.approx(0.06, abs=0.01)
    assert shifts["pCa 6.1"] == pytest.approx(0.0, abs=0.01)


def test_what_the_data_do_not_see_is_called_so(start: Fibre, made_trials: Maker) -> None:
    """At full calcium nothing tells how fast calcium binds; without a prior the interval has no end."""
    trials = fit_trials(made_trials((4.5,)), [False])
    choices = {"kon": Choice(prior_sd=float("inf"), lower=10.0, upper=400.0)}
    coordinates = parameter_coordinates(start, ["f", "k21", "kon"], (), {}, choices)
    found = fit(Problem(start, trials, coordinates, {}), Settings(1), HERE)
    assert any(line.startswith("kon is not identifiable") for line in warned(found))


def test_a_value_at_its_bound_is_told(start: Fibre, made_trials: Maker) -> None:
    trials = fit_trials(made_trials((4.5,)), [False])
    coordinates = parameter_coordinates(start, ["f"], (), {}, {"f": Choice(lower=70.0, upper=85.0)})
    found = fit(Problem(start, trials, coordinates, {}), Settings(1, level=None), HERE)
    assert any(line.startswith("f is at its upper bound, 85") for line in warned(found))


def test_ties_move_together(start: Fibre, made_trials: Maker) -> None:
    trials = fit_trials(made_trials((4.5,)), [False])
    coordinates = parameter_coordinates(start, ["k12"], (), {"k22": "k12"}, {})
    problem = Problem(start, trials, coordinates, {"k22": "k12"})
    values = problem.fibre_at(problem.start).values
    assert values["k22"] == values["k12"] == start.values["k12"]


def test_held_out_trials_do_not_bear_on_the_fit(problem: Problem, fitted: Fitted) -> None:
    spoilt = [replace(t, measured_f0=t.measured_f0 * 3.0) if t.held_out else t for t in problem.trials]
    again = fit(replace(problem, trials=tuple(spoilt)), Settings(starts=2, level=None), HERE)
    np.testing.assert_allclose(again.best.z, fitted.best.z, atol=1e-12)
    rows = as_json(again, PROVENANCE)["trials"]
    assert mean_rmsd(rows, True, "rmsd_f0") > 0.5


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"coordinates": ()}, "nothing is free"),
        ({"trials": ()}, "all 0 trials are held out"),
    ],
)
def test_nothing_to_do(problem: Problem, change: dict[str, object], words: str) -> None:
    with pytest.raises(UserError, match=words):
        fit(replace(problem, **change), Settings(1), HERE)


def test_no_finite_start(problem: Problem) -> None:
    trial = problem.trials[0]
    jump = replace(trial, length_l0=np.where(np.arange(trial.length_l0.size) > 150, 1e6, 0.0))
    with pytest.raises(UserError, match="no finite start"):
        fit(replace(problem, trials=(jump,)), Settings(1), HERE)


def test_a_random_start_without_a_solution_is_left_out(problem: Problem, monkeypatch: pytest.MonkeyPatch) -> None:
    def starts(problem: Problem, settings: Settings) -> list[np.ndarray]:
        return [problem.start, problem.start + 200.0]

    monkeypatch.setattr(fit_run, "_starts", starts)
    found = fit(problem, Settings(2, level=None), HERE)
    assert found.starts[0] is not None
    assert found.starts[1] is None
    assert any("1 of 2 starts led nowhere" in line for line in warned(found))


def test_number_of_starts(problem: Problem) -> None:
    with pytest.raises(UserError, match="number of starts is 0"):
        fit(problem, Settings(0), HERE)
