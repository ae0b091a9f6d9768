"""The training data and the model's answer to them at points, with its slopes."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.fit import features
from xb_muscle_ros.fit.coordinates import Coordinate
from xb_muscle_ros.fit.problem import Problem, moves_simulation, touches
from xb_muscle_ros.measurement.artefacts import ARTEFACTS
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.trials.trial import Array

# Step of the slopes on the moved scale, against errors of the steps of 1e-6: wrong by some 1e-4.
_STEP = 1e-4


class Training:
    """Training data and the model's answer at points: forces of trials, then features; remembers the last point."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.trials = tuple(t for t in problem.trials if not t.held_out and t.weight > 0.0)
        self.features = tuple(f for f in problem.features if not f.held_out)
        self.sizes = [t.measured_f0.size for t in self.trials]
        self.ends = np.cumsum([0, *self.sizes])
        self.measured = np.concatenate([t.measured_f0 for t in self.trials] + [np.empty(0)])
        self._at: tuple[bytes, list[Array]] | None = None

    def slices(self) -> list[slice]:
        """Where each trial lies in the concatenated forces."""
        return [slice(a, b) for a, b in zip(self.ends[:-1], self.ends[1:], strict=True)]

    def force(self, z: Array) -> Array:
        """Recorded force of all training trials, concatenated, F0.

        Raises:
            UserError: see `Problem.true_forces`.
        """
        true = self.true_forces(z)
        found = [self.problem.recorded(z, t, f) for t, f in zip(self.trials, true, strict=True)]
        return np.concatenate([*found, np.empty(0)])

    def feature_distance(self, z: Array) -> Array:
        """Model minus measured feature in standard deviations, shape (features,).

        Raises:
            UserError: see `features.simulated`.
        """
        if not self.features:
            return np.empty(0)
        found = features.simulated(Muscle(self.problem.fibre_at(z)), self.features, self.problem.solution_shifts(z))
        distance: Array = (found - [f.value for f in self.features]) / [f.sd for f in self.features]
        correction = self.problem.correction
        return distance if correction is None else distance + correction.of_features(z)

    def true_forces(self, z: Array) -> list[Array]:
        """The fibre's force in each training trial before the recording's faults, F0.

        Raises:
            UserError: see `Problem.true_forces`.
        """
        key = z.tobytes()
        if self._at is None or self._at[0] != key:
            muscle = Muscle(self.problem.fibre_at(z))
            self._at = (key, self.problem.true_forces(muscle, z, self.trials))
        return self._at[1]

    def slopes(self, z: Array) -> tuple[Array, Array]:
        """Derivatives of `force` and of `feature_distance` by the coordinates, by differences.

        A coordinate at its upper bound, or whose step forward leaves the model without a solution, is stepped back.

        Returns:
            shapes (samples, coordinates) and (features, coordinates).
        """
        return self.slopes_by(z, range(z.size))

    def slopes_by(self, z: Array, chosen: Sequence[int]) -> tuple[Array, Array]:
        """As `slopes`, by some of the coordinates, in the order of their indices as given."""
        true, force, distance = self.true_forces(z), self.force(z), self.feature_distance(z)
        upper = self.problem.bounds[1]
        of_force, of_features = np.zeros((force.size, len(chosen))), np.zeros((distance.size, len(chosen)))
        for place, j in enumerate(chosen):
            c = self.problem.coordinates[j]
            step = step_of(c, _STEP)
            for signed in (-step, step) if z[j] + step > upper[j] else (step, -step):
                moved = z.copy()
                moved[j] += signed
                try:
                    of_force[:, place] = (self._stepped(moved, c, true, force) - force) / signed
                    if c.group is None or c.name == "pca_shift":
                        of_features[:, place] = (self.feature_distance(moved) - distance) / signed
                    break
                except UserError:
                    continue
        return of_force, of_features

    def _stepped(self, moved: Array, c: Coordinate, true: list[Array], base: Array) -> Array:
        """Recorded force with one coordinate moved; only what it bears on is computed again."""
        problem = self.problem
        touched = [k for k, trial in enumerate(self.trials) if touches(c, trial)]
        forces = [true[k] for k in touched]
        if moves_simulation(c):
            forces = problem.true_forces(Muscle(problem.fibre_at(moved)), moved, [self.trials[k] for k in touched])
        out, places = base.copy(), self.slices()
        for k, force in zip(touched, forces, strict=True):
            out[places[k]] = problem.recorded(moved, self.trials[k], force)
        return out


def step_of(c: Coordinate, step: float) -> float:
    """Step of a slope in a coordinate, from that of a parameter on a logarithmic scale."""
    if c.group is not None:
        return step * ARTEFACTS[c.name].sd / 0.05
    # On a linear scale a unit may be anything; the prior says what counts as much.
    return step if c.log or math.isinf(c.prior_sd) else step * max(1.0, c.prior_sd)


def finite_start(training: Training) -> None:
    """Check that the model has a solution at the start.

    Raises:
        UserError: it has none; says which state stopped it.
    """
    try:
        force = training.force(training.problem.start)
        distance = training.feature_distance(training.problem.start)
    except UserError as error:
        raise UserError(f"no finite start: {error}; start from another fibre file") from error
    if not (np.all(np.isfinite(force)) and np.all(np.isfinite(distance))):
        raise UserError("no finite start: the simulated force is not finite; start from another fibre file")
