"""Classes and sets of conditions as the paper counts them."""

from __future__ import annotations

import numpy as np
import pytest

from xb_muscle_ros.scores.conditions import CLASSES, CONDITIONS, LARGE, SHAPE, UNKNOWN, activation_class, sets


@pytest.mark.parametrize(
    ("force", "name"),
    [
        (-0.01, "passive"),
        (0.0499, "passive"),
        (0.05, "low"),
        (0.2999, "low"),
        (0.30, "intermediate"),
        (0.70, "intermediate"),
        (0.7001, "high"),
        (1.2, "high"),
    ],
)
def test_classes_by_isometric_force(force: float, name: str) -> None:
    assert CLASSES[activation_class(np.array([force]))[0]] == name


def test_an_unknown_force_has_no_class() -> None:
    assert activation_class(np.array([[np.nan, 0.5]])).tolist() == [[UNKNOWN, 2]]


def test_there_are_84_conditions() -> None:
    assert SHAPE == (4, 21)
    assert len(set(CONDITIONS)) == 21
    assert CONDITIONS[0] == (0.0, 0.001)
    assert {c.amplitude_l0 for c in CONDITIONS[1:]} == {0.0012, 0.0038, 0.0121, 0.0383}
    assert {c.recovery_s for c in CONDITIONS[1:]} == {0.001, 0.1, 0.316, 1.0, 10.0}


@pytest.mark.parametrize(("reading", "count"), [("text", 6), ("released", 12)])
def test_large_and_small_make_all(reading: str, count: int) -> None:
    masks = sets(reading)
    assert np.count_nonzero(masks["large"]) == count
    assert np.count_nonzero(masks["small"]) == 84 - count
    assert not np.any(masks["large"] & masks["small"])
    assert np.all(masks["all"])


def test_large_reductions_are_those_of_the_text() -> None:
    chosen = [(CLASSES[i], CONDITIONS[k]) for i, k in np.argwhere(LARGE["text"]).tolist()]
    assert chosen == [(name, (0.0383, rt)) for name in ("low", "intermediate") for rt in (0.001, 0.1, 0.316)]


def test_only_twelve_large_conditions_fit_the_papers_three_numbers() -> None:
    """0.312 over n large conditions and 0.204 over 84 leave at most 0.180 over the rest for n >= 12 alone."""

    def rest(n: int) -> float:
        return float(np.sqrt((84 * 0.204**2 - n * 0.312**2) / (84 - n)))

    assert rest(6) > 0.190
    assert rest(12) == pytest.approx(0.180, abs=5e-4)
