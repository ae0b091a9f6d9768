"""From log-odds to probability."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from xb_muscle_ros.diagnose.inference.calibration import OFFSET, SLOPE, calibrated


@given(st.floats(-1e6, 1e6), st.floats(-1e6, 1e6))
def test_probability_rises_with_the_odds_and_is_never_certain(one: float, other: float) -> None:
    low, high = sorted((one, other))
    assert 0.0 < calibrated(low) <= calibrated(high) < 1.0


def test_what_no_set_has_is_excluded_and_what_all_have_is_as_sure_as_can_be() -> None:
    assert calibrated(-math.inf) == 0.0
    assert 0.99 < calibrated(math.inf) < 1.0
    assert calibrated(math.inf) == calibrated(1e3)


@pytest.mark.parametrize("log_odds", [-3.0, 0.0, 1.5, 4.0])
def test_between_the_ends_it_is_the_line_that_was_fitted(log_odds: float) -> None:
    p = calibrated(log_odds)
    assert math.log(p / (1.0 - p)) == pytest.approx(OFFSET + SLOPE * log_odds)
