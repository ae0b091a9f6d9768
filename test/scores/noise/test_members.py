"""Models of noise: what they draw, and how well a mean is known beside them."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import toeplitz

from xb_muscle_ros.scores.noise.members import SILENCE, OrnsteinUhlenbeck, Regression

Array = npt.NDArray[np.float64]


def covariance(process: OrnsteinUhlenbeck, time_s: Array) -> Array:
    """Of noise at all pairs of times, F0²."""
    fading = np.exp(-np.abs(time_s[:, None] - time_s) / process.tau_s)
    return process.sd_f0**2 * (process.share * fading + (1.0 - process.share) * np.eye(time_s.size))


def test_process_draws_noise_of_its_covariance(made: Any) -> None:
    time_s, process = made.spreading_times(0.1, 2.0), OrnsteinUhlenbeck(2e-3, 0.8, 0.05)
    drawn = process.draw(time_s, np.ones(20_000), np.random.default_rng(0))
    assert np.allclose(drawn.T @ drawn / 20_000, covariance(process, time_s), atol=0.04 * process.sd_f0**2)


def test_factors_make_draws_larger() -> None:
    time_s = np.arange(2000) * 1e-3
    for member in (
        OrnsteinUhlenbeck(1e-3, 0.5, 0.01),
        Regression(np.array([0.5]), 1e-3, 1e-3 / 0.75**0.5, np.array([1.0, 0.5])),
    ):
        sizes = np.std(member.draw(time_s, np.array([1.0, 3.0]), np.random.default_rng(0)), axis=1)
        assert sizes == pytest.approx(member.sd_f0 * np.array([1.0, 3.0]), rel=0.1)
        twice = np.std(member.times(2.0).draw(time_s, np.ones(1), np.random.default_rng(0)))
        assert twice == pytest.approx(2.0 * member.sd_f0, rel=0.1)


@settings(max_examples=50, deadline=None)
@given(
    st.lists(st.floats(1e-4, 10.0), min_size=1, max_size=60), st.floats(1e-5, 0.1), st.floats(0, 1), st.floats(1e-4, 10)
)
def test_variance_of_mean_is_that_of_the_covariance(steps_s: list[float], sd: float, share: float, tau: float) -> None:
    time_s, process = np.concatenate([[0.0], np.cumsum(steps_s)]), OrnsteinUhlenbeck(sd, share, tau)
    expected = float(np.sum(covariance(process, time_s))) / time_s.size
    assert process.variance_of_mean(time_s) == pytest.approx(expected, rel=1e-6)


def test_autocovariance_of_an_autoregression() -> None:
    member = Regression(np.array([0.9]), np.sqrt(1.0 - 0.9**2), 1.0, np.array([1.0, 0.9]))
    np.testing.assert_allclose(member.autocovariance(30), 0.9 ** np.arange(30), rtol=1e-12)
    np.testing.assert_allclose(SILENCE.autocovariance(10), [1e-10, *[0.0] * 9])
    r = member.draw(np.arange(200_000) * 1e-3, np.ones(1), np.random.default_rng(0))[0]
    found = [np.mean(r[: r.size - k] * r[k:]) for k in range(30)]
    np.testing.assert_allclose(found, member.autocovariance(30), atol=0.05)


def test_variance_of_mean_of_a_regression() -> None:
    member = Regression(np.array([0.9]), 1e-3 * np.sqrt(1.0 - 0.9**2), 1e-3, np.array([1.0, 0.9]))
    expected = 1e-6 * np.sum(toeplitz(0.9 ** np.arange(50))) / 50.0
    assert member.variance_of_mean(np.arange(50) * 1e-3) == pytest.approx(expected, rel=1e-4)
