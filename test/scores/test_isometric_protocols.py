"""Force-pCa curves, k_tr and residual force enhancement of made records."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from xb_muscle_ros.scores.enhancement import Enhancement, Side, enhancement
from xb_muscle_ros.scores.estimate import Missing
from xb_muscle_ros.scores.force_pca import ForcePca, fit_force_pca, hill_curve
from xb_muscle_ros.scores.redevelopment import Redevelopment, redevelopment, restretch_end, still_until
from xb_muscle_ros.scores.standard_error import force_noise
from xb_muscle_ros.trials.trial import Array, Phase, Trial, TrialFacts

PCA = np.array([4.5, 6.0, 6.2, 6.4, 6.6, 9.0])
TIME = np.arange(6001) * 1e-3


@given(st.floats(5.9, 6.5), st.floats(1.5, 8.0), st.floats(0.0, 0.1))
def test_a_hill_curve_is_found_again(pca50: float, n_hill: float, passive: float) -> None:
    found = fit_force_pca(PCA, hill_curve(PCA, pca50, n_hill, passive, 1.0))
    assert isinstance(found, ForcePca)
    assert found[:4] == pytest.approx((pca50, n_hill, passive, 1.0), abs=2e-3)
    assert found.rmsd_f0 < 1e-4


def test_standard_errors_are_those_of_repeated_noise() -> None:
    rng = np.random.default_rng(5)
    levels = np.linspace(5.0, 7.5, 16)
    truth = hill_curve(levels, 6.25, 3.0, 0.02, 1.0)
    fits = [fit_force_pca(levels, truth + 0.005 * rng.standard_normal(16)) for _ in range(300)]
    values = np.array([[f.pca50, f.n_hill] for f in fits if isinstance(f, ForcePca)])
    told = np.array([[f.pca50_se, f.n_hill_se] for f in fits if isinstance(f, ForcePca)], dtype=float)
    assert np.sqrt(np.mean(told**2, axis=0)) == pytest.approx(np.std(values, axis=0), rel=0.15)


@pytest.mark.parametrize(
    ("pca", "force"),
    [
        (PCA[:4], hill_curve(PCA[:4], 6.2, 3.0, 0.0, 1.0)),
        (PCA, np.full(6, 0.5)),
        (PCA, np.array([1.0, np.nan, np.nan, 0.1, 0.0, 0.0])),
        (PCA, np.array([0.0, 0.1, 0.5, 0.9, 1.0, 1.0])),
    ],
)
def test_no_curve_where_points_have_none(pca: Array, force: Array) -> None:
    found = fit_force_pca(pca, force)
    assert isinstance(found, Missing)
    assert found.why


def test_too_few_levels_are_told() -> None:
    found = fit_force_pca(PCA[:3], hill_curve(PCA[:3], 6.2, 3.0, 0.0, 1.0))
    assert found == Missing("isometric force is known at 3 levels of pCa; 5 are needed")


def test_five_points_leave_a_standard_error_and_four_levels_none() -> None:
    found = fit_force_pca(PCA[:5], hill_curve(PCA[:5], 6.2, 3.0, 0.0, 1.0) + np.array([0, 0.01, 0, -0.01, 0]))
    assert isinstance(found, ForcePca)
    assert found.pca50_se is not None
    assert 0.0 < found.pca50_se < 0.2


def released(step: float = 0.2, hold_s: float = 0.02) -> Array:
    """Length change of a release at 1 s, L0."""
    return np.where((TIME >= 1.0) & (1.0 + hold_s > TIME), -step, 0.0)


def recovering(k: float, start: float = 0.2, end: float = 0.9) -> Array:
    """Force that redevelops from 1.02 s on, F0."""
    rise = end - (end - start) * np.exp(-k * (TIME - 1.02))
    return np.where(TIME < 1.0, end, np.where(TIME < 1.02, 0.0, rise))


def test_the_end_of_a_restretch_is_found() -> None:
    assert restretch_end(TIME, released()) == pytest.approx(1.02)


@pytest.mark.parametrize(
    "length",
    [
        0.0 * TIME,
        released(step=0.04),
        released(hold_s=0.6),
        np.where(TIME > 1.0, -0.2, 0.0),
        -released(),
        np.zeros(2),
    ],
)
def test_other_movements_are_no_release_and_restretch(length: Array) -> None:
    found = restretch_end(TIME[: length.size], length)
    assert isinstance(found, Missing)
    assert "no release by 5 % L0 or more that is taken back within 0.5 s" in found.why


def test_two_releases_are_told() -> None:
    found = restretch_end(TIME, released() + np.roll(released(), 2000))
    assert isinstance(found, Missing)
    assert "released 2 times, at 1, 3 s" in found.why


@pytest.mark.parametrize("seed", [0, 7, 10, 11])
def test_a_long_noisy_record_is_fitted_without_overflow(seed: int) -> None:
    """Regression: on its way a fit tries exp(-k·t) with k far below zero."""
    time_s = np.arange(4000) * 0.02
    force = 1.0 - 0.4 * np.exp(-0.6 * time_s) + 0.2 * np.random.default_rng(seed).standard_normal(time_s.size)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = redevelopment(time_s, force, 0.0, 80.0)
    assert isinstance(found, Redevelopment)
    assert abs(found.k_per_s - 0.6) < 4.0 * found.se_per_s


@pytest.mark.parametrize(("drift_per_s", "told"), [(0.0, False), (-0.01, True), (0.01, True)])
def test_a_drift_of_force_is_told(drift_per_s: float, told: bool) -> None:
    """A hundredth of F0 per second moves k_tr of 3 1/s by 3 standard errors and more."""
    rest = TIME < 1.0
    count = 0
    for seed in range(10):
        noise = 0.004 * np.random.default_rng(seed).standard_normal(TIME.size)
        force = recovering(3.0) + drift_per_s * TIME + noise
        trial = Trial(
            TrialFacts("f", "t", phases=(Phase("isometric", 0.0, 1.0),)),
            TIME[rest], np.ones(rest.sum()), np.zeros(1), np.ones(1), TIME[rest], noise[rest] + 0.9,
        )  # fmt: skip
        found = redevelopment(TIME, force, 1.02, 6.0, force_noise(trial))
        assert isinstance(found, Redevelopment)
        count += "with a straight line k_tr is" in found.told
    assert count == 10 if told else count <= 1


def test_the_fit_ends_where_the_fibre_is_moved_again() -> None:
    length = released() + np.where(TIME >= 4.0, 0.05, 0.0)
    assert still_until(TIME, length, 1.02) == pytest.approx(3.999)


@pytest.mark.slow
@given(st.floats(0.5, 20.0))
def test_the_rate_of_an_exponential_is_found_again(k: float) -> None:
    found = redevelopment(TIME, recovering(k), 1.02, 6.0)
    assert isinstance(found, Redevelopment)
    assert found.k_per_s == pytest.approx(k, rel=1e-6)
    assert found.end_f0 == pytest.approx(0.9, abs=1e-6)


@pytest.mark.slow
def test_the_standard_error_of_k_tr_allows_for_slow_noise() -> None:
    """Noise of 50 ms memory: with residuals taken for independent the error would be a seventh of the true one."""
    rng = np.random.default_rng(8)
    rates, told = [], []
    for _ in range(100):
        noise = np.zeros(TIME.size)
        white = 0.002 * rng.standard_normal(TIME.size)
        for i in range(1, TIME.size):
            noise[i] = 0.98 * noise[i - 1] + white[i]
        found = redevelopment(TIME, recovering(3.0) + noise, 1.02, 6.0)
        assert isinstance(found, Redevelopment)
        rates.append(found.k_per_s)
        told.append(found.se_per_s)
    assert np.sqrt(np.mean(np.square(told))) == pytest.approx(np.std(rates), rel=0.3)


@pytest.mark.parametrize(
    "force",
    [
        recovering(3.0, start=0.85),
        recovering(3.0, start=1.3),
        np.where(TIME < 1.03, 0.0, 0.9),
        0.0 * TIME,
    ],
)
def test_no_rate_where_force_does_not_redevelop(force: Array) -> None:
    found = redevelopment(TIME, force, 1.02, 6.0)
    assert isinstance(found, Missing)
    assert found.why


def test_no_rate_of_a_short_record() -> None:
    found = redevelopment(TIME, recovering(3.0), 1.02, 1.15)
    assert found == Missing("force is followed for 0.125 s after the restretch; 0.2 s are needed")


def test_enhancement_by_hand() -> None:
    stretched, isometric = 1.2 + 0.0 * TIME, 0.9 + 0.0 * TIME[::10]
    found = enhancement(Side(TIME, stretched), Side(TIME[::10], isometric), 3.0)
    assert isinstance(found, Enhancement)
    assert found[:4] == pytest.approx((1.2, 0.9, 0.3, 1.0 / 3.0))
    assert found[4:] == (None, None)


def test_enhancement_takes_the_mean_of_a_tenth_of_a_second() -> None:
    # Rising force: the mean over 2.95 to 3.05 s is that at 3 s.
    found = enhancement(Side(TIME, TIME), Side(TIME, 1.0 + 0.0 * TIME), 3.0)
    assert isinstance(found, Enhancement)
    assert found.stretched_f0 == pytest.approx(3.0)


def test_no_enhancement_beyond_a_record() -> None:
    found = enhancement(Side(TIME, TIME), Side(TIME[:100], TIME[:100]), 3.0)
    assert found == Missing("the isometric trial has no force within 0.05 s of 3 s")
