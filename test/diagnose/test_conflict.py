"""Parts of a study that want other parameters."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from xb_muscle_ros.diagnose.conflict import conflicts
from xb_muscle_ros.errors import UserError

GROUPS = ("high", "high", "high", "low", "low")


def change(study: Any, high: float, low: float) -> np.ndarray:  # type: ignore[type-arg]
    """One parameter's doing, of another size in each part."""
    size = np.repeat([high if g == "high" else low for g in GROUPS], study.sizes)
    return np.asarray(size * study.fit.slopes[:, 0])


def test_conflict_is_found_and_its_parameter_named(study: Any, model_of: Any) -> None:
    noise = study.noise(np.random.default_rng(0))
    model = model_of(study.windows(noise))
    rows = conflicts(study.after(noise + change(study, 0.1, -0.1)), GROUPS, study.fit, model)
    assert rows[0].p_value < 0.01
    assert rows[0].gain_f0 > 0.003
    moves = {row.group: row.moves for row in rows}
    assert int(np.argmax(np.abs(moves["low"][:8]))) == 0
    assert moves["high"][0] > 0.0 > moves["low"][0]


def test_parameter_that_all_share_is_no_conflict(study: Any, model_of: Any) -> None:
    noise = study.noise(np.random.default_rng(1))
    model = model_of(study.windows(noise))
    for row in conflicts(study.after(noise + change(study, 0.2, 0.2)), GROUPS, study.fit, model):
        assert row.p_value > 0.05
        assert row.gain_f0 < 0.002


def test_errors_are_one_line(study: Any, model_of: Any) -> None:
    model = model_of(study.windows(study.noise(np.random.default_rng(2))))
    with pytest.raises(UserError, match="1 parts for 5 trials"):
        conflicts(study.residuals, ["a"] * 5, study.fit, model)
