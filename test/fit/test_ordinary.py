"""Ordinary errors of the measurement: what trials can show of them, and what is said of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from xb_muscle_ros.fit.coordinates import fault_coordinates, parameter_coordinates
from xb_muscle_ros.fit.data import FitTrial, fit_trials
from xb_muscle_ros.fit.descents import scale_at
from xb_muscle_ros.fit.ordinary import beyond_line, fitted_line, shown_by
from xb_muscle_ros.fit.problem import Problem
from xb_muscle_ros.fit.report import as_json
from xb_muscle_ros.fit.run import Settings, fit
from xb_muscle_ros.fit.table import table
from xb_muscle_ros.measurement.artefacts import ORDINARY
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.trials.trial import Trial
from xb_muscle_ros.work import Options

Maker = Callable[..., list[Trial]]
HERE = Options(processes=0, quiet=True)
# Ordinary in size, of three trials; the third solution is held out.
ERRORS = (
    {"force_offset": 0.004, "time_shift": 8e-4},
    {"pca_shift": 0.06, "force_offset": -0.003, "time_shift": 8e-4},
    {"pca_shift": -0.05, "force_offset": 0.002, "time_shift": 8e-4},
)
PCAS = (4.5, 6.1, 6.3)


@pytest.fixture(scope="module")
def trials(made_trials: Maker) -> tuple[FitTrial, ...]:
    made = [made_trials((pca,), k, **errors)[0] for k, (pca, errors) in enumerate(zip(PCAS, ERRORS, strict=True))]
    return fit_trials(made, [False, False, True])


def problem_of(start: Fibre, trials: tuple[FitTrial, ...], names: tuple[str, ...]) -> Problem:
    training = [t for t in trials if not t.held_out]
    errors = fault_coordinates(names, [t.name for t in training], [t.solution for t in training], {})
    return Problem(start, trials, (*parameter_coordinates(start, ["f", "k21", "kse"], (), {}, {}), *errors), {})


def test_what_trials_can_show(trials: tuple[FitTrial, ...]) -> None:
    assert shown_by(trials) == (list(ORDINARY), [])
    assert shown_by(trials[:1])[1] == ["run_down"]
    still = [replace(t, moves=False) for t in trials]
    assert shown_by(still)[1] == ["length_gain", "time_shift"]
    rising = [replace(t, calcium_um=t.calcium_um + np.linspace(0.0, 1.0, t.calcium_um.size)) for t in still]
    assert shown_by(rising)[1] == ["length_gain"]
    assert shown_by([]) == ([], list(ORDINARY))


def test_with_ordinary_errors_fitted_parameters_are_right_and_without_wrong(
    start: Fibre, truth: Fibre, trials: tuple[FitTrial, ...]
) -> None:
    fitted = fit(problem_of(start, trials, ORDINARY), Settings(1, level=None), HERE)
    found = as_json(fitted, {})
    bare = as_json(fit(problem_of(start, trials, ()), Settings(1, level=None), HERE), {})
    held = {row["name"]: row for row in found["parameters"] if row["group"] is None}
    for name, row in held.items():
        assert row["interval"][0] < truth.values[name] < row["interval"][1]
    wrong = [r for r in bare["parameters"] if not r["interval"][0] < truth.values[r["name"]] < r["interval"][1]]
    assert wrong
    values = {(row["name"], row["group"]): row["value"] for row in found["parameters"]}
    assert values["time_shift", ""] == pytest.approx(8e-4, abs=2e-4)
    assert values["pca_shift", "pCa 6.1"] == pytest.approx(0.06, abs=0.03)
    # The held-out solution's own, which the fit never met.
    (row,) = [row for row in found["trials"] if row["held_out"]]
    assert row["own_faults"]["pca_shift"] == pytest.approx(-0.05, abs=0.03)
    assert row["rmsd_calibrated_f0"] < 0.005 < row["rmsd_f0"]
    assert row["rmsd_calibrated_f0"] < row["rmsd_before_calibrated_f0"]
    assert found["heldout_rmsd_calibrated_f0"] == pytest.approx(row["rmsd_calibrated_f0"])
    text = table(found)
    assert "pca_shift (2 solutions, SD 0.05)" in text
    assert "taken as absent: force_drift, transducer_lag" in text
    assert "with what isometric force tells of 1 of them" in text


def test_errors_that_priors_hold_take_nothing_from_the_residuals(start: Fibre, trials: tuple[FitTrial, ...]) -> None:
    """Thirty errors held at 0 leave the scale as it is without them; as many that are free do not."""
    few = problem_of(start, trials, ())
    free = few.coordinates
    plain = scale_at(few, few.start).force_sd_f0

    def with_errors(sd: float) -> float:
        offsets = fault_coordinates(["force_offset"], [t.name for t in trials[:2]], [], {"force_offset": sd})
        drifts = fault_coordinates(["force_drift"], [t.name for t in trials[:2]], [], {"force_drift": sd})
        problem = replace(few, coordinates=(*free, *offsets, *drifts))
        return scale_at(problem, problem.start).force_sd_f0

    assert with_errors(1e-7) == pytest.approx(plain, rel=1e-3)
    assert with_errors(1.0) > 1.02 * plain


def row(name: str, value: float, group: str | None = "", sd: float | None = 0.05) -> dict[str, object]:
    return {"name": name, "group": group, "value": value, "prior_sd": sd}


def test_lines() -> None:
    rows = [row("f", 3.0, None), row("pca_shift", 0.02, "pCa 6"), row("pca_shift", -0.12, "pCa 6.3")]
    rows += [row("time_shift", 2e-3, "", 7e-4), row("force_drift", 9.0, "a", None)]
    assert fitted_line(rows) == (
        "errors of the measurement fitted beside: pca_shift (2 solutions, SD 0.05), time_shift (SD 0.0007 s), "
        "force_drift (1 trial, no prior)"
    )
    assert fitted_line(rows[:1]) == ""
    (line,) = beyond_line(rows, [{"trial": "b", "own_faults": {"pca_shift": 0.2}}, {"trial": "c"}])
    assert line.startswith(
        "beyond what is ordinary (2 SD): pca_shift[pCa 6.3] -0.12 (2.4 SD), time_shift 0.002 s (2.9 SD), "
        "pca_shift[b] 0.2 (4.0 SD);"
    )
    assert beyond_line(rows[:2], []) == []


def test_many_trials_share_a_line_of_the_table(start: Fibre, trials: tuple[FitTrial, ...]) -> None:
    many = tuple(replace(trials[0], name=f"t{k}") for k in range(6))
    problem = problem_of(start, many, ("force_offset",))
    found = as_json(fit(replace(problem, coordinates=problem.coordinates[2:]), Settings(1, level=None), HERE), {})
    lines = [line for line in table(found).splitlines() if line.startswith("force_offset")]
    assert len(lines) == 1
    assert "of 6 trials" in lines[0]
