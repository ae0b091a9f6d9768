"""Draws of noise."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt
import pytest

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.scores.noise.model import NoiseModel
from xb_muscle_ros.scores.noise.windows import Window

Array = npt.NDArray[np.float64]
Windows = Callable[..., list[Window]]
ModelOf = Callable[[Sequence[Window]], NoiseModel]


def seconds(n: int) -> Array:
    """Times of samples at 1 kHz."""
    return np.arange(n) * 1e-3


def test_draws_have_the_size_and_colour_of_the_model(windows: Windows, model_of: ModelOf) -> None:
    model = model_of(windows(0, 300, humming=True))
    drawn = model.draw([seconds(4000)] * 5, 20, np.random.default_rng(1), uncertain=False).reshape(5, 4000, 20)
    for noise, values in zip(model.trials, drawn, strict=True):
        n = len(values)
        found = [np.mean(np.sum(values[: n - k] * values[k:], axis=0)) / n for k in range(31)]
        assert np.allclose(found, noise.likeliest.autocovariance(31), atol=0.06 * noise.sd_f0**2)
        # 60 Hz: half a period is 8 samples.
        assert noise.likeliest.autocovariance(9)[8] < 0.2 * noise.sd_f0**2


def test_unknown_trial_is_named(windows: Windows, model_of: ModelOf) -> None:
    with pytest.raises(UserError, match="no noise is known of trial 'x'; known: t0"):
        model_of(windows(0, 60)).of(["x"])
