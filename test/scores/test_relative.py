"""Relative SRS of fibres whose answers are known by hand."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from xb_muscle_ros.scores.relative import by_class, nanmean, nanmedian, nansd, over_fibres, rmsd
from xb_muscle_ros.trials.trial import Array

NAN = np.nan
LOW, HIGH = 1, 3


def one_class(test: list[float], unconditioned: list[float]) -> Array:
    """Relative SRS at low activation of a fibre with a value for each pCa, under each averaging."""
    pooled = by_class(np.array(test)[:, None], np.array(unconditioned), np.full(len(test), LOW))
    return np.array([over_fibres([pooled], how).centre[LOW, 0] for how in ("mean", "mean_of_trials")])


def test_means_of_a_class_go_before_the_ratio() -> None:
    # (10 + 2)/(20 + 2) against (10/20 + 2/2)/2
    assert one_class([10.0, 2.0], [20.0, 2.0]) == pytest.approx([12 / 22, 0.75])


def test_a_pca_counts_in_both_or_in_neither() -> None:
    assert one_class([10.0, NAN], [20.0, 1000.0]) == pytest.approx([0.5, 0.5])
    assert one_class([10.0, 3.0], [20.0, NAN]) == pytest.approx([0.5, 0.5])


def test_classes_are_kept_apart() -> None:
    pooled = by_class(np.array([[10.0], [30.0]]), np.array([20.0, 40.0]), np.array([LOW, HIGH]))
    assert pooled.test[[LOW, HIGH], 0].tolist() == [10.0, 30.0]
    assert np.isnan(pooled.test[[0, 2]]).all()


def test_an_unconditioned_stretch_without_force_has_no_ratio() -> None:
    assert np.isnan(one_class([10.0], [0.0])).all()


def fibres() -> list:
    """Three fibres at low activation: ratios 0.5, 0.8, -2 (a passive reference of next to nothing)."""
    pairs = [(10.0, 20.0), (8.0, 10.0), (0.2, -0.1)]
    return [by_class(np.array([[a]]), np.array([b]), np.array([LOW])) for a, b in pairs]


@pytest.mark.parametrize(
    ("averaging", "expected"),
    [("mean", (0.5 + 0.8 - 2.0) / 3), ("mean_of_trials", (0.5 + 0.8 - 2.0) / 3), ("median", 0.5)],
)
def test_averages_over_fibres(averaging: str, expected: float) -> None:
    found = over_fibres(fibres(), averaging)
    assert found.centre[LOW, 0] == pytest.approx(expected)
    assert found.n[LOW, 0] == 3
    assert found.sd[LOW, 0] == pytest.approx(np.std([0.5, 0.8, -2.0], ddof=1))


def test_ratio_of_means_over_fibres() -> None:
    assert over_fibres(fibres(), "ratio_of_means").centre[LOW, 0] == pytest.approx(18.2 / 29.9)


def test_fibres_that_were_not_tested_do_not_count() -> None:
    absent = by_class(np.array([[NAN]]), np.array([20.0]), np.array([LOW]))
    found = over_fibres([fibres()[0], absent])
    assert found.centre[LOW, 0] == 0.5
    assert found.n[LOW, 0] == 1
    assert np.isnan(found.sd[LOW, 0])


def test_rmsd_over_a_mask_by_hand() -> None:
    a, b = np.array([[1.0, 2.0], [NAN, 4.0]]), np.array([[1.5, 1.0], [3.0, 9.0]])
    where = np.array([[True, True], [True, False]])
    value, rss, count = rmsd(a, b, where)
    assert (rss, count) == (pytest.approx(1.25), 2)
    assert value == pytest.approx(np.sqrt(0.625))
    assert rmsd(a, b, ~np.ones((2, 2), dtype=bool)).value is None


@given(arrays(np.float64, (5, 3), elements=st.one_of(st.just(NAN), st.floats(-1e6, 1e6))))
def test_averages_without_nan_are_numpys(values: Array) -> None:
    some = np.any(np.isfinite(values), axis=0)
    assert nanmean(values)[some] == pytest.approx(np.nanmean(values[:, some], axis=0), rel=1e-9, abs=1e-6)
    assert nanmedian(values)[some] == pytest.approx(np.nanmedian(values[:, some], axis=0), rel=1e-9, abs=1e-6)
    assert np.isnan(nanmean(values)[~some]).all()
    assert np.isnan(nanmedian(values)[~some]).all()
    two = np.sum(np.isfinite(values), axis=0) > 1
    assert nansd(values)[two] == pytest.approx(np.nanstd(values[:, two], axis=0, ddof=1), rel=1e-6, abs=1e-4)
    assert np.isnan(nansd(values)[~two]).all()
