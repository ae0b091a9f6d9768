"""To the best point by a detailed method, led by the Gaussian form."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.fit.correction import Correction
from xb_muscle_ros.fit.descents import descended, nearby, scale_at
from xb_muscle_ros.fit.methods import Difference, corrected, difference, fast_form
from xb_muscle_ros.fit.noise import FIRST, Scale
from xb_muscle_ros.fit.problem import Problem
from xb_muscle_ros.fit.solve import Objective, Solution
from xb_muscle_ros.fit.training import Training
from xb_muscle_ros.trials.trial import Array
from xb_muscle_ros.work import Options

# Rounds and halvings of one round's step at most.
_ROUNDS, _HALVINGS = 8, 6
# The correction holds where it meets the method itself to this, root mean square over the samples: a hundredth of the
# noise of a good recording. Features are met to a hundredth of their sd.
_CLOSE_F0, _CLOSE_SD = 1e-5, 0.01
# A gain in cost that is none: a hundredth of what one standard deviation of a coordinate is worth.
_NO_GAIN = 0.005
# The scale of the differences is found where what the correction misses is such a share of them.
_LITTLE = 0.2


class Refined(NamedTuple):
    """Where the rounds ended.

    Attributes:
        problem: by the Gaussian form, with its correction; that asked for where it needs none.
        best: the best point.
        scale: of the differences left there.
        mismatch_f0: root-mean-square error of the corrected force at the best point against the method itself, F0.
        settled: whether the best point is one of the method's own.
    """

    problem: Problem
    best: Solution
    scale: Scale
    mismatch_f0: float
    settled: bool


def refined(asked: Problem, best: Solution, scale: Scale | None, options: Options) -> Refined:
    """Go from the Gaussian form's best point to that of the problem's own method.

    Each round corrects the Gaussian form at the point reached and descends anew. A step that makes the method's own
    cost larger is halved.

    Args:
        asked: the problem, by any method.
        best: best point by the Gaussian form, or one close to the best.
        scale: of the differences where it is known; None: what they turn out to have as soon as what the correction
            misses matters little beside them. By the Gaussian form always what they have at the point.
        options: where the work is done.

    Raises:
        UserError: the method has no solution at the point.
    """
    if fast_form(asked) is asked:
        scale = scale_at(asked, best.z)
        return Refined(asked, descended(asked, best, scale, options), scale, 0.0, True)
    try:
        here = difference(asked, best.z)
    except UserError as error:
        raise UserError(
            f"method {asked.fibre.method} has no solution where the Gaussian form fits best: {error}; start from "
            "another fibre file"
        ) from error
    mismatch, settled = _root_mean_square(list(here.force.values())), False
    for _ in range(_ROUNDS):
        problem = corrected(asked, best.z, here, nearby(options, "correction"))
        if scale is None and mismatch <= _LITTLE * best.rmsd_f0:
            scale = scale_at(problem, best.z)
        found = descended(problem, best, scale or FIRST, options)
        here, best, moved = _stepped(asked, here, best, found, scale or FIRST)
        if not moved:
            # The slopes of the correction are no use: the method errs by more than it should.
            break
        mismatch, off = _mismatch(problem, best.z, here)
        whole = np.array_equal(best.z, found.z)
        settled = whole and mismatch <= _CLOSE_F0 and off <= _CLOSE_SD and scale is not None
        if settled:
            break
    return Refined(problem, best, scale or scale_at(problem, best.z), mismatch, settled)


def _stepped(
    asked: Problem, here: Difference, old: Solution, new: Solution, scale: Scale
) -> tuple[Difference, Solution, bool]:
    """A point on the way from old to new where the method's own cost is not larger, the new one first.

    Returns:
        difference there, the point with its cost by the method itself, and whether it is not the old one.
    """
    before = _exactly(asked, here, old, scale)
    z = new.z
    for _ in range(_HALVINGS):
        try:
            there = difference(asked, z)
        except UserError:
            pass
        else:
            after = _exactly(asked, there, new._replace(z=z), scale)
            if after.cost <= before.cost + _NO_GAIN:
                return there, after, True
        z = 0.5 * (old.z + z)
    return here, before, False


def _exactly(asked: Problem, here: Difference, point: Solution, scale: Scale) -> Solution:
    """A point with cost and RMSD by the method itself, from its difference there."""
    exact = Correction.level(here.force, here.features)
    training = Training(replace(fast_form(asked), correction=exact))
    cost = float(0.5 * np.sum(Objective(training, scale).residuals(point.z) ** 2))
    return point._replace(cost=cost, rmsd_f0=_root_mean_square([training.force(point.z) - training.measured]))


def _mismatch(problem: Problem, z: Array, here: Difference) -> tuple[float, float]:
    """What the correction is off by at a point: root mean square of force (F0), most of a feature (SD)."""
    correction = problem.correction
    if correction is None:
        return 0.0, 0.0
    force = _root_mean_square([force - correction.of_trial(name, z) for name, force in here.force.items()])
    return force, float(np.max(np.abs(here.features - correction.of_features(z)), initial=0.0))


def _root_mean_square(parts: list[Array]) -> float:
    whole = np.concatenate([*parts, np.empty(0)])
    return float(np.sqrt(np.mean(whole**2))) if whole.size else 0.0
