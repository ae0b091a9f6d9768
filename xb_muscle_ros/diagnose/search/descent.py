"""From a start to the best point of one set in one fibre: Levenberg–Marquardt on a scale that is found on the way.

A residual that no set explains is no noise of known size. So the cost is the logarithm of the residuals' mean square
(the likelihood with its scale profiled out), counted for as many independent residuals as there are, beside the
priors': (n/2) log(s0² + R/n) + |distance from the priors|²/2. Each step solves the normal equations at the scale that
the residuals have there, which can only lower that cost (the logarithm lies below its tangents).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.diagnose.search.system import Names, System, ordered
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.fit.problem import Problem
from xb_muscle_ros.fit.training import Training
from xb_muscle_ros.trials.trial import Array

# Longest move of a step: of a logarithm, and of others in units of their prior's standard deviation.
_LONGEST_LOG, _LONGEST_SD = 1.0, 3.0
_REJECTED = 6


@dataclass(frozen=True)
class Fit:
    """The best point found of a set in one fibre.

    Attributes:
        values: of all coordinates by label, in their units.
        mean_square_f0: of the residuals, weighted, F0².
        prior: half the squared distance from the priors and from features, in standard deviations.
        occam: half the logarithm of how many times narrower the posterior is than the priors (Laplace).
        sds: posterior standard deviation of every coordinate by label, on the moved scale (logarithms where fitted so).
        simulated: simulations of all trials that it took.
    """

    names: Names
    values: Mapping[str, float]
    mean_square_f0: float
    prior: float
    occam: float
    sds: Mapping[str, float]
    simulated: int

    @property
    def rmsd_f0(self) -> float:
        """Of the weighted residuals, F0."""
        return float(np.sqrt(self.mean_square_f0))

    def cost(self, system: System, floor_f0: float | None = None) -> float:
        """See the module; the floor is the system's noise unless another is given, F0."""
        return self.prior - system.log_likelihood(self.mean_square_f0, floor_f0)

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        return {**self.__dict__, "names": list(self.names)}

    @staticmethod
    def from_json(row: Mapping[str, Any]) -> Fit:
        """From plain data."""
        return Fit(**{**row, "names": ordered(row["names"])})


@dataclass
class Point:
    """A point of a problem with its residuals.

    Attributes:
        residual: simulated less measured force, F0.
        mean_square: weighted, F0².
        prior, feature: distances from the priors and from the features, in standard deviations.
    """

    z: Array
    residual: Array
    mean_square: float
    prior: Array
    feature: Array

    @property
    def penalty(self) -> float:
        """Half the squared distances."""
        return 0.5 * float(self.prior @ self.prior + self.feature @ self.feature)


