"""How well the answer's own parameter is known: its interval and its profile."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from xb_muscle_ros.diagnose.catalogue import CATALOGUE
from xb_muscle_ros.diagnose.names import Name
from xb_muscle_ros.diagnose.refit import Fit, explanation_of
from xb_muscle_ros.diagnose.study import SCALE, Study
from xb_muscle_ros.fit.solve import Objective, Solution
from xb_muscle_ros.fit.training import Training
from xb_muscle_ros.fit.uncertainty import curvature, profile_side
from xb_muscle_ros.work import Options, run

_NORMAL = 1.959964


class Known(NamedTuple):
    """A parameter and how well it is known.

    Attributes:
        parameter: its name.
        value: fitted, in its unit.
        interval: 95 %.
        at_bound: whether the fit ended at a bound.
        points: of the profile: value and root of the likelihood ratio; empty where none was followed.
    """

    parameter: str
    value: float
    interval: tuple[float, float]
    at_bound: bool
    points: tuple[tuple[float, float], ...]


def known(study: Study, fit: Fit, name: Name, profiled: bool, options: Options) -> Known | None:
    """Interval of a mechanism's effect; None where it has none, its absence being another model.

    Args:
        study: all trials.
        fit: with the mechanism.
        name: of the mechanism.
        profiled: follow the profile; else the interval is that of the curvature.
        options: where the work is done.
    """
    effect = CATALOGUE[name].effect
    if effect is None:
        return None
    problem = fit.problem(study)
    index = next(j for j, c in enumerate(problem.coordinates) if c.name == effect)
    c = problem.coordinates[index]
    value = float(problem.start[index])
    span = c.upper - c.lower
    at_bound = value >= c.upper - 1e-3 * span or value <= c.lower + 1e-6 * span
    if not profiled:
        shape = curvature(Objective(Training(problem), SCALE), problem.start)
        half = _NORMAL * float(np.sqrt(shape.covariance[index, index]))
        return Known(effect, value, (max(value - half, c.lower), min(value + half, c.upper)), at_bound, ())
    task = {
        "study": study.to_json(),
        "names": [n.value for n in fit.explanation.names],
        "values": dict(fit.values),
        "cost": fit.cost,
        "index": index,
    }
    rows = run(profile_task, [{**task, "up": up} for up in (False, True)], replace(options, label="profile"))
    points = sorted({(float(x), float(root)) for row in rows for x, root in row["points"]})
    return Known(effect, value, (rows[0]["end"], rows[1]["end"]), at_bound, tuple(points))


def profile_task(task: Mapping[str, Any]) -> dict[str, Any]:
    """One side of the profile."""
    study = Study.from_json(task["study"])
    problem = study.problem(explanation_of(task["names"]), task["values"])
    objective = Objective(Training(problem), SCALE)
    best = Solution(problem.start, task["cost"], 0.0, 0, True)
    shape = curvature(objective, problem.start)
    return profile_side(objective, best, task["index"], task["up"], shape)._asdict()
