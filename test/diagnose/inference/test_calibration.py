"""From log-odds to probability."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from xb_muscle_ros.diagnose.inference.calibration import CONSTANTS, PRACTICAL_F0, calibrated

SIZES = st.floats(0.0, 1.0)


@given(st.floats(-1e6, 1e6), st.floats(-1e6, 1e6), SIZES)
def test_probability_rises_with_the_odds_and_is_never_certain(one: float, other: float, size: float) -> None:
    low, high = sorted((one, other))
    assert 0.0 < calibrated(low, size) <= calibrated(high, size) < 1.0


@given(st.floats(-50.0, 50.0), SIZES, SIZES)
def test_what_takes_off_less_than_is_of_use_is_less_likely(log_odds: float, one: float, other: float) -> None:
    small, large = sorted((one, other))
    assert calibrated(log_odds, small) <= calibrated(log_odds, large)
    # A large contribution is no evidence of its own.
    assert calibrated(log_odds, PRACTICAL_F0) == calibrated(log_odds, 100.0 * PRACTICAL_F0)


def test_what_no_set_has_is_excluded_and_what_all_have_is_as_sure_as_can_be() -> None:
    assert calibrated(-math.inf, 1.0) == 0.0
    assert 0.99 < calibrated(math.inf, 1.0) < 1.0
    assert calibrated(math.inf, 1.0) == calibrated(1e3, 1.0)


@pytest.mark.parametrize("log_odds", [-3.0, 0.0, 1.5, 4.0])
@pytest.mark.parametrize("share", [0.3, 1.0])
def test_between_the_ends_it_is_the_line_that_was_chosen(log_odds: float, share: float) -> None:
    p = calibrated(log_odds, share * PRACTICAL_F0)
    assert math.log(p / (1.0 - p)) == pytest.approx(
        CONSTANTS.offset + CONSTANTS.slope * log_odds + CONSTANTS.size * math.log(share)
    )
