"""What a user should know before trusting a fit, one line each."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.fit.ends import BOUND, PRIOR, UNSEEN, UNSETTLED
from xb_muscle_ros.fit.methods import fast_form
from xb_muscle_ros.fit.ordinary import beyond_line
from xb_muscle_ros.fit.run import Fitted
from xb_muscle_ros.fit.start import null_lines
from xb_muscle_ros.fit.training import Training
from xb_muscle_ros.fit.uncertainty import correlation
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.models.strain_bins import wide_bins_line
from xb_muscle_ros.simulation.offline import one_for_all, pushing_line

# From here on two coordinates are told to be hardly told apart.
_TWINS = 0.95
# Starts that end this much above the best one in RMSD ended elsewhere.
_SAME = 0.05
# A coordinate's prior SD (or a factor of e, without) moves no sample by more than this, F0 or standard deviations.
_NO_EFFECT = 1e-9
_SIDES = ("below", "above")


def cautions(fitted: Fitted, parameters: Sequence[Mapping[str, Any]], trials: Sequence[Mapping[str, Any]]) -> list[str]:
    """All lines.

    Args:
        parameters, trials: rows of `report.parameter_rows` and `report.trial_rows`.
    """
    problem = fitted.problem
    idle = _idle(fitted)
    found = [
        f"{problem.coordinates[j].label} has no effect on what is fitted: its value is its start or its prior's"
        for j in idle
        if problem.coordinates[j].group is None
    ]
    unseen = [problem.coordinates[j].label for j in idle if problem.coordinates[j].group is not None]
    found += [f"nothing in the data shows {', '.join(unseen)}: at the prior's mean"] if unseen else []
    found += null_lines(problem)
    for j, row in enumerate(parameters):
        if j not in idle:
            found += _of_parameter(problem.coordinates[j].label, row)
    found += _of_priors(parameters, idle)
    found += beyond_line(parameters, trials)
    found += _twins(fitted)
    found += _of_starts(fitted)
    found += _of_grid(fitted)
    if not fitted.settled:
        found.append("profiles went on finding better points: the minimum is not settled; give more starts")
    nowhere = [row["trial"] for row in trials if row["rmsd_f0"] is None]
    if nowhere:
        found.append(f"the fitted model has no solution in {', '.join(nowhere)}: in no RMSD, and in no figure")
    return found + _pushing(fitted)


def _idle(fitted: Fitted) -> list[int]:
    """Coordinates that move nothing of the training data at the best point."""
    coordinates = fitted.problem.coordinates
    force, features = Training(fast_form(fitted.problem)).slopes(fitted.best.z)
    size = np.array([1.0 if c.log or math.isinf(c.prior_sd) else c.prior_sd for c in coordinates])
    moved = np.max(np.abs(np.vstack([force, features])), axis=0, initial=0.0) * size
    return [int(j) for j in np.flatnonzero(moved < _NO_EFFECT)]


def _pushing(fitted: Fitted) -> list[str]:
    """Whether the fitted model bears force where a muscle would be slack; one line for all trials."""
    problem, z, lines = fitted.problem, fitted.best.z, []
    muscle = Muscle(problem.fibre_at(z))
    for trial in problem.trials:
        try:
            (force,) = problem.true_forces(muscle, z, [trial])
        except UserError:
            continue  # Told of already.
        lines.append(pushing_line(trial.name, problem.fibre.model, trial.time_s, force))
    return one_for_all([line for line in lines if line])


def _of_parameter(label: str, row: Mapping[str, Any]) -> list[str]:
    found = []
    if row["at_bound"]:
        bound = row["bounds"][0 if row["at_bound"] == "lower" else 1]
        unit = "" if row["unit"] == "1" else f" {row['unit']}"
        # No option widens the bounds of a fault of the measurement.
        fault = ", which no option moves: leave this fault out, or look for another"
        remedy = "; widen it, or fix it there" if row["group"] is None else fault
        found.append(f"{label} is at its {row['at_bound']} bound, {bound:g}{unit}{remedy}")
    if row["group"] is not None:
        return found
    ends = dict(zip(_SIDES, row["interval_ended_by"], strict=True))
    by_bound = {side: what for side, what in ends.items() if what == BOUND or what.startswith(f"{BOUND} of ")}
    for what in dict.fromkeys(by_bound.values()):
        sides = " or ".join(side for side in ends if ends[side] == what)
        if what == BOUND:
            found.append(f"{label} is not identifiable: nothing in the data bounds it {sides}, its own bound does")
        else:
            found.append(f"{label} is not identifiable: nothing in the data bounds it {sides}, only the {what} does")
    if UNSEEN in ends.values():
        found.append(f"{label} is not identifiable on its own: the data see it only together with others")
    lost = [side for side, what in ends.items() if what == UNSETTLED]
    if lost:
        found.append(f"{label}: the profile {' and '.join(lost)} found no end of the interval; trust it only so far")
    return found


def _of_priors(parameters: Sequence[Mapping[str, Any]], idle: Sequence[int]) -> list[str]:
    """One line for all parameters whose interval a prior ends; there may be many."""
    named = []
    for j, row in enumerate(parameters):
        if row["group"] is None and j not in idle:
            sides = [side for side, what in zip(_SIDES, row["interval_ended_by"], strict=True) if what == PRIOR]
            named += [f"{row['name']} ({' and '.join(sides)})"] if sides else []
    if not named:
        return []
    return [f"ended by the prior, not by the data: the interval of {', '.join(named)}"]


def _twins(fitted: Fitted) -> list[str]:
    coordinates, matrix = fitted.problem.coordinates, correlation(fitted.shape.covariance)
    pairs = [(i, j) for i in range(len(coordinates)) for j in range(i) if abs(matrix[i, j]) > _TWINS]
    found = [
        f"{coordinates[j].label} and {coordinates[i].label} are hardly told apart (correlation {matrix[i, j]:.2f}); "
        "fix or tie one of them"
        for i, j in pairs
        if coordinates[i].group is None and coordinates[j].group is None
    ]
    # An error of the measurement has a prior that is real knowledge: nothing is to be fixed.
    resting: dict[str, dict[str, None]] = {}
    for pair in pairs:
        errors = [coordinates[j].name for j in pair if coordinates[j].group is not None]
        if len(errors) == 1:
            parameter = next(coordinates[j].name for j in pair if coordinates[j].group is None)
            resting.setdefault(parameter, {})[errors[0]] = None
    if resting:
        listed = ", ".join(f"{name} ({', '.join(errors)})" for name, errors in resting.items())
        found.append(
            f"known only as well as the prior of errors of the measurement (correlation above {_TWINS:g}): {listed}"
        )
    return found


def _of_starts(fitted: Fitted) -> list[str]:
    found = []
    ends = [s for s in fitted.starts if s is not None]
    best = min((s.cost for s in ends), default=0.0)
    off = [s for s in ends if s.cost > best + max(2.0, _SAME * best)]
    if off:
        found.append(
            f"starts disagree: {len(off)} of {len(ends)} ended in worse places; trust the fit only with more starts"
        )
    if fitted.lost:
        found.append(
            f"{len(fitted.lost)} of {len(fitted.starts)} starts led nowhere, because the model has no solution there; "
            f"the first: {fitted.lost[0]}"
        )
    if not fitted.best.converged:
        found.append("the descent was cut short before it came to rest; start again from the file it wrote")
    return found


def _of_grid(fitted: Fitted) -> list[str]:
    """What the strain grid of a fit leaves to be desired."""
    problem, found = fitted.problem, []
    fibre = problem.fibre_at(fitted.best.z)
    if fast_form(problem) is problem:
        return []
    wide = wide_bins_line(fibre.values)
    found += [wide] if wide else []
    if not fitted.method_settled:
        found.append(
            f"the fit by {fibre.method} did not settle: the corrected Gaussian form is {fitted.mismatch_f0:.1g} F0 off;"
            " start again from the file it wrote"
        )
    return found
