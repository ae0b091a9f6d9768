"""Coordinates, data, splits, noise and slopes."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.fit.coordinates import Choice, fault_coordinates, parameter_coordinates, population_choices
from xb_muscle_ros.fit.data import fit_trials
from xb_muscle_ros.fit.features import F0_ANCHOR, Feature, measured, simulated
from xb_muscle_ros.fit.noise import FIRST, scale_of
from xb_muscle_ros.fit.problem import Problem
from xb_muscle_ros.fit.solve import Objective, descend
from xb_muscle_ros.fit.split import held_out
from xb_muscle_ros.fit.training import Training
from xb_muscle_ros.measurement.artefacts import ARTEFACTS
from xb_muscle_ros.models.fibre_file import Fibre, load_fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.scores.noise.residual import residual_noise
from xb_muscle_ros.simulation.made import coloured_noise
from xb_muscle_ros.trials.trial import Trial, TrialFacts

Maker = Callable[..., list[Trial]]


@pytest.mark.parametrize(
    ("free", "fixed", "ties", "choices", "words"),
    [
        (["kof"], (), {}, {}, "did you mean 'koff'"),
        (None, ["vmax"], {}, {}, "has no parameter 'vmax'"),
        (["f"], (), {}, {"w": Choice(lower=0.1)}, "'w' has a bound or prior but is not fitted"),
        (["f"], (), {}, {"f": Choice(lower=200.0, upper=100.0)}, "bounds 200 to 100"),
        (["f"], (), {}, {"f": Choice(lower=100.0, upper=200.0)}, "starts at 79.0"),
        (["f"], (), {}, {"f": Choice(prior_sd=0.0)}, "needed is an sd above 0"),
        (["f"], (), {"k11": "k21", "k21": "f"}, {}, "tied itself"),
    ],
)
def test_choices_that_cannot_be(start, free, fixed, ties, choices, words) -> None:
    with pytest.raises(UserError, match=words):
        parameter_coordinates(start, free, fixed, ties, choices)


def test_default_is_what_the_paper_fitted(start: Fibre) -> None:
    names = [c.name for c in parameter_coordinates(start, None, ("Fpe0",), {}, {})]
    assert names == ["f", "k11", "k21", "k22", "kon", "koop", "JF", "kse", "kse0", "kpe"]


def test_faults_come_once_for_what_shares_them() -> None:
    made = fault_coordinates(list(ARTEFACTS), ["a", "b"], ["pCa 6", "pCa 6"], {"time_shift": 1e-3})
    labels = [c.label for c in made]
    assert labels.count("pca_shift[pCa 6]") == 1
    assert labels.count("force_offset[a]") == labels.count("force_offset[b]") == 1
    assert next(c for c in made if c.name == "time_shift").prior_sd == 1e-3
    with pytest.raises(UserError, match="did you mean 'pca_shift'"):
        fault_coordinates(["pca_shif"], [], [], {})


def test_priors_from_other_fibres() -> None:
    fibres = [load_fibre(name) for name in ("13Dec2017a", "14Dec2017b", "18Dec2017b")]
    made = population_choices(fibres, {"f": Choice(prior_mean=50.0)})
    assert made["f"].prior_mean == 50.0
    logs = np.log([fibre.values["k11"] for fibre in fibres])
    assert np.log(made["k11"].prior_mean) == pytest.approx(logs.mean())
    assert np.log1p(made["k11"].prior_sd) == pytest.approx(logs.std(ddof=1) * np.sqrt(4.0 / 3.0))
    with pytest.raises(UserError, match="at least 3"):
        population_choices(fibres[:2], {})


FACTS = [
    TrialFacts("f", "ramp_1", 4.5, 0.0, 0.001),
    TrialFacts("f", "ramp_2", 6.1, 0.0362, 0.1),
    TrialFacts("f", "triangle", 6.1, None, None),
    TrialFacts("f", "long", 6.3, 0.0383, 1.0),
]


@pytest.mark.parametrize(
    ("hold_out", "train", "preset", "wanted"),
    [
        (["pca=6.1"], [], None, [False, True, True, False]),
        (["trial=ramp*", "recovery=1"], [], None, [True, True, False, True]),
        ([], ["amplitude=0.0383"], None, [True, False, True, False]),
        ([], [], "paper", [False, False, False, True]),
        ([], [], None, [False] * 4),
    ],
)
def test_splits(hold_out: list[str], train: list[str], preset: str | None, wanted: list[bool]) -> None:
    assert held_out(FACTS, hold_out, train, preset) == wanted


@pytest.mark.parametrize(
    ("rule", "words"),
    [
        ("pca", "is not KEY=VALUE"),
        ("pca=x", "'x' is not a number"),
        ("pca=5", "no trial meets the rule 'pca=5'; pca of the trials: 4.5, 6.1, 6.3$"),
        ("amplitude=3.83", "amplitude of the trials: 0, 0.0362, 0.0383 L0$"),
        ("recovery=100", "recovery of the trials: 0.001, 0.1, 1 s$"),
        ("trial=ramp", "trials are ramp_1, ramp_2, triangle, long$"),
        ("pka=5", "did you mean"),
    ],
)
def test_rules_that_cannot_be(rule: str, words: str) -> None:
    with pytest.raises(UserError, match=words):
        held_out(FACTS, [rule], [], None)


def test_trials_of_one_name_and_unknown_weights(made_trials: Maker) -> None:
    trials = made_trials((4.5,))
    with pytest.raises(UserError, match="2 times"):
        fit_trials(trials * 2, [False] * 2)
    with pytest.raises(UserError, match="weight of trial 'x'"):
        fit_trials(trials, [False], weights={"x": 1.0})
    bare = replace(trials[0], force_n=np.empty(0), force_time_s=np.empty(0))
    with pytest.raises(UserError, match="has no measured force"):
        fit_trials([bare], [False])


def test_window_is_the_papers(made_trials: Maker) -> None:
    trial = made_trials((4.5,))[0]
    prepared, whole = fit_trials([trial], [False])[0], fit_trials([trial], [False], whole=True)[0]
    phases = trial.phases_by_name()
    assert prepared.force_time_s[0] == pytest.approx(phases["conditioning_stretch"].start_s - 0.0843, abs=1.1e-3)
    assert prepared.force_time_s[-1] == pytest.approx(phases["test_stretch"].end_s + 0.0843, abs=1.1e-3)
    assert whole.force_time_s.size == trial.force_time_s.size


def test_problem_survives_the_way_to_a_worker(problem: Problem) -> None:
    import json

    back = Problem.from_json(json.loads(json.dumps(problem.to_json())))
    z = problem.start + 0.1
    for a, b in zip(problem.predicted(z), back.predicted(z), strict=True):
        np.testing.assert_array_equal(a, b)
    assert back.coordinates == problem.coordinates


def test_slopes_are_those_of_central_differences(problem: Problem) -> None:
    faults = fault_coordinates(
        list(ARTEFACTS), [t.name for t in problem.trials], [t.solution for t in problem.trials], {}
    )
    full = replace(problem, coordinates=problem.coordinates + faults, features=(F0_ANCHOR,))
    training = Training(full)
    # Off the bound that a lag of 0 lies on.
    z = full.start + np.array([0.0 if c.log else 0.2 * c.prior_sd for c in full.coordinates])
    slopes, of_features = training.slopes(z)
    for j, c in enumerate(full.coordinates):
        step = 1e-3 * (1.0 if c.log else c.prior_sd)
        up, down = z.copy(), z.copy()
        up[j] += step
        down[j] -= step
        central = (training.force(up) - training.force(down)) / (2.0 * step)
        scale = np.abs(central).max()
        np.testing.assert_allclose(slopes[:, j], central, atol=0.02 * scale + 1e-9, err_msg=c.label)
        feature = (training.feature_distance(up) - training.feature_distance(down)) / (2.0 * step)
        np.testing.assert_allclose(of_features[:, j], feature, rtol=0.02, atol=1e-3, err_msg=c.label)


def test_descent_with_one_coordinate_held(problem: Problem) -> None:
    objective = Objective(Training(problem), FIRST)
    z = problem.start.copy()
    z[1] += 0.3
    found = descend(objective, z, held=1)
    assert found.z[1] == z[1]
    assert found.cost < 0.5 * np.sum(objective.residuals(z) ** 2)


@pytest.mark.slow
@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 10**6), memory=st.floats(0.5, 0.97))
def test_scale_of_coloured_noise(seed: int, memory: float) -> None:
    random = np.random.default_rng(seed)
    residuals = [coloured_noise(random, 2000, 2e-3, memory) for _ in range(5)]
    times, levels = [1e-3 * np.arange(2000.0)] * 5, [np.ones((2000, 1))] * 5
    scale = scale_of(residual_noise(times, residuals, levels, np.zeros((1, 1))))
    assert scale.force_sd_f0 == pytest.approx(2e-3, rel=0.35)
    expected = (1.0 + memory) / (1.0 - memory)
    assert expected / 2.5 < scale.correlation_samples < expected * 2.5


def test_features_of_a_simulation(truth: Fibre) -> None:
    muscle = Muscle(truth)
    kinds = [
        Feature("isometric_force", 4.5, 0.0, 0.0, 1.0, 0.02),
        Feature("srs_conditioning", 4.5, 0.0, 0.0, 30.0, 1.0),
        Feature("srs_test", 4.5, 1.0, 0.0, 30.0, 1.0),
        Feature("srs_test", 4.5, 0.001, 0.0383, 30.0, 1.0),
    ]
    force, fresh, unconditioned, conditioned = simulated(muscle, kinds)
    assert force == pytest.approx(muscle.outputs(muscle.settle(0.0, 10.0**1.5)).force_f0)
    # Nothing came before: the test stretch is the first one.
    assert unconditioned == pytest.approx(fresh, rel=1e-5)
    assert conditioned < 0.98 * fresh
    shifted = simulated(muscle, [replace(kinds[0], pca=4.4)], {4.4: 0.1})
    assert shifted[0] == pytest.approx(force, abs=1e-6)


@pytest.mark.parametrize(
    "change", [{"kind": "srs"}, {"value": float("nan")}, {"sd": 0.0}, {"pca": 0.0}, {"recovery_s": -1.0}]
)
def test_features_that_cannot_be(change: dict[str, object]) -> None:
    with pytest.raises(UserError, match="feature"):
        replace(F0_ANCHOR, **change)


def test_stretches_of_a_fibre_that_has_run_down_are_left_out(tmp_path: Path) -> None:
    def table(worst: float) -> dict[str, object]:
        cells = {
            "isometric_force": [[[1.0, 1.0]]],
            "srs_conditioning": [[[None, 40.0]]],
            "srs_test": [[[40.0, worst]]],
        }
        return {"pCa": [4.5], "recovery_s": [0.1], "amplitude_L0": [0.0, 0.0383], "fibres": {"a": cells}}

    path = tmp_path / "table.json"
    for worst, kept in ((30.0, 2), (-60.0, 0), (118.0, 0)):
        path.write_text(json.dumps(table(worst)))
        found = measured(path, "a")
        assert sum(f.kind == "srs_test" for f in found) == kept
        assert sum(f.kind == "isometric_force" for f in found) == 1
    with pytest.raises(UserError, match="'b' is not among a"):
        measured(path, "b")
    assert all(f.kind == "isometric_force" for f in measured(path, "a", stiffness=False))
