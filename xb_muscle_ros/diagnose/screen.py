"""Which candidates are worth a fit: what each could take of the residual once everything fitted so far gives way."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.diagnose.catalogue import Entry, applicable
from xb_muscle_ros.diagnose.linear_fit import LinearFit
from xb_muscle_ros.diagnose.names import MEASUREMENT, Name
from xb_muscle_ros.diagnose.refit import Fit
from xb_muscle_ros.diagnose.study import SCALE, Explanation, Study, entry_starts
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.fit.problem import Problem
from xb_muscle_ros.fit.solve import Objective
from xb_muscle_ros.fit.training import Training
from xb_muscle_ros.measurement.faults import FAULTS
from xb_muscle_ros.models.registry import SWAPS

Array = npt.NDArray[np.float64]

# A mechanism's line is followed this far either way, in units of its start, where the fit begins.
_LEAST_SHARE, _MOST_SHARE = 0.1, 8.0


class Screened(NamedTuple):
    """What one candidate promises.

    Attributes:
        name: of it.
        gain: by how much the cost would fall along its line, everything else giving way, in the cost's unit; nan where
            only a fit can tell.
        starts: values to start a fit from.
    """

    name: Name
    gain: float
    starts: tuple[dict[str, float], ...]


@dataclass(frozen=True)
class Linear:
    """A fit, taken as linear around its best point.

    Attributes:
        problem: with the best point as its start.
        residual_f0: measured less predicted force of all trials, one below the other.
        fit: its normal equations, without coordinates at a bound.
    """

    problem: Problem
    residual_f0: Array
    fit: LinearFit

    @staticmethod
    def of(study: Study, fit: Fit) -> Linear:
        """Around a fit's best point."""
        problem = fit.problem(study)
        objective = Objective(Training(problem), SCALE)
        slopes, _ = objective.training.slopes(problem.start)
        lower, upper = problem.bounds
        margin = 1e-6 * np.maximum(1.0, np.abs(upper - lower))
        free = (problem.start > lower + margin) & (problem.start < upper - margin)
        sds = np.array([c.prior_sd for c in problem.coordinates])
        prior = np.where(np.isfinite(sds), sds**-2.0, 0.0)
        residual = objective.training.measured - objective.training.force(problem.start)
        return Linear(problem, residual, LinearFit(slopes[:, free], objective.weights(), prior[free]))

    def gain(self, columns: Array, prior_sd: Array) -> tuple[float, Array]:
        """By how much the cost falls with further coordinates of these slopes and priors around 0, and their values."""
        left = self.fit.left(columns) * self.fit.weights[:, None]
        raw = columns * self.fit.weights[:, None]
        curvature = raw.T @ left + np.diag(prior_sd**-2.0)
        pull = left.T @ (self.residual_f0 * self.fit.weights)
        values = np.linalg.solve(curvature, pull)
        return 0.5 * float(pull @ values), values


def screen(study: Study, fit: Fit, linear: Linear) -> list[Screened]:
    """All candidates that a fit does not have yet, the most promising first; those that only a fit can tell lead."""
    found = [*_faults(study, fit, linear), *_mechanisms(study, fit, linear)]
    return sorted(found, key=lambda s: np.inf if np.isnan(s.gain) else s.gain, reverse=True)


def models(study: Study, explanation: Explanation) -> list[Explanation]:
    """Explanations whose models `screen` runs for the mechanisms that a fit of one does not have yet."""
    plain = _without_extras(explanation)
    return [plain.plus(entry.name) for entry in _entries(study, explanation)]


def _entries(study: Study, explanation: Explanation) -> list[Entry]:
    """Mechanisms that go beside an explanation."""
    return [
        entry
        for entry in applicable(study.fibre.model)
        if entry.name not in explanation.mechanisms and _goes_with(study, explanation, entry.name)
    ]


def _faults(study: Study, fit: Fit, linear: Linear) -> Iterator[Screened]:
    for name in MEASUREMENT:
        if name in fit.explanation.faults:
            continue
        problem = study.problem(fit.explanation.plus(name), fit.values)
        own = [j for j, c in enumerate(problem.coordinates) if c.name == name.value]
        training = Training(problem)
        columns, _ = training.slopes_by(problem.start, own)
        gain, values = linear.gain(columns, np.full(len(own), FAULTS[name.value].sd))
        start = {problem.coordinates[j].label: float(v) for j, v in zip(own, values, strict=True)}
        yield Screened(name, gain, ({**fit.values, **start},))


def _mechanisms(study: Study, fit: Fit, linear: Linear) -> Iterator[Screened]:
    plain = _without_extras(fit.explanation)
    problem = study.problem(plain, fit.values)
    force = Training(problem).force(problem.start)
    for entry in _entries(study, fit.explanation):
        starts = entry_starts(entry, study.fibre, fit.values)
        if entry.effect is None:
            yield Screened(entry.name, np.nan, tuple(starts))
            continue
        yield _along_lines(study, plain, linear, entry, starts, force)


def _without_extras(explanation: Explanation) -> Explanation:
    """The explanation as far as it takes the place of blocks.

    What a mechanism adds to the forces is much the same beside another one as without it, and every pair would have to
    be compiled to tell the difference.
    """
    return replace(explanation, mechanisms=tuple(n for n in explanation.mechanisms if n.value in SWAPS))


def _goes_with(study: Study, explanation: Explanation, name: Name) -> bool:
    try:
        study.problem(explanation.plus(name), {})
    except UserError:
        return False
    return True


def _along_lines(
    study: Study, plain: Explanation, linear: Linear, entry: Entry, starts: list[dict[str, float]], force: Array
) -> Screened:
    """A mechanism at each of its starting values, followed along the line from its absence."""
    assert entry.effect is not None
    best = Screened(entry.name, 0.0, (starts[0],))
    explanation = plain.plus(entry.name)
    for start in starts:
        problem = study.problem(explanation, start)
        try:
            column = Training(problem).force(problem.start) - force
        except UserError:
            continue
        effect = float(start[entry.effect])
        gain, (share,) = linear.gain(column[:, None], np.array([entry.size / abs(effect)]))
        lower = next(c.lower for c in problem.coordinates if c.name == entry.effect)
        if share <= 0.0 and lower >= 0.0:
            continue
        if gain > best.gain:
            share = float(np.sign(share) * np.clip(abs(share), _LEAST_SHARE, _MOST_SHARE))
            begun = {**start, entry.effect: share * effect}
            best = Screened(entry.name, gain, (begun,))
    return best
