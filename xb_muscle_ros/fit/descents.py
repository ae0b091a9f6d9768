"""Descents as work: plain data in, plain data out, so that they run anywhere and are kept in a journal."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.fit.noise import Scale, noise_at, scale_of
from xb_muscle_ros.fit.problem import Problem
from xb_muscle_ros.fit.solve import Objective, Solution, descend
from xb_muscle_ros.fit.training import Training
from xb_muscle_ros.trials.trial import Array
from xb_muscle_ros.work import Options, run
from xb_muscle_ros.work.plain import from_plain, to_plain


def start_task(task: Mapping[str, Any]) -> dict[str, Any]:
    """One descent, a `Solution`; ``lost``, why, where the model has none at its start: nothing tells the way there."""
    objective = Objective(Training(Problem.from_json(task["problem"])), Scale(*task["scale"]))
    z = np.array(task["z"])
    try:
        objective.training.force(z)
        objective.training.feature_distance(z)
    except UserError as error:
        return {"lost": str(error)}
    return to_plain(descend(objective, z))


def scale_at(problem: Problem, z: Array) -> Scale:
    """Scale that the residuals at a point turn out to have, what the fit took of them given back."""
    training = Training(problem)
    return scale_of(noise_at(training, z, training.slopes(z)))


def descended(problem: Problem, best: Solution, scale: Scale, options: Options) -> Solution:
    """Where one descent from a point ends; the point itself where the model has no solution there."""
    task = {"problem": problem.to_json(), "z": best.z.tolist(), "scale": list(scale)}
    row = run(start_task, [task], nearby(options, "polish"))[0]
    return best if "lost" in row else from_plain(Solution, row)


def nearby(options: Options, label: str) -> Options:
    """Options for a second's work: in this process, since others take as long to start, unless there is a cluster."""
    return replace(options, label=label, processes=0 if options.scheduler is None else None)
