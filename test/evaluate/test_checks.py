"""Recordings that cannot be evaluated: each fault one line that names bag, value and remedy."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.evaluate.checks import check_trial
from xb_muscle_ros.trials.checks import check_values
from xb_muscle_ros.trials.completing import pca_of
from xb_muscle_ros.trials.trial import Trial

Recorder = Callable[..., Trial]


@pytest.fixture(scope="module")
def good(recorded: Recorder) -> Trial:
    return recorded()


def facts(trial: Trial, **changes: object) -> Trial:
    return replace(trial, facts=replace(trial.facts, **changes))


def gap(trial: Trial) -> Trial:
    kept = (trial.force_time_s < 0.15) | (trial.force_time_s > 0.3)
    return replace(trial, force_time_s=trial.force_time_s[kept], force_n=trial.force_n[kept])


def check(trial: Trial, where: str) -> tuple[str, ...]:
    """As a bag of an evaluation is checked."""
    lines = check_values(trial, where)
    check_trial(trial, where)
    return lines


def test_a_good_trial_passes(good: Trial) -> None:
    assert check(good, "b") == ()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda t: replace(t, force_time_s=np.empty(0), force_n=np.empty(0)), "no measured force on /muscle/measured"),
        (lambda t: replace(t, length_m=1000.0 * t.length_m), "length differs from L0 by 1.04e+03 L0; allowed is -0.9"),
        (lambda t: facts(t, reference_length_m=1000.0), "length differs from L0 by -0.999 L0; allowed is -0.9 to 1"),
        (
            lambda t: replace(t, force_n=1000.0 * t.force_n),
            "allowed is -2 to 10: forces are in N, one F0 is 1 N (f0_n)",
        ),
        (lambda t: replace(t, calcium_um=1e-6 * t.calcium_um), "pCa is 6.1 but calcium is 7.943e-07 µM, where 0.7943"),
        (lambda t: replace(t, calcium_um=-t.calcium_um), "calcium is -0.794 µM; allowed is 0 to 10000"),
        (lambda t: facts(replace(t, calcium_um=np.zeros(1)), pca=None), "pCa is missing: custom_data has no 'pca'"),
        (lambda t: facts(t, amplitude_l0=3.83), "amplitude_l0 is 3.83; allowed is 0 to 0.5: amplitudes are fractions"),
        (
            lambda t: facts(t, amplitude_l0=0.0121),
            "amplitude_l0 is 0.0121 L0, but the conditioning stretch at 0.1000 s",
        ),
        (lambda t: facts(t, recovery_s=50.0), "recovery_s is 50 s, but the recovery at 0.2685 s has 0.05 s"),
        (
            lambda t: replace(t, force_time_s=t.force_time_s[:120], force_n=t.force_n[:120]),
            "measured force covers 0 to 0.238 s, lengths move from 0.1 to 0.4028 s; give both over the same time",
        ),
        (gap, "measured force has no sample for 0.154 s after t = 0.148 s"),
    ],
)
def test_faults_are_told_in_one_line(good: Trial, change: Callable[[Trial], Trial], words: str) -> None:
    with pytest.raises(UserError) as refused:
        check(change(good), "my/bag")
    assert str(refused.value).startswith("bag my/bag: ")
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)


def test_relaxed_fibres_may_have_any_calcium_that_is_next_to_none(good: Trial) -> None:
    check(facts(replace(good, calcium_um=np.zeros(1)), pca=9.0), "b")


def test_pca_comes_from_calcium_where_that_is_constant(good: Trial) -> None:
    assert pca_of(good) == 6.1
    assert pca_of(facts(good, pca=None)) == pytest.approx(6.1)
    changing = replace(good, calcium_time_s=np.array([0.0, 0.1]), calcium_um=np.array([0.1, 1.0]))
    assert pca_of(facts(changing, pca=None)) is None
