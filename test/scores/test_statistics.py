"""AIC and paired tests against values worked out by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.stats import t as student

from xb_muscle_ros.scores.statistics import aic, bonferroni_threshold, paired_t


def test_aic_by_hand() -> None:
    # 84 observations, RSS 84 e^-3: 2·11 - 3·84
    assert aic(84.0 * math.exp(-3.0), 84, 11) == pytest.approx(22.0 - 252.0)


def test_a_parameter_costs_two() -> None:
    assert (aic(1.0, 84, 12) or 0.0) - (aic(1.0, 84, 11) or 0.0) == pytest.approx(2.0)


@pytest.mark.parametrize(("rss", "observations"), [(0.0, 84), (1.0, 0), (1.0, 12)])
def test_no_aic_without_anything_to_judge_by(rss: float, observations: int) -> None:
    assert aic(rss, observations, 11) is None


def test_paired_t_by_hand() -> None:
    found = paired_t([1.0, 2.0, 3.0, 4.0], [2.0, 4.0, 4.0, 7.0])
    # differences 1 2 1 3: mean 1.75, s.d. sqrt(11/12), t = 1.75/(s.d./2)
    sd = math.sqrt(11.0 / 12.0)
    assert (found.n, found.difference, found.sd) == (4, 1.75, pytest.approx(sd))
    assert found.t == pytest.approx(3.5 / sd)
    assert found.p == pytest.approx(2.0 * student.sf(3.5 / sd, 3))


def test_fibres_without_a_partner_are_left_out() -> None:
    found = paired_t([1.0, np.nan, 3.0, 9.0], [2.0, 4.0, 5.0, np.nan])
    assert (found.n, found.difference) == (2, 1.5)


@pytest.mark.parametrize(
    ("first", "second"), [([], []), ([1.0], [2.0]), ([1.0, 2.0], [2.0, 3.0]), ([0.1, 0.3], [0.1 + 0.2, 0.5])]
)
def test_no_p_where_differences_do_not_vary(first: list[float], second: list[float]) -> None:
    assert paired_t(first, second).p is None


def test_the_papers_threshold() -> None:
    assert bonferroni_threshold(15) == pytest.approx(0.0033, abs=5e-5)
    assert bonferroni_threshold(0) == 0.05
