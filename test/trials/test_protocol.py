"""The stretch-shorten-stretch protocol."""

from __future__ import annotations

import numpy as np
import pytest

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.protocol import StretchShortenStretch


def test_corners_and_phases() -> None:
    protocol = StretchShortenStretch(0.0383, 0.1, lead_s=0.2, hold_s=0.3)
    times, lengths = protocol.corners()
    ramp = 0.0383 / 0.4545
    np.testing.assert_allclose(
        times, [0, 0.2, 0.2 + ramp, 0.2 + 2 * ramp, 0.3 + 2 * ramp, 0.3 + 3 * ramp, 0.6 + 3 * ramp]
    )
    np.testing.assert_allclose(lengths, [0, 0, 0.0383, 0, 0, 0.0383, 0.0383], atol=1e-15)
    assert [p.name for p in protocol.phases] == [
        "isometric",
        "conditioning_stretch",
        "shortening",
        "recovery",
        "test_stretch",
        "hold",
    ]


def test_reference_has_no_conditioning() -> None:
    names = [p.name for p in StretchShortenStretch(0.0, 0.1).phases]
    assert names == ["isometric", "recovery", "test_stretch", "hold"]


def test_trial_lies_on_whole_nanoseconds_within_the_protocol() -> None:
    protocol = StretchShortenStretch(0.0121, 0.316)
    trial = protocol.trial("f", 6.3, rate_hz=3000.0)
    np.testing.assert_array_equal(np.round(trial.time_s * 1e9) / 1e9, trial.time_s)
    assert protocol.corners()[0][-1] - 1 / 3000.0 < trial.time_s[-1] <= protocol.corners()[0][-1]
    assert trial.calcium_um[0] == pytest.approx(10**-0.3)
    assert trial.length_change_l0.max() == pytest.approx(0.0383, abs=0.4545 / 3000)


@pytest.mark.parametrize("wrong", [{"amplitude_l0": -0.1}, {"recovery_s": float("nan")}, {"speed_l0_per_s": 0.0}])
def test_impossible_protocols_are_named(wrong: dict[str, float]) -> None:
    with pytest.raises(UserError, match=next(iter(wrong))):
        StretchShortenStretch(**{"amplitude_l0": 0.01, "recovery_s": 0.1, **wrong})
