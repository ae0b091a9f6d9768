"""Noise behind the residual of a fit, against noise that is known and against the dense covariance."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from xb_muscle_ros.scores.noise.ornstein_uhlenbeck import SHARES, TAUS_S, Whitened
from xb_muscle_ros.scores.noise.residual import LEAST_SD_F0, ResidualNoise, residual_noise
from xb_muscle_ros.simulation.made import coloured_noise

Array = npt.NDArray[np.float64]


def covariance(time_s: Array, point: int) -> Array:
    """Of noise of variance 1 at a point of the grid."""
    decaying = np.exp(-np.abs(time_s[:, None] - time_s) / TAUS_S[point])
    return np.asarray(SHARES[point] * decaying + (1.0 - SHARES[point]) * np.eye(time_s.size))


@pytest.mark.slow
def test_noise_is_found_behind_what_a_fit_took_of_it() -> None:
    """Slow regressors take the slow part of coloured noise away; restricted, its size and autocorrelation come back."""
    random = np.random.default_rng(3)
    n, trials = 420, 6
    time_s = 1e-3 * np.arange(n)
    slow = np.stack([np.cos(np.pi * k * np.arange(n) / n) for k in range(3)], axis=1)
    slow /= np.linalg.norm(slow, axis=0)
    basis = np.kron(np.eye(trials), slow)
    plain: list[float] = []
    restricted: list[float] = []
    # Variance of a slow sum, which is what makes a slow parameter uncertain.
    share = 1.0 - np.arange(n) / n
    for _ in range(8):
        noise = np.concatenate([coloured_noise(random, n) for _ in range(trials)])
        residual = list((noise - basis @ (basis.T @ noise)).reshape(trials, n))
        for target, slopes in ((plain, np.zeros((trials * n, 0))), (restricted, basis)):
            count = slopes.shape[1]
            found = residual_noise([time_s] * trials, residual, np.split(slopes, trials), np.zeros((count, count)))
            target += [float(found.covariance_of_sums(i, np.ones((n, 1)))[0, 0]) / n for i in range(trials)]
    true = 1e-6 * (2.0 * float(share @ 0.95 ** np.arange(n)) - 1.0)
    assert np.mean(plain) < 0.7 * true
    assert np.mean(restricted) == pytest.approx(true, rel=0.3)


def test_the_scale_of_each_trial_is_its_own_and_priors_take_less(made: Any) -> None:
    """Trials of one autocorrelation and of sizes 1 to 4, unevenly sampled; a tight prior leaves the noise in."""
    random = np.random.default_rng(1)
    sds = np.array([1e-3, 2e-3, 4e-3])
    times = [np.cumsum(random.uniform(0.5e-3, 2e-3, 600)) for _ in sds]
    noise = [sd * made.fading_noise(random, t, 0.02, 0.9) for sd, t in zip(sds, times, strict=True)]
    free, tight = (
        residual_noise(times, noise, [np.ones((600, 1))] * 3, np.array([[information]])) for information in (0.0, 1e12)
    )
    for found in (free, tight):
        assert np.sqrt(found.variance_f0) == pytest.approx(sds, rel=0.25)
        assert [found.autocorrelation_samples(i) for i in range(3)] == pytest.approx([30.0] * 3, rel=0.6)
    # Without a level to take, the noise is all that the residual is.
    assert tight.variance_f0 == pytest.approx([np.mean(e**2) for e in noise], rel=0.25)


@pytest.mark.parametrize("point", [0, 40, 103])
def test_whitening_and_sums_are_those_of_the_dense_covariance(point: int) -> None:
    random = np.random.default_rng(0)
    time_s = np.cumsum(random.uniform(1e-4, 0.1, 40))
    values, regressors = random.normal(size=40), random.normal(size=(40, 2))
    columns, dense = np.column_stack([values, regressors]), covariance(time_s, point)
    found = Whitened(time_s, values, regressors)
    assert found.products[point] == pytest.approx(columns.T @ np.linalg.solve(dense, columns), rel=1e-8)
    assert found.log[point] == pytest.approx(np.linalg.slogdet(dense)[1], rel=1e-8)
    one = np.where(np.arange(TAUS_S.size) == point, 1.0, 0.0)
    noise = ResidualNoise((time_s,), TAUS_S, SHARES, one, np.full((1, TAUS_S.size), 4.0))
    assert noise.covariance_of_sums(0, regressors) == pytest.approx(4.0 * regressors.T @ dense @ regressors, rel=1e-8)


def test_no_coordinates_and_no_trials() -> None:
    time_s = 1e-3 * np.arange(200.0)
    alone = residual_noise([time_s], [np.zeros(200)], [np.zeros((200, 0))], np.zeros((0, 0)))
    assert np.sqrt(alone.variance_f0) == pytest.approx([LEAST_SD_F0])
    assert residual_noise([], [], [], np.eye(2)).variance_f0.shape == (0,)
