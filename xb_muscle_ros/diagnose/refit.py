"""One fit of one explanation, and what it predicts of trials that it did not see: the unit of work of a diagnosis."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.diagnose.names import Name
from xb_muscle_ros.diagnose.study import SCALE, Explanation, Study, fibre_with
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.fit.coordinates import fault_coordinates
from xb_muscle_ros.fit.data import FitTrial
from xb_muscle_ros.fit.problem import Problem
from xb_muscle_ros.fit.solve import Objective, descend
from xb_muscle_ros.fit.training import Training
from xb_muscle_ros.measurement.faults import FAULTS, Scope
from xb_muscle_ros.models.muscle import Muscle

Array = npt.NDArray[np.float64]

# Relative change of the cost at which a fit stops: candidates differ by far more, or not at all.
_TOLERANCE = 3e-4


@dataclass(frozen=True)
class Fit:
    """A fitted explanation.

    Attributes:
        explanation: what was fitted.
        values: of all coordinates by label, in their units.
        cost: half the sum of squares of differences and of distances from the priors, in units of `study.SCALE`.
        rmsd_f0: over the training samples, F0.
        evaluations: points at which the model was simulated.
    """

    explanation: Explanation
    values: Mapping[str, float]
    cost: float
    rmsd_f0: float
    evaluations: int

    def problem(self, study: Study, held_out: frozenset[str] = frozenset()) -> Problem:
        """The problem with this fit as its start."""
        return study.problem(self.explanation, self.values, held_out)


def refit_task(task: Mapping[str, Any]) -> dict[str, Any] | None:
    """Fit an explanation from the best of several starts; None where the model has no solution at any.

    The task holds ``study``, ``names``, ``starts`` (mappings of values), ``held_out`` (names of trials), ``most``
    (points to try from the best start), ``predict`` (whether to say how well held-out trials are predicted).
    """
    study = Study.from_json(task["study"])
    explanation = explanation_of(task["names"])
    held_out = frozenset(task["held_out"])
    found = _best_start(study, explanation, task["starts"], held_out)
    if found is None:
        return None
    objective = Objective(Training(found), SCALE)
    try:
        solution = descend(objective, found.start, most=task["most"], tolerance=_TOLERANCE)
    except UserError:
        return None
    values = {c.label: c.outward(float(z)) for c, z in zip(found.coordinates, solution.z, strict=True)}
    row: dict[str, Any] = {
        "names": task["names"],
        "values": values,
        "cost": solution.cost,
        "rmsd_f0": solution.rmsd_f0,
        "evaluations": solution.evaluations,
    }
    if task["predict"]:
        row["heldout_mse"] = {
            t.name: heldout_mse(study, explanation, values, t) for t in study.trials if t.name in held_out
        }
    return row


def compile_task(task: Mapping[str, Any]) -> bool:
    """Compile the model of an explanation, which leaves it in this machine's cache; the task as in `refit_task`.

    Returns:
        whether there is such a model.
    """
    study = Study.from_json(task["study"])
    try:
        Muscle(fibre_with(study.fibre, explanation_of(task["names"]).mechanisms, {}))
    except UserError:
        return False
    return True


def fit_of(row: Mapping[str, Any]) -> Fit:
    """What `refit_task` found."""
    return Fit(explanation_of(row["names"]), row["values"], row["cost"], row["rmsd_f0"], row["evaluations"])


def explanation_of(names: Sequence[str]) -> Explanation:
    """An explanation from names in its order."""
    explanation = Explanation()
    for name in names:
        explanation = explanation.plus(Name(name))
    return explanation


def _best_start(
    study: Study, explanation: Explanation, starts: Sequence[Mapping[str, float]], held_out: frozenset[str]
) -> Problem | None:
    """The problem at the start from which a few steps lead furthest down."""
    found: list[tuple[float, Problem]] = []
    for start in starts:
        problem = study.problem(explanation, start, held_out)
        objective = Objective(Training(problem), SCALE)
        try:
            objective.training.force(problem.start)
        except UserError:
            continue
        if len(starts) == 1:
            return problem
        solution = descend(objective, problem.start, most=3, tolerance=_TOLERANCE)
        values = {c.label: c.outward(float(z)) for c, z in zip(problem.coordinates, solution.z, strict=True)}
        found.append((solution.cost, study.problem(explanation, {**start, **values}, held_out)))
    return min(found, key=lambda pair: pair[0])[1] if found else None


def heldout_mse(study: Study, explanation: Explanation, values: Mapping[str, float], trial: FitTrial) -> float:
    """Mean square difference in a trial that the fit did not see, F0²; 1 where the model has no solution."""
    predicted = heldout_force(study, explanation, values, trial)
    return 1.0 if predicted is None else float(np.mean((predicted - trial.measured_f0) ** 2))


def heldout_force(study: Study, explanation: Explanation, values: Mapping[str, float], trial: FitTrial) -> Array | None:
    """Recorded force of a trial that the fit did not see, F0; None where the model has no solution.

    Faults that are the trial's or its solution's own are estimated from its force before anything moves, and from
    nothing else; without that the predictions of all explanations would differ by their solutions, not by stretches.
    """
    own = [n for n in explanation.faults if FAULTS[n.value].scope is not Scope.STUDY]
    known = {label: value for label, value in values.items() if "[" not in label}
    start = study.problem(Explanation(explanation.mechanisms), known)
    fibre = start.fibre_at(start.start)
    study_faults = [n for n in explanation.faults if FAULTS[n.value].scope is Scope.STUDY]
    fixed = fault_coordinates([n.value for n in study_faults], [trial.name], [trial.solution], {})
    free = fault_coordinates([n.value for n in own], [trial.name], [trial.solution], {})
    # Where nothing ever moves, there is no force before: all of it is what is to be predicted.
    still = trial.steady & trial.moves
    coordinates = (*fixed, *free)
    z = np.array([*(values.get(c.label, 0.0) for c in fixed), *(0.0 for _ in free)])
    problem = Problem(fibre, (trial,), coordinates, {}, correction=study.correction(len(coordinates)))
    try:
        if free and np.count_nonzero(still) >= 3:
            quiet = replace(
                trial, held_out=False, force_time_s=trial.force_time_s[still], measured_f0=trial.measured_f0[still]
            )
            calm = replace(problem, trials=(quiet,), coordinates=free, correction=study.correction(len(free)))
            found = descend(Objective(Training(calm), SCALE), np.zeros(len(free)), most=10, tolerance=1e-3)
            z[len(fixed) :] = found.z
        return problem.predicted(z)[0]
    except UserError:
        return None
