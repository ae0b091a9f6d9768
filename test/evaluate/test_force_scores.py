"""Means over fibres, slices and tests of force RMSD on made results."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from xb_muscle_ros.evaluate.force_scores import common_condition, neighbours, overall, paired_tests, slices, spread
from xb_muscle_ros.evaluate.trials import MEASURED, Evaluated, Facts, Trials
from xb_muscle_ros.scores.estimate import Estimate


def made(rows: list[tuple[str, float, float, float, dict[str, float]]], content: str = "") -> Trials:
    """Trials of (fibre, pCa, amplitude, recovery, model -> RMSD over the whole window)."""
    found = []
    for i, (fibre, pca, amplitude, recovery, models) in enumerate(rows):
        scores = {name: {"rmsd_whole": Estimate(v), "rmsd_test": Estimate(v / 2)} for name, v in models.items()}
        facts = Facts("", fibre, str(i), pca, amplitude, recovery, 1.0, 0.0, None, True, content or str(i))
        found.append(Evaluated(str(i), facts=facts, scores={MEASURED: {}, **scores}))
    return Trials(found)


TRIALS = made(
    [
        ("a", 6.3, 0.0383, 0.001, {"2state": 0.10, "3state_coop": 0.08}),
        ("a", 4.5, 0.0383, 0.001, {"2state": 0.20, "3state_coop": 0.10}),
        ("a", 6.3, 0.0121, 0.001, {"2state": 0.30, "3state_coop": 0.12}),
        ("b", 6.3, 0.0383, 0.001, {"2state": 0.40, "3state_coop": 0.10}),
        ("b", 6.3, 0.0383, 0.1, {"2state": 0.60}),
    ]
)


def test_fibre_means_come_before_their_mean() -> None:
    found = overall(TRIALS)["2state"]["whole"]
    assert found is not None
    # a: 0.2, b: 0.5; not the mean over five trials
    assert found.fibres == pytest.approx({"a": 0.2, "b": 0.5})
    assert (found.mean, found.sd, found.trials) == (pytest.approx(0.35), pytest.approx(0.3 / np.sqrt(2)), 5)
    assert overall(TRIALS)["2state"]["conditioning"] is None


def test_one_fibre_has_no_sd() -> None:
    found = spread(TRIALS, TRIALS.column("2state", "rmsd_whole")[0], TRIALS.is_of("a"))
    assert found is not None
    assert found.sd is None


def test_slices_vary_one_thing() -> None:
    found = slices(TRIALS)
    assert [e.level for e in found["pca"]] == [4.5, 6.3]
    assert [e.level for e in found["amplitude_l0"]] == [0.0121, 0.0383]
    assert [e.level for e in found["recovery_s"]] == [0.001, 0.1]
    common = found["amplitude_l0"][1].models["2state"]["whole"]
    assert common.fibres == pytest.approx({"a": 0.1, "b": 0.4})
    assert common == found["pca"][1].models["2state"]["whole"]


def test_the_papers_condition_or_else_the_most_frequent_one() -> None:
    assert common_condition(TRIALS) == {"pca": 6.3, "amplitude_l0": 0.0383, "recovery_s": 0.001}
    other = made([("a", p, 0.02, 0.5, {"2state": 0.1}) for p in (6.0, 6.0, 5.0)])
    assert common_condition(other) == {"pca": 6.0, "amplitude_l0": 0.02, "recovery_s": 0.5}


def test_neighbours_in_complexity() -> None:
    six = ["hill", "hill_se", "2state", "2state_coop", "3state_coop", "4state_coop"]
    assert neighbours(six) == list(pairwise(six))
    assert neighbours(["hill_se", "3state_coop", "3state_coop_v3"]) == [
        ("hill_se", "3state_coop"),
        ("hill_se", "3state_coop_v3"),
    ]
    assert neighbours(["2state"]) == []


def test_tests_take_trials_that_both_models_have() -> None:
    found = paired_tests(TRIALS)
    assert found.threshold == pytest.approx(0.05 / 3)
    whole, conditioning, test = found.comparisons
    # a: 0.1 - 0.2, b: 0.1 - 0.4; the trial without the second model is left out
    assert (whole.first, whole.second, whole.found.n) == ("2state", "3state_coop", 2)
    assert whole.found.difference == pytest.approx(-0.2)
    assert whole.significant is False
    assert (conditioning.found.n, conditioning.significant) == (0, None)
    assert test.found.difference == pytest.approx(-0.1)


def test_a_clear_difference_is_significant() -> None:
    rows = [(f, 6.3, 0.0383, 0.001, {"hill_se": 0.3 + 0.001 * i, "2state": 0.1}) for i, f in enumerate("abcdefg")]
    whole = paired_tests(made(rows)).comparisons[0]
    assert whole.significant is True
    assert whole.found.p < 1e-4


def test_a_refused_bag_no_longer_counts() -> None:
    rows = [("a", 6.3, 0.0383, 0.001, {"2state": 0.1}), ("b", 6.3, 0.0383, 0.001, {"2state": 0.5})]
    trials = made(rows, content="the same")
    assert trials.fibres == ["a"]
    found = overall(trials)["2state"]["whole"]
    assert found is not None
    assert (found.mean, found.trials) == (0.1, 1)
    assert trials.problems == {"1": "bag 1 holds the same samples as 0; give every trial once"}
