"""The answer of a model."""

from __future__ import annotations

import numpy as np
import pytest

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.simulated import MOMENTS, Simulated


def test_arrays_are_copied_and_read_only() -> None:
    time_s = np.array([0.0, 1.0])
    made = Simulated(time_s, time_s, time_s, time_s, dict.fromkeys(MOMENTS, time_s))
    time_s[0] = 5.0
    assert made.time_s[0] == 0.0
    assert made.moments["q0"][0] == 0.0
    with pytest.raises(ValueError, match="read-only"):
        made.force_n[0] = 1.0


def test_a_missing_moment_and_a_wrong_shape_are_refused() -> None:
    time_s = np.array([0.0, 1.0])
    with pytest.raises(UserError, match="n_on"):
        Simulated(time_s, time_s, time_s, time_s, {"q0": time_s})
    with pytest.raises(UserError, match=r"force_n has shape \(1,\)"):
        Simulated(time_s, time_s[:1], time_s, time_s, dict.fromkeys(MOMENTS, time_s))