class Descent:
    """Walks of one problem; counts what it simulates.

    Raises:
        UserError: the model has no solution at the start.
    """

    def __init__(self, system: System, problem: Problem) -> None:
        self.system, self.problem = system, problem
        self.training = Training(problem)
        self.total = float(np.sum(system.weights))
        self.lower, self.upper = problem.bounds
        sds = np.array([c.prior_sd for c in problem.coordinates])
        self.information = problem.information
        logs = np.array([c.log for c in problem.coordinates], dtype=bool)
        self.longest = np.where(logs, _LONGEST_LOG, np.where(np.isfinite(sds), _LONGEST_SD * sds, np.inf))
        self.simulated = 0.0
        # Slopes of the features where the last ones of the force were taken.
        self.of_features = np.zeros((len(self.training.features), len(problem.coordinates)))
        self.moving = np.array([c.group is None or not c.group for c in problem.coordinates])

    def at(self, z: Array) -> Point:
        """A point.

        Raises:
            UserError: the model has no solution there.
        """
        residual = self.training.force(z) - self.training.measured
        self.simulated += 1.0
        if not np.all(np.isfinite(residual)):
            raise UserError(f"fibre {self.system.fibre.name}: the simulated force is not finite; start elsewhere")
        mean_square = float(self.system.weights @ residual**2) / self.total
        return Point(z, residual, mean_square, self.problem.prior(z), self.training.feature_distance(z))

    def cost(self, point: Point) -> float:
        """See the module."""
        return point.penalty - self.system.log_likelihood(point.mean_square)

    def sample_weights(self, point: Point) -> Array:
        """Information of each sample at the scale that the residuals of a point have, shape (samples,), 1/F0²."""
        scale = self.system.effective_samples / self.total / (self.system.noise_f0**2 + point.mean_square)
        out: Array = scale * self.system.weights
        return out

    def slopes(self, point: Point) -> Array:
        """Of the recorded force by the coordinates, shape (samples, coordinates), F0."""
        found, features = self.training.slopes(point.z)
        self.of_features = np.nan_to_num(features, nan=0.0, posinf=0.0, neginf=0.0)
        self.simulated += float(np.count_nonzero([c.group is None for c in self.problem.coordinates]))
        return np.nan_to_num(found, nan=0.0, posinf=0.0, neginf=0.0)

    def normal(self, point: Point, slopes: Array) -> tuple[Array, Array]:
        """Curvature and gradient of the cost at the scale that the residuals have."""
        weighted = slopes * self.sample_weights(point)[:, None]
        curvature = weighted.T @ slopes + np.diag(self.information) + self.of_features.T @ self.of_features
        means = np.array([c.prior_mean for c in self.problem.coordinates])
        gradient = weighted.T @ point.residual + self.information * (point.z - means)
        gradient += self.of_features.T @ point.feature
        return curvature, gradient

    def walk(self, z: Array, most: int, tolerance: float, slopes: Array | None = None) -> tuple[Point, Array]:
        """Down from a start, with at most so many Jacobians; the point and slopes at or near it.

        Args:
            z: start on the moved scale.
            tolerance: fall of the cost at which to stop, in its own unit.
            slopes: at the start, where they are known.

        Raises:
            UserError: no solution at the start.
        """
        point = self.at(np.clip(z, self.lower, self.upper))
        cost, damping = self.cost(point), 1e-3
        jacobian = self.slopes(point) if slopes is None else slopes
        taken, fresh = 1, True
        while True:
            step = self._step(point, jacobian, cost, damping)
            if step is None:
                if fresh or taken >= most:
                    return point, jacobian
                jacobian, fresh, taken = self.slopes(point), True, taken + 1
                continue
            new, new_cost, damping = step
            gained, moved = cost - new_cost, new.z - point.z
            # Broyden's update serves for the next step; the one after it has slopes of its own.
            change = new.residual - point.residual - jacobian @ moved
            updated = jacobian + np.outer(change, moved) / max(float(moved @ moved), 1e-300)
            point, cost = new, new_cost
            if gained < tolerance and fresh:
                return point, updated
            if taken >= most and (not fresh or gained < tolerance):
                return point, updated
            if fresh:
                jacobian, fresh = updated, False
            elif taken < most:
                jacobian, fresh, taken = self.slopes(point), True, taken + 1
            else:
                return point, updated

    def free(self, point: Point, gradient: Array) -> npt.NDArray[np.bool_]:
        """Coordinates that no bound stops, shape (coordinates,)."""
        stopped = ((point.z <= self.lower) & (gradient > 0.0)) | ((point.z >= self.upper) & (gradient < 0.0))
        out: npt.NDArray[np.bool_] = ~stopped
        return out

    def _step(self, point: Point, jacobian: Array, cost: float, damping: float) -> tuple[Point, float, float] | None:
        """The next point, its cost and the damping to go on with; None where nothing is lower."""
        curvature, gradient = self.normal(point, jacobian)
        free = self.free(point, gradient)
        if not np.any(free):
            return None
        within = np.ix_(free, free)
        diagonal = np.diag(np.diag(curvature[within]))
        for _ in range(_REJECTED):
            step = np.zeros_like(point.z)
            step[free] = -np.linalg.solve(curvature[within] + damping * diagonal, gradient[free])
            step *= min(1.0, float(np.min(self.longest / np.maximum(np.abs(step), 1e-300))))
            z = np.clip(point.z + step, self.lower, self.upper)
            try:
                new = self.at(z)
            except UserError:
                damping = max(10.0 * damping, 1e-2)
                continue
            new_cost = self.cost(new)
            if new_cost < cost:
                return new, new_cost, max(0.2 * damping, 1e-7)
            damping = max(8.0 * damping, 1e-3)
        return None

    def fit(self, names: Names, point: Point, slopes: Array) -> Fit:
        """The record of a point with the slopes there."""
        values = {c.label: c.outward(float(z)) for c, z in zip(self.problem.coordinates, point.z, strict=True)}
        curvature, _ = self.normal(point, slopes)
        known = self.information > 0.0
        widths = self.information[known] ** -0.5
        _, twice = np.linalg.slogdet(curvature[np.ix_(known, known)] * widths * widths[:, None])
        # Where rounding hides what the data tell of a coordinate, they tell nothing.
        variances = np.diag(np.linalg.pinv(curvature))
        priors = np.where(known, np.maximum(self.information, 1e-300) ** -0.5, np.inf)
        sds = np.where(variances > 0.0, np.sqrt(np.maximum(variances, 0.0)), priors)
        sds = np.minimum(sds, priors)
        by_label = {c.label: float(sd) for c, sd in zip(self.problem.coordinates, sds, strict=True)}
        return Fit(
            ordered(names),
            values,
            point.mean_square,
            point.penalty,
            0.5 * float(twice),
            by_label,
            round(self.simulated),
        )


def fit_task(task: Mapping[str, Any]) -> dict[str, Any] | None:
    """Fit a set from the best of several starts; None where the model has no solution at any."""
    system = System.from_json(task["system"])
    found = fitted(system, task["names"], task["starts"], task["most"], task["tolerance"])
    return None if found is None else found.to_json()


def fitted(
    system: System, names: Collection[str], starts: Sequence[Mapping[str, float]], most: int, tolerance: float
) -> Fit | None:
    """Fit a set from the best of several starts; None where the model has no solution at any."""
    begun: list[tuple[float, Descent, Array, Array | None]] = []
    for start in starts:
        try:
            problem = system.problem(names, start)
            descent = Descent(system, problem)
            if len(starts) == 1:
                begun.append((0.0, descent, problem.start, None))
                continue
            point, near = descent.walk(problem.start, 2, tolerance)
            begun.append((descent.cost(point), descent, point.z, near))
        except (UserError, np.linalg.LinAlgError):
            continue
    for _, descent, z, _near in sorted(begun, key=lambda b: b[0]):
        try:
            point, slopes = descent.walk(z, most, tolerance)
            return descent.fit(ordered(names), point, slopes)
        except (UserError, np.linalg.LinAlgError):
            continue
    return None
