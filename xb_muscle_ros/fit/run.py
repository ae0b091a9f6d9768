"""A whole fit: several starts, the best one polished, and its coordinates profiled."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.fit.coordinates import Coordinate
from xb_muscle_ros.fit.descents import start_task
from xb_muscle_ros.fit.features import F0_ANCHOR
from xb_muscle_ros.fit.methods import fast_form
from xb_muscle_ros.fit.noise import FIRST, Scale
from xb_muscle_ros.fit.problem import Problem
from xb_muscle_ros.fit.rounds import refined
from xb_muscle_ros.fit.solve import Objective, Solution
from xb_muscle_ros.fit.training import Training, finite_start
from xb_muscle_ros.fit.uncertainty import Curvature, ProfileEnd, curvature, profile_side
from xb_muscle_ros.progress import Progress
from xb_muscle_ros.trials.trial import Array
from xb_muscle_ros.work import Options, run, stream
from xb_muscle_ros.work.plain import from_plain, to_plain

# Spread of further starts around the first, on the moved scale; of what is linear in its prior's standard deviations.
_SPREAD, _LINEAR_SPREAD = 0.7, 0.5
# How often a profile may find a better point before the fit is called unsettled.
_RESTARTS = 3


@dataclass(frozen=True)
class Settings:
    """How hard to look.

    Attributes:
        starts: descents, the first from the fibre's own values.
        seed: of the other starts.
        level: of the intervals; None leaves them out.
    """

    starts: int = 4
    seed: int = 1
    level: float | None = 0.95


@dataclass(frozen=True)
class Fitted:
    """What a fit found.

    Attributes:
        best: the best point; its cost is in the units of `scale`.
        scale: of the differences that the fit left.
        starts: every descent, in order; None where the model had no solution at its start.
        shape: curvature and covariance at the best point.
        sides: lower and upper end of each model parameter's interval, by its index; empty without a level.
        settled: False where profiles went on finding better points.
        mismatch_f0: of a method other than the Gaussian form, how far the corrected Gaussian form is from it at the
            best point (root mean square, F0); see `rounds`.
        method_settled: False where the best point is not the method's own: rounds went on, or led nowhere.
        lost: for each start without a solution, why; names the trial, state and time.
    """

    problem: Problem
    settings: Settings
    best: Solution
    scale: Scale
    starts: tuple[Solution | None, ...]
    shape: Curvature
    sides: Mapping[int, tuple[ProfileEnd, ProfileEnd]]
    settled: bool
    mismatch_f0: float = 0.0
    method_settled: bool = True
    lost: tuple[str, ...] = ()


def fit(problem: Problem, settings: Settings, options: Options) -> Fitted:
    """Find the best point from several starts, and how well it is known.

    By a method other than the Gaussian form, starts descend by the Gaussian form, the best one goes on to the method's
    own best point (see `rounds`), and profiles are those of the corrected Gaussian form.

    Args:
        options: where the work is done; finished starts and profiles are kept in the journal.

    Raises:
        UserError: no coordinate to move, nothing to fit to, no finite start, and what `work.stream` raises.
    """
    if not problem.coordinates:
        raise UserError("nothing is free to be fitted; name parameters with --free or faults with --nuisance")
    fast = fast_form(problem)
    training = Training(fast)
    # What every fibre meets by definition is nothing to fit to.
    if not training.trials and all(f == F0_ANCHOR for f in training.features):
        raise UserError(f"all {len(problem.trials)} trials are held out or weigh nothing; leave at least one to fit to")
    finite_start(training)
    plain = fast.to_json()
    tasks = [{"problem": plain, "z": z.tolist(), "scale": list(FIRST)} for z in _starts(problem, settings)]
    starts, lost = _descended(tasks, options)
    best = min((s for s in starts if s is not None), key=lambda s: s.cost, default=None)
    if best is None:
        raise UserError(f"none of {len(starts)} starts has a solution: {lost[0]}; start from another fibre file")
    sides: dict[int, tuple[ProfileEnd, ProfileEnd]] = {}
    settled, known = False, None
    for _ in range(_RESTARTS):
        found = refined(problem, best, known, options)
        best, scale = found.best, found.scale
        known = scale
        shape = curvature(Objective(Training(found.problem), scale), best.z)
        if settings.level is None:
            settled = True
            break
        sides, better = _profiles(found.problem, best, scale, shape, settings.level, options)
        settled = better is None
        if better is None:
            break
        best = best._replace(z=better)
    return Fitted(
        problem, settings, best, scale, tuple(starts), shape, sides, settled, found.mismatch_f0, found.settled, lost
    )


def profile_task(task: Mapping[str, Any]) -> dict[str, Any]:
    """One side of one profile."""
    objective = Objective(Training(Problem.from_json(task["problem"])), Scale(*task["scale"]))
    best, shape = from_plain(Solution, task["best"]), from_plain(Curvature, task["shape"])
    return to_plain(profile_side(objective, best, task["index"], task["up"], shape, task["level"]))


def _starts(problem: Problem, settings: Settings) -> list[Array]:
    """Where descents begin: the fibre's own values, then random points around these or around a coordinate's others."""
    if settings.starts < 1:
        raise UserError(f"number of starts is {settings.starts}; allowed is 1 and more")
    random = np.random.default_rng(settings.seed)
    lower, upper = problem.bounds
    spread = np.array([_spread(c) for c in problem.coordinates])
    others = [
        np.array([c.inward((c.start, *c.others)[k % (1 + len(c.others))]) for c in problem.coordinates])
        + spread * random.normal(size=lower.size)
        for k in range(1, settings.starts)
    ]
    return [np.clip(z, lower, upper) for z in (problem.start, *others)]


def _spread(c: Coordinate) -> float:
    if c.log:
        return _SPREAD
    # Without a prior a linear scale says nothing of sizes.
    return _LINEAR_SPREAD * (c.prior_sd if np.isfinite(c.prior_sd) else 1.0)


def _descended(tasks: Sequence[Mapping[str, Any]], options: Options) -> tuple[list[Solution | None], tuple[str, ...]]:
    """All descents, telling the best so far; and why those that came to nothing did, in the order of the starts."""
    found: list[Solution | None] = [None] * len(tasks)
    lost: dict[int, str] = {}
    best = float("inf")
    for index, row in stream(start_task, tasks, replace(options, label="starts")):
        if "lost" in row:
            lost[index] = row["lost"]
            continue
        found[index] = solution = from_plain(Solution, row)
        if solution.cost < best:
            best = solution.cost
            if not options.quiet:
                what = (
                    f"cost {solution.cost:.6g}, {100.0 * solution.rmsd_f0:.3f} % F0, {solution.evaluations} evaluations"
                )
                Progress.write(f"start {index + 1} of {len(tasks)}: {what}, the best so far", sys.stderr)
    return found, tuple(lost[index] for index in sorted(lost))


def _profiles(
    problem: Problem, best: Solution, scale: Scale, shape: Curvature, level: float, options: Options
) -> tuple[dict[int, tuple[ProfileEnd, ProfileEnd]], Array | None]:
    """Both sides of every model parameter's profile, or a better point that one of them met."""
    chosen = [j for j, c in enumerate(problem.coordinates) if c.group is None]
    task = {"problem": problem.to_json(), "best": to_plain(best), "scale": list(scale), "level": level}
    task["shape"] = to_plain(shape)
    tasks = [{**task, "index": j, "up": up} for j in chosen for up in (False, True)]
    rows = run(profile_task, tasks, replace(options, label="profiles"))
    sides = [from_plain(ProfileEnd, row) for row in rows]
    better = next((np.array(side.better) for side in sides if side.better is not None), None)
    return {j: (sides[2 * k], sides[2 * k + 1]) for k, j in enumerate(chosen)}, better
