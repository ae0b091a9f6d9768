"""Profile likelihood intervals of a straight model, held against what linear theory says of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest
from scipy.stats import norm

from xb_muscle_ros.fit.coordinates import Coordinate
from xb_muscle_ros.fit.data import FitTrial
from xb_muscle_ros.fit.ends import BOUND, DATA, PRIOR
from xb_muscle_ros.fit.noise import Scale, noise_at
from xb_muscle_ros.fit.problem import Problem
from xb_muscle_ros.fit.solve import Objective, Solution, descend
from xb_muscle_ros.fit.training import Training
from xb_muscle_ros.fit.uncertainty import curvature, profile_side
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.simulation.made import coloured_noise

Array = npt.NDArray[np.float64]
N = 300
LEVEL, WANTED = 0.95, float(norm.ppf(0.975))


class Straight(Training):
    """Force that is linear in the coordinates."""

    def __init__(self, problem: Problem, matrix: Array) -> None:
        super().__init__(problem)
        self.matrix = matrix

    def force(self, z: Array) -> Array:
        return np.asarray(self.matrix @ z)

    def feature_distance(self, z: Array) -> Array:
        return np.empty(0)

    def slopes(self, z: Array) -> tuple[Array, Array]:
        return self.matrix, np.empty((0, z.size))


def objective_of(fibre: Fibre, coordinates: tuple[Coordinate, ...], seed: int = 0) -> Objective:
    """Two trials of coloured noise on a level, a slope and a half wave, of which each coordinate is a mix."""
    random = np.random.default_rng(seed)
    time_s = 1e-3 * np.arange(N)
    shape = np.column_stack([np.ones(N), time_s / time_s[-1], np.sin(np.pi * time_s / time_s[-1])])
    matrix = 0.1 * np.concatenate([shape, shape @ np.diag([1.0, -1.0, 0.5])])[:, : len(coordinates)]
    measured = matrix @ np.ones(len(coordinates)) + np.concatenate([coloured_noise(random, N) for _ in range(2)])
    trials = tuple(
        FitTrial(name, "pCa 6", i, False, 1.0, None, True, time_s, time_s, time_s, time_s, part)
        for i, (name, part) in enumerate(zip("ab", np.split(measured, 2), strict=True))
    )
    return Objective(Straight(Problem(fibre, trials, coordinates, {}), matrix), Scale(1e-3, 30.0))


def free(name: str) -> Coordinate:
    return Coordinate(name, None, False, -50.0, 50.0, 0.0, 0.0, np.inf)


def best_of(objective: Objective) -> Solution:
    return descend(objective, objective.training.problem.start)


def test_covariance_is_the_sandwich_of_the_dense_noise(start: Fibre) -> None:
    objective = objective_of(start, (free("f"), free("k21"), free("kse")))
    best = best_of(objective)
    training, j, weights = objective.training, objective.training.slopes(best.z)[0], objective.weights()
    noise = noise_at(training, best.z, training.slopes(best.z))
    time_s = noise.times_s[0]
    gamma = np.zeros((2 * N, 2 * N))
    for tau_s, share, p, variances in zip(
        noise.taus_s, noise.shares, noise.probability, noise.variances_f0.T, strict=True
    ):
        unit = share * np.exp(-np.abs(time_s[:, None] - time_s) / tau_s) + (1.0 - share) * np.eye(N)
        gamma += p * np.kron(np.diag(variances), unit)
    inverse = np.linalg.inv((j * weights[:, None] ** 2).T @ j)
    score = j * weights[:, None] ** 2
    found = curvature(objective, best.z)
    assert found.covariance == pytest.approx(inverse @ (score.T @ gamma @ score) @ inverse, rel=1e-6)
    assert found.inflation == pytest.approx(np.diag(found.covariance) / np.diag(inverse), rel=1e-6)
    assert not np.any(found.weak)


@pytest.mark.parametrize("index", [0, 1, 2])
@pytest.mark.parametrize("up", [False, True])
def test_a_straight_profile_ends_where_the_normal_interval_does(start: Fibre, index: int, up: bool) -> None:
    objective = objective_of(start, (free("f"), free("k21"), free("kse")))
    best = best_of(objective)
    shape = curvature(objective, best.z)
    sd = float(np.sqrt(shape.covariance[index, index]))
    side = profile_side(objective, best, index, up, shape, LEVEL)
    assert side.ended_by == DATA
    assert side.better is None
    # Every point lies on the straight line that the root of a parabola is.
    for at, root in side.points:
        assert root == pytest.approx(abs(at - best.z[index]) / sd, abs=1e-4)
    assert side.end == pytest.approx(best.z[index] + (1.0 if up else -1.0) * WANTED * sd, abs=0.05 * sd)


def test_a_prior_narrows_the_profile_and_is_said_to_end_it(start: Fibre) -> None:
    """A prior ten times as sure as the data: the interval is the posterior's."""
    plain = objective_of(start, (free("f"), free("k21")))
    information = 1.0 / np.linalg.inv(plain.slopes(np.zeros(2)).T @ plain.slopes(np.zeros(2)))[1, 1]
    sure = replace(free("k21"), prior_mean=1.0, prior_sd=float((10.0 * information) ** -0.5))
    objective = objective_of(start, (free("f"), sure))
    best = best_of(objective)
    shape = curvature(objective, best.z)
    side = profile_side(objective, best, 1, True, shape, LEVEL)
    assert side.ended_by == PRIOR
    assert side.end - best.z[1] == pytest.approx(WANTED * float(np.sqrt(shape.covariance[1, 1])), rel=0.04)
    # Where the prior tells ten times as much, its variance is the posterior's within a tenth.
    assert shape.prior_share[1] == pytest.approx(10.0 / 11.0, rel=1e-6)


def test_a_bound_ends_a_profile_that_the_data_do_not(start: Fibre) -> None:
    coordinates = (free("f"), replace(free("k21"), upper=1.002), free("kse"))
    objective = objective_of(start, coordinates)
    best = best_of(objective)
    shape = curvature(objective, best.z)
    assert best.z[1] + WANTED * np.sqrt(shape.covariance[1, 1]) > 1.002
    side = profile_side(objective, best, 1, True, shape, LEVEL)
    assert (side.end, side.ended_by) == (1.002, BOUND)
