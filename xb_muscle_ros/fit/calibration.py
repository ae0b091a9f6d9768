"""A held-out trial's own faults of the measurement, from its force before anything moves and from nothing else.

On the steep part of the force-pCa curve the error that solutions have (SD 0.05) is worth 6 % F0 and more; a trial's
force has its own zero. A prediction of what a stretch does can be judged only once both are out of the way; the
isometric force before the stretch tells them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.optimize import minimize_scalar

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.fit.coordinates import Coordinate
from xb_muscle_ros.fit.data import FitTrial
from xb_muscle_ros.fit.problem import Problem, moves_simulation, touches
from xb_muscle_ros.measurement.artefacts import ARTEFACTS, Scope
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.trials.trial import Array

# How well the model is trusted to know isometric force, F0; all samples of it count as one.
_FORCE_SD_F0 = 0.005
# So many standard deviations are searched, at so many points before closing in.
_MOST, _POINTS = 4.0, 33
_NOWHERE = 1e12
_FEWEST = 3


class Calibrated(NamedTuple):
    """A trial's prediction with faults of its own.

    Attributes:
        force_f0: recorded force at the times that count, F0.
        own: estimates by name of the fault, in its unit; empty where the trial has none of its own, or nothing that
            tells them.
    """

    force_f0: Array
    own: Mapping[str, float]


def own_faults(problem: Problem, trial: FitTrial, known: bool = True) -> tuple[Coordinate, ...]:
    """Faults that a problem has of every trial or solution, as coordinates of this trial.

    Args:
        known: leave out those of which the problem has this trial's value, as a solution's that the fit met.
    """
    kinds = {
        c.name: c for c in problem.coordinates if c.group is not None and ARTEFACTS[c.name].scope is not Scope.STUDY
    }
    met = {c.name for c in problem.coordinates if known and c.group is not None and touches(c, trial)}
    groups = {Scope.TRIAL: trial.name, Scope.SOLUTION: trial.solution}
    return tuple(replace(c, group=groups[ARTEFACTS[name].scope]) for name, c in kinds.items() if name not in met)


def calibrated_force(problem: Problem, z: Array, trial: FitTrial, known: bool = True) -> Calibrated:
    """Force of a trial with those faults of its own that its isometric force asks for.

    Estimated are, with the priors of the fit, the faults that the fit has of other trials or solutions and not of this
    one (`own_faults`): its solution's pCa shift, its force offset. All others are those of the point. Nothing is
    estimated where the trial has no steady force before its first change of length, or never moves.

    Args:
        problem: of the fit; a correction is added where it has one, and must then have one for this trial.
        trial: one that the fit did not see; need not be of the problem.
        known: False estimates also what the fit knows of the trial's solution: for a point that was not fitted.

    Raises:
        UserError: the model has no solution; see `Problem.true_forces`.
    """
    own = own_faults(problem, trial, known)
    labels = {c.label for c in own}
    kept = [j for j, c in enumerate(problem.coordinates) if c.label not in labels]
    coordinates = (*(problem.coordinates[j] for j in kept), *own)
    added = np.zeros(trial.time_s.size) if problem.correction is None else problem.correction.of_trial(trial.name, z)
    bare = replace(problem, coordinates=coordinates, correction=None)
    made = _Made(bare, z[kept], Muscle(problem.fibre_at(z)), added)
    # Where nothing ever moves, there is no force before: all of it is what is to be predicted.
    still = trial.steady & trial.moves
    if not own or np.count_nonzero(still) < _FEWEST:
        return Calibrated(made.recorded(np.zeros(len(own)), trial), {})
    found = _estimates(made, own, _begin(trial, still))
    return Calibrated(made.recorded(found, trial), {c.name: float(x) for c, x in zip(own, found, strict=True)})


@dataclass(frozen=True)
class _Made:
    """The model's answer at a point, with faults of a trial's own at the end of the coordinates."""

    problem: Problem
    z: Array
    muscle: Muscle
    added: Array

    def true(self, own: Array, trial: FitTrial) -> Array:
        """The fibre's force in a trial or its begin, F0."""
        (force,) = self.problem.true_forces(self.muscle, np.concatenate([self.z, own]), [trial])
        return force + self.added[: force.size]

    def recorded(self, own: Array, trial: FitTrial, true: Array | None = None) -> Array:
        """Recorded force at the times that count, F0."""
        force = self.true(own, trial) if true is None else true
        return self.problem.recorded(np.concatenate([self.z, own]), trial, force)


def _begin(trial: FitTrial, still: npt.NDArray[np.bool_]) -> FitTrial:
    """The trial up to the end of its steady force, of which that alone counts."""
    times = trial.force_time_s[still]
    # Force that is recorded late or early is that of other samples.
    last = int(np.searchsorted(trial.time_s, times[-1] + ARTEFACTS["time_shift"].upper)) + 1
    return replace(
        trial,
        time_s=trial.time_s[:last],
        length_l0=trial.length_l0[:last],
        calcium_um=trial.calcium_um[:last],
        force_time_s=times,
        measured_f0=trial.measured_f0[still],
    )


def _estimates(made: _Made, own: tuple[Coordinate, ...], begin: FitTrial) -> Array:
    """The likeliest faults, shape (own,).

    Those of the recording alone add to force and follow from the others by linear least squares.
    """
    moving = [j for j, c in enumerate(own) if moves_simulation(c)]
    adding = [j for j in range(len(own)) if j not in moving]
    # A prior that says nothing ends at the bounds.
    sds = np.array([min(c.prior_sd, c.upper) for c in own])
    units = np.diag(sds)[adding]
    one = _FORCE_SD_F0 * np.sqrt(begin.force_time_s.size)

    def best(shift: float) -> tuple[float, Array]:
        """Squared distance in standard deviations, and all faults, where those of the input have a value."""
        point = np.zeros(len(own))
        point[moving] = shift
        try:
            true = made.true(point, begin)
        except UserError:
            return _NOWHERE, point
        force = made.recorded(point, begin, true)
        slopes = np.array([made.recorded(point + unit, begin, true) - force for unit in units]).reshape(-1, force.size)
        a, left = slopes.T / one, (begin.measured_f0 - force) / one
        found = np.linalg.solve(a.T @ a + np.eye(len(adding)), a.T @ left)
        point[adding] = found * sds[adding]
        return float(np.sum((left - a @ found) ** 2) + np.sum((point / sds) ** 2)), point

    if not moving:
        return best(0.0)[1]
    # Cooperative fibres may answer with a jump: look everywhere before closing in.
    reach = min(_MOST * float(sds[moving[0]]), own[moving[0]].upper)
    rough = np.linspace(-reach, reach, _POINTS)
    nearest = float(rough[int(np.argmin([best(float(shift))[0] for shift in rough]))])
    step = float(rough[1] - rough[0])
    # SciPy's types ask for the arguments beside bounds.
    bounds = nearest - step, nearest + step
    found: Any = minimize_scalar(lambda x: best(x)[0], bounds=bounds, args=(), method="bounded")
    return best(float(found.x))[1]
