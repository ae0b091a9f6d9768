"""Rates that files tell, beside those of their times."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from xb_muscle_ros.trials.readers.rates import other_rate, rate_warning
from xb_muscle_ros.trials.trial import Array

TIME_S = np.arange(300) / 1000


def test_rates_are_compared() -> None:
    time_s = np.arange(10) / 1000
    assert rate_warning(Path("a"), 1005.0, time_s) == ()
    assert rate_warning(Path("a"), None, time_s) == ()
    assert rate_warning(Path("a"), 1000.0, np.zeros(4)) == ()
    (line,) = rate_warning(Path("a"), 2000.0, time_s)
    assert line == "a: the header says 2000 Hz, the time column 1000 Hz; the time column is used"


@pytest.mark.parametrize(
    ("time_s", "stated_hz", "found_hz"),
    [
        (TIME_S, 1000.0, None),
        (TIME_S, 2000.0, 1000.0),
        (np.concatenate([TIME_S, TIME_S]), 1000.0, None),  # it starts anew
        (np.delete(TIME_S, slice(100, 200)), 1000.0, None),  # samples are missing
        ((np.arange(300) / 2000).round(3), 2000.0, None),  # two samples share a time
        ((np.arange(300) / 300).round(3), 300.0, None),  # steps of 3 and 4 ms
        (TIME_S.round(2), 500.0, 1000.0),  # ten samples share a time
    ],
)
def test_rounded_times_and_gaps_are_no_other_rate(time_s: Array, stated_hz: float, found_hz: float | None) -> None:
    assert other_rate(stated_hz, time_s) == (None if found_hz is None else pytest.approx(found_hz, rel=0.05))
