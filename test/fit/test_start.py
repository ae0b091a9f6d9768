"""What a fitted file carries of the bags, and what is said where a simulation fails."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.fit import run as fit_run
from xb_muscle_ros.fit.problem import Problem
from xb_muscle_ros.fit.report import as_json, write_fitted
from xb_muscle_ros.fit.run import Settings, fit
from xb_muscle_ros.fit.start import with_constants
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.node.configuration import configure
from xb_muscle_ros.trials.trial import Trial, TrialFacts
from xb_muscle_ros.work import Options

HERE = Options(processes=0, quiet=True)
PROVENANCE = {"fibre_of_trials": "made", "start": "test", "json": "fit.json"}


def facts(trial: str, reference_length_m: float, f0_n: float) -> TrialFacts:
    return TrialFacts("mine", trial, reference_length_m=reference_length_m, f0_n=f0_n)


def test_the_node_takes_the_constants_of_the_bags_from_a_fitted_file(problem: Problem, tmp_path: Path) -> None:
    fibre, lines = with_constants(problem.fibre, [facts("a", 0.03, 0.4), facts("b", 0.03, 0.4)])
    assert lines == []
    fitted = fit(replace(problem, fibre=fibre), Settings(1, level=None), HERE)
    write_fitted(tmp_path / "mine.yaml", fitted, as_json(fitted, PROVENANCE))
    configured = configure(str(tmp_path / "mine.yaml"), {})
    known, values = configured.fibre, configured.values
    assert (known.reference_length_m, known.f0_n) == (0.03, 0.4)
    assert values["constants.reference_length_m"] == 0.03


def test_constants_that_differ_are_said_and_one_that_was_recorded_is_taken(start: Fibre) -> None:
    fibre, lines = with_constants(start, [facts("a", 0.03, 0.5), facts("b", 0.03, 0.3), facts("c", 0.03, 0.4)])
    assert (fibre.reference_length_m, fibre.f0_n) == (0.03, 0.4)
    assert lines == [
        "f0_n differs between the trials, 0.3 to 0.5 N; the fibre file carries the median, 0.4 N of trial c"
    ]
    assert with_constants(start, []) == (start, [])


def test_a_simulation_that_fails_names_its_trial_and_time(problem: Problem) -> None:
    good, bad = problem.trials[0], problem.trials[1]
    jump = replace(bad, length_l0=np.where(np.arange(bad.length_l0.size) > 150, 1e6, 0.0))
    with pytest.raises(
        UserError, match=rf"no finite start: trial {bad.name}: fibre .*, sample 151: length change is 1e\+06 L0"
    ):
        fit(replace(problem, trials=(good, jump)), Settings(1), HERE)


def test_starts_that_fail_say_in_which_trial(problem: Problem, monkeypatch: pytest.MonkeyPatch) -> None:
    """One of two: a warning; all of them: an error."""
    off = problem.start + 200.0
    monkeypatch.setattr(fit_run, "_starts", lambda problem, settings: [problem.start, off])
    found = fit(problem, Settings(2, level=None), HERE)
    (line,) = [line for line in as_json(found, PROVENANCE)["warnings"] if "led nowhere" in line]
    assert f"the first: trial {problem.trials[0].name}: " in line
    monkeypatch.setattr(fit_run, "_starts", lambda problem, settings: [off])
    with pytest.raises(UserError, match=f"none of 1 starts has a solution: trial {problem.trials[0].name}: "):
        fit(problem, Settings(1, level=None), HERE)


def test_a_held_out_trial_without_a_solution_is_said(problem: Problem) -> None:
    bad = problem.trials[2]
    jump = replace(bad, length_l0=np.where(np.arange(bad.length_l0.size) > 150, 1e6, 0.0))
    found = fit(replace(problem, trials=(*problem.trials[:2], jump)), Settings(1, level=None), HERE)
    lines = as_json(found, PROVENANCE)["warnings"]
    assert any(line.startswith(f"the fitted model has no solution in {bad.name}") for line in lines)


def test_every_trial_without_force_is_named(made_trials: Callable[..., list[Trial]]) -> None:
    from xb_muscle_ros.fit.data import fit_trials

    trials = [replace(t, force_time_s=np.empty(0), force_n=np.empty(0)) for t in made_trials((4.5, 6.1))]
    names = ", ".join(t.facts.trial for t in trials)
    with pytest.raises(UserError, match=f"^trials {names} have no measured force; a fit needs it, leave the bags out$"):
        fit_trials(trials, [False, False])
