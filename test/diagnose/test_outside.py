"""Forces that no muscle bears, outside the study, are told; those of a sane answer are not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_trials import PROTOCOL, fitted_trials, given_fibre, truth

from xb_muscle_ros.diagnose.outside import _judged, warnings, worse_left_out
from xb_muscle_ros.diagnose.result import OfTrial
from xb_muscle_ros.fit.data import FitTrial
from xb_muscle_ros.models.fibre_file import Fibre, changed


@pytest.fixture(scope="module")
def trials() -> tuple[FitTrial, ...]:
    made = [PROTOCOL.trial("18Dec2017a", pca) for pca in (4.5, 6.2)]
    return fitted_trials([replace(t, force_time_s=t.time_s, force_n=0.5 + 0.0 * t.time_s) for t in made])


@pytest.fixture(scope="module")
def base() -> Fibre:
    return given_fibre()


def drag(value: float) -> Fibre:
    return changed(truth("3state_coop+viscous_drag"), {"drag": value}, "test")


def test_a_sane_answer_is_not_warned_of(trials: tuple[FitTrial, ...], base: Fibre) -> None:
    assert warnings(drag(0.02), base, trials) == []
    assert warnings(base, base, trials) == []


def test_passive_force_beyond_what_a_fibre_bears(trials: tuple[FitTrial, ...], base: Fibre) -> None:
    stiff = changed(base, {"kpe": 0.3}, "test")
    line = warnings(stiff, base, trials)[0]
    assert line.startswith("fibre 18Dec2017a: the answer predicts up to 15")
    assert "passive (pCa 9) at the study's longest length, +0.0383 L0" in line
    assert "do not use it there" in line
    # What the base does as well is not the answer's doing.
    assert warnings(stiff, stiff, trials) == []


def test_active_force_at_twice_the_speed(trials: tuple[FitTrial, ...], base: Fibre) -> None:
    found = warnings(drag(5.0), base, trials)
    assert any("at twice its speed and the highest calcium" in line for line in found)
    assert all(line.count("\n") == 0 for line in found)


def test_a_fibre_that_pushes(trials: tuple[FitTrial, ...], base: Fibre) -> None:
    """A drag in the shortening of a relaxed fibre."""
    (line,) = warnings(drag(0.6), base, trials)
    assert "the answer pushes with " in line
    assert "passive" in line


def test_no_solution_where_the_base_has_one() -> None:
    force = np.array([0.1, 0.2])
    (line,) = _judged("a", "there", [None, force], 0.5)
    assert line == "fibre a: the answer has no solution there, where the base has one; do not use it there"
    assert _judged("a", "there", [None, None], 0.5) == []
    assert _judged("a", "there", [force, None], 0.5) == []
    assert len(_judged("a", "there", [10.0 * force, None], 0.5)) == 1


def left_out(fibre: str, trial: str, before_f0: float | None, after_f0: float | None) -> OfTrial:
    return OfTrial(fibre, trial, 6.2, (), 1e-3, "window", 100, 0.01, 0.005, before_f0, after_f0)


def test_left_out_trials_that_the_answer_predicts_worse_are_told() -> None:
    rows = [
        left_out("a", "ramp", 0.03, 0.039),
        left_out("a", "cycle", 0.03, 0.0475),
        left_out("a", "release", 0.03, None),
        left_out("a", "shown", None, None),
        left_out("b", "ramp", 0.03, 0.01),
    ]
    assert worse_left_out(rows) == [
        "fibre a: the answer predicts trials cycle (4.8 for 3.0 % F0) and release (no solution) worse than the base "
        "does where they are left out of the fit; do not rely on it in movements like that"
    ]
    assert worse_left_out(rows[:1]) == []
