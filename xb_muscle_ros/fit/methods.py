"""Two methods for one problem: the one asked for, the Gaussian form beside it, and the correction between them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from xb_muscle_ros.distribution.gaussian import Gaussian
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.fit.correction import Correction
from xb_muscle_ros.fit.problem import Problem, moves_simulation, touches
from xb_muscle_ros.fit.training import Training, step_of
from xb_muscle_ros.models.composition import Composition
from xb_muscle_ros.models.registry import compose
from xb_muscle_ros.trials.trial import Array
from xb_muscle_ros.work import Options, run
from xb_muscle_ros.work.plain import from_plain, to_plain

# Of the correction's slopes, on the moved scale. Steps of 1 ms on a strain grid are halved where need be, and so err in
# jumps of up to 3e-6 F0; the difference between the methods bends little, so that so large a step does it no harm.
_STEP = 1e-2


class Difference(NamedTuple):
    """What a method's answer differs by from the Gaussian form's at a point.

    Attributes:
        force: by trial, F0 at the trial's samples, before the recording's faults.
        features: of each training feature, in its standard deviations.
    """

    force: dict[str, Array]
    features: Array


def fast_form(problem: Problem) -> Problem:
    """The same problem by the Gaussian form; itself where it is that, or where no heads are there to be distributed."""
    fibre = problem.fibre
    if fibre.method == Gaussian.name or not isinstance(compose(fibre.model, fibre.method), Composition):
        return problem
    return replace(problem, fibre=replace(fibre, method=Gaussian.name))


def difference(problem: Problem, z: Array) -> Difference:
    """Difference of the problem's own method from the Gaussian form at a point, training data only.

    Raises:
        UserError: see `Problem.true_forces`.
    """
    return _difference(problem, z, [t.name for t in Training(problem).trials], True)


def corrected(problem: Problem, z: Array, here: Difference, options: Options) -> Problem:
    """The problem by the Gaussian form, with the correction that gives it its own method's values and slopes at z.

    Args:
        problem: as asked for.
        z: where the correction is exact.
        here: see `difference`; of the same problem and point.
        options: where the slopes are computed, one simulation of all trials for each parameter.
    """
    names = list(here.force)
    trials = {t.name: t for t in problem.trials if t.name in here.force}
    force_slopes = {name: np.zeros((force.size, z.size)) for name, force in here.force.items()}
    feature_slopes = np.zeros((here.features.size, z.size))
    upper = problem.bounds[1]
    moving = [j for j, c in enumerate(problem.coordinates) if moves_simulation(c)]
    steps = {j: step_of(problem.coordinates[j], _STEP) for j in moving}
    steps = {j: -step if z[j] + step > upper[j] else step for j, step in steps.items()}
    # Where the model has no solution on one side, the other one is tried.
    for sign in (1.0, -1.0):
        tasks = []
        for j in steps:
            c, moved = problem.coordinates[j], z.copy()
            moved[j] += sign * steps[j]
            on_features = c.group is None or c.name == "pca_shift"
            touched = [name for name in names if touches(c, trials[name])]
            tasks.append({"z": moved.tolist(), "trials": touched, "features": on_features})
        plain = problem.to_json()
        rows = run(difference_task, [{"problem": plain, **task} for task in tasks], options)
        found = {j: row for j, row in zip(steps, rows, strict=True) if row is not None}
        for j, row in found.items():
            there, step = from_plain(Difference, row), sign * steps[j]
            for name, force in there.force.items():
                force_slopes[name][:, j] = (force - here.force[name]) / step
            if there.features.size:
                feature_slopes[:, j] = (there.features - here.features) / step
        steps = {j: step for j, step in steps.items() if j not in found}
        if not steps:
            break
    correction = Correction(z.copy(), here.force, force_slopes, here.features, feature_slopes)
    return replace(fast_form(problem), correction=correction)


def difference_task(task: Mapping[str, Any]) -> dict[str, Any] | None:
    """Difference at a point in the trials named; None where either method has no solution."""
    problem = Problem.from_json(task["problem"])
    try:
        return to_plain(_difference(problem, np.array(task["z"]), task["trials"], task["features"]))
    except UserError:
        return None


def _difference(problem: Problem, z: Array, names: Sequence[str], with_features: bool) -> Difference:
    chosen = replace(problem, trials=tuple(t for t in problem.trials if t.name in names))
    own, fast = Training(chosen), Training(fast_form(chosen))
    pairs = zip(own.trials, own.true_forces(z), fast.true_forces(z), strict=True)
    force = {trial.name: detailed - gaussian for trial, detailed, gaussian in pairs}
    features = own.feature_distance(z) - fast.feature_distance(z) if with_features else np.empty(0)
    return Difference(force, features)
