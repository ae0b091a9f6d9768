"""What ends an interval: data, prior, or a bound, be it another parameter's."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from xb_muscle_ros.fit.cautions import _of_parameter
from xb_muscle_ros.fit.coordinates import Choice, parameter_coordinates
from xb_muscle_ros.fit.data import fit_trials
from xb_muscle_ros.fit.ends import quadratic_ends
from xb_muscle_ros.fit.features import F0_ANCHOR
from xb_muscle_ros.fit.problem import Problem
from xb_muscle_ros.fit.report import as_json
from xb_muscle_ros.fit.run import Settings, fit
from xb_muscle_ros.fit.table import table
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.simulation.made import made
from xb_muscle_ros.trials.trial import Phase, Trial, TrialFacts
from xb_muscle_ros.work import Options

HERE = Options(processes=0, quiet=True)
NO_PRIOR = float("inf")


def still(fibre: str, pca: float, samples: int = 300) -> Trial:
    """Length held, so that isometric force is all there is."""
    time_s = np.arange(samples) / 1000.0
    calcium = np.array([10.0 ** (6.0 - pca)])
    facts = TrialFacts(fibre, f"still_{pca:g}", pca, phases=(Phase("isometric", 0.0, float(time_s[-1])),))
    return Trial(facts, time_s, np.ones(samples), np.zeros(1), calcium)


def found(start: Fibre, trial: Trial, names: list[str], level: float | None = 0.95, **choices: Choice) -> Any:
    coordinates = parameter_coordinates(start, names, (), {}, choices)
    problem = Problem(start, fit_trials([trial], [False], whole=True), coordinates, {}, (F0_ANCHOR,))
    return as_json(fit(problem, Settings(1, level=level), HERE), {})


@pytest.fixture(scope="module")
def isometric(start: Fibre) -> Trial:
    return made(Muscle(start), still("made", 6.1), np.random.default_rng(2), noise_sd_f0=0.01)


CHOICES = {
    "f": Choice(prior_mean=79.0, prior_sd=NO_PRIOR),
    "k21": Choice(prior_mean=23.6, prior_sd=NO_PRIOR, lower=22.0, upper=26.0),
}


def test_an_end_that_another_parameters_bound_makes_is_open(start: Fibre, isometric: Trial) -> None:
    """Force alone tells a ratio of rates: one is bounded only because the other is."""
    report = found(start, isometric, ["f", "k21"], **CHOICES)
    rows = {row["name"]: row for row in report["parameters"]}
    assert rows["f"]["interval_closed"] == [False, False]
    assert rows["f"]["interval_ended_by"] == ["bound of k21", "bound of k21"]
    assert rows["k21"]["interval_ended_by"] == ["bound", "bound"]
    assert rows["k21"]["interval"] == pytest.approx([22.0, 26.0])
    assert any(
        line == "f is not identifiable: nothing in the data bounds it below or above, only the bound of k21 does"
        for line in report["warnings"]
    )
    line = next(line for line in table(report).splitlines() if line.startswith("f "))
    assert "<" in line
    assert ">" in line


def test_the_curvature_says_the_same(start: Fibre, isometric: Trial) -> None:
    report = found(start, isometric, ["f", "k21"], None, **CHOICES)
    rows = {row["name"]: row for row in report["parameters"]}
    assert rows["f"]["interval_kind"] == "curvature"
    assert rows["f"]["interval_closed"] == rows["k21"]["interval_closed"] == [False, False]
    assert any(line.startswith("f is not identifiable") for line in report["warnings"])
    assert "intervals are those of the curvature" in table(report)


def test_a_bound_that_does_not_matter_closes_nothing_and_opens_nothing(start: Fibre, isometric: Trial) -> None:
    """The parallel spring at its bound bears next to nothing of the force; attachment is known without it."""
    choice = Choice(prior_sd=NO_PRIOR, lower=start.values["kpe"] * 0.999, upper=start.values["kpe"] * 1.01)
    report = found(start, isometric, ["f", "kpe"], f=Choice(prior_sd=NO_PRIOR), kpe=choice)
    rows = {row["name"]: row for row in report["parameters"]}
    assert rows["f"]["interval_closed"] == [True, True]


def test_an_end_that_only_the_prior_makes_is_said(start: Fibre, isometric: Trial) -> None:
    report = found(start, isometric, ["f", "k21"])
    rows = {row["name"]: row for row in report["parameters"]}
    for name in ("f", "k21"):
        assert rows[name]["interval_ended_by"] == ["prior", "prior"]
        assert rows[name]["interval_closed"] == [False, False]
    (line,) = [line for line in report["warnings"] if "prior" in line]
    assert line == ("ended by the prior, not by the data: the interval of f (below and above), k21 (below and above)")
    assert "~" in table(report)
    quadratic = found(start, isometric, ["f", "k21"], None)
    assert [row["interval_ended_by"] for row in quadratic["parameters"]] == [["prior", "prior"]] * 2


def test_the_handed_recording(start: Fibre, shared_cases: Path) -> None:
    path = shared_cases / "fit" / "iso_pca61.csv"
    time_s, length, force = np.genfromtxt(path, delimiter=",", skip_header=1).T
    trial = replace(still("iso", 6.1, time_s.size), length_m=length, force_time_s=time_s, force_n=force)
    report = found(start, trial, ["f", "k21"], **CHOICES)
    row = next(row for row in report["parameters"] if row["name"] == "f")
    assert row["interval_closed"] == [False, False]


def test_quadratic_ends_of_two_correlated_coordinates(start: Fibre) -> None:
    """A partner's bound cuts an interval only as far as the two are tied together."""
    a, b = parameter_coordinates(start, ["kse", "kse0"], (), {}, {})
    z = np.array([a.inward(a.start), b.inward(b.start)])
    near = replace(b, upper=b.start * 1.01)
    share, weak = np.zeros(2), np.zeros(2, dtype=bool)

    def ended(correlation: float, partner: Any) -> list[str]:
        covariance = 0.01 * np.array([[1.0, correlation], [correlation, 1.0]])
        return [what for _, what in quadratic_ends((a, partner), z, covariance, share, weak, 1.96)[0]]

    assert ended(0.99, b) == ["data", "data"]
    assert ended(0.99, near) == ["data", "bound of kse0"]
    assert ended(-0.99, near) == ["bound of kse0", "data"]
    assert ended(0.1, near) == ["data", "data"]
    weak[0] = True
    assert ended(0.1, b) == ["nothing", "nothing"]


def test_a_fitted_model_that_pushes_is_told(start: Fibre, isometric: Trial) -> None:
    released = np.interp(isometric.time_s, [0.1, 0.102], [1.0, 0.8])
    report = found(start, replace(isometric, length_m=released), ["f"], None)
    (line,) = [line for line in report["warnings"] if "pushes" in line]
    assert line.startswith("trial still_6.1: model 3state_coop pushes, force falls to -0.")
    assert not any("pushes" in line for line in found(start, isometric, ["f"], None)["warnings"])


def test_bounds_of_a_fault_cannot_be_widened() -> None:
    row = {"at_bound": "lower", "bounds": [0.0, 0.02], "unit": "s", "group": ""}
    (line,) = _of_parameter("transducer_lag", row)
    assert line == (
        "transducer_lag is at its lower bound, 0 s, which no option moves: leave this fault out, or look for another"
    )
    row = {"at_bound": "upper", "bounds": [0.0, 5.0], "unit": "1", "group": None, "interval_ended_by": ["data", "data"]}
    assert _of_parameter("JF", row) == ["JF is at its upper bound, 5; widen it, or fix it there"]
