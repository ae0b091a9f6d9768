"""What a candidate promises beside a fit, to first order, and where its own fit should start."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from xb_muscle_ros.diagnose.answers import MECHANISMS
from xb_muscle_ros.diagnose.names import MEASUREMENT, Name
from xb_muscle_ros.diagnose.search.descent import Descent, Fit
from xb_muscle_ros.diagnose.search.system import BEYOND, System
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.fit.linear_fit import LinearFit
from xb_muscle_ros.fit.training import Training
from xb_muscle_ros.measurement.artefacts import ORDINARY
from xb_muscle_ros.models.catalogue import CATALOGUE
from xb_muscle_ros.trials.trial import Array

# A mechanism's line is followed this far either way, in units of its start, where the fit begins.
_LEAST_SHARE, _MOST_SHARE = 0.1, 8.0
BLIND = tuple(n for n in MECHANISMS if CATALOGUE[n].effect is None)
"""Mechanisms that only a fit can tell: no line leads from their absence to them."""


class Promise(NamedTuple):
    """Of one candidate in one fibre.

    Attributes:
        gain: fall of the cost along its line, profiled over all else; nan where only a fit can tell.
        starts: values by label from which its fit may start.
        mean_square_f0: of the residuals there, F0²; nan where only a fit can tell.
    """

    name: Name
    gain: float
    starts: tuple[dict[str, float], ...]
    mean_square_f0: float


class Linear:
    """A fit taken as linear around its point."""

    def __init__(self, system: System, fit: Fit) -> None:
        self.system, self.fit = system, fit
        problem = system.problem(fit.names, fit.values)
        self.descent = Descent(system, problem)
        self.point = self.descent.at(problem.start)
        self.slopes = self.descent.slopes(self.point)
        self.force = self.point.residual + self.descent.training.measured
        _, gradient = self.descent.normal(self.point, self.slopes)
        self.free = self.descent.free(self.point, gradient)

    def solve(
        self, columns: Array, information: Array, gradient: Array, own: Array | None = None
    ) -> tuple[Array, Array, float, float]:
        """Joint solution of the fit's coordinates and of further columns.

        Args:
            columns: slopes of further coordinates, shape (samples, k).
            information: of their priors, shape (k,).
            gradient: of their priors at the start, shape (k,).
            own: information of the priors of the fit's own coordinates, where it is not theirs.

        Returns:
            moves of the fit's coordinates and of the further ones, fall of the cost, mean square afterwards.
        """
        system, d, point = self.system, self.descent, self.point
        free = self.free if own is None else np.ones_like(self.free)
        of_own = d.information if own is None else own
        count = int(np.count_nonzero(free))
        prior = np.concatenate([of_own[free], information])
        distance = point.z - np.array([c.prior_mean for c in d.problem.coordinates])
        pull = np.concatenate([(of_own * distance)[free], gradient])
        of_features: Array = np.pad(d.of_features[:, free], ((0, 0), (0, information.size)))
        pull += of_features.T @ point.feature
        joint = np.hstack([self.slopes[:, free], columns])
        certain = np.diag(prior) + of_features.T @ of_features
        fit = LinearFit(joint, np.sqrt(d.sample_weights(point)), certain)
        move = fit.solved(-(fit.score.T @ point.residual + pull))
        mean_square = float(system.weights @ (point.residual + joint @ move) ** 2) / d.total
        gain = system.log_likelihood(mean_square) - system.log_likelihood(point.mean_square)
        moves = np.zeros(point.z.size)
        moves[free] = move[:count]
        return moves, move[count:], gain - 0.5 * float(prior @ move**2) - float(pull @ move), mean_square

    def values(self, moves: Array) -> dict[str, float]:
        """Values of the fit's coordinates after some moves, within their bounds."""
        d = self.descent
        z = np.clip(self.point.z + np.clip(moves, -d.longest, d.longest), d.lower, d.upper)
        return {c.label: c.outward(float(x)) for c, x in zip(d.problem.coordinates, z, strict=True)}


def promise(linear: Linear, name: Name) -> Promise:
    """What a candidate promises beside a fit."""
    if name in MEASUREMENT:
        return _of_artefact(linear, name)
    system, fit = linear.system, linear.fit
    entry = CATALOGUE[name]
    starts = [dict(s) for s in entry.starting_values(system.fibre.values)]
    if name in BLIND:
        return Promise(name, np.nan, tuple({**fit.values, **s} for s in starts), np.nan)
    assert entry.effect is not None
    best = Promise(name, 0.0, ({**fit.values, **starts[0]},), linear.point.mean_square)
    for start in starts:
        problem = system.problem((*fit.names, name), {**fit.values, **start})
        try:
            column = Training(problem).force(problem.start) - linear.force
        except UserError:
            continue
        if not np.all(np.isfinite(column)):
            continue
        effect = float(start[entry.effect])
        information = np.array([(effect / entry.size) ** 2])
        moves, (share,), gain, mean_square = linear.solve(column[:, None], information, np.zeros(1))
        lower = next(c.lower for c in problem.coordinates if c.name == entry.effect)
        if share == 0.0 or (share < 0.0 and lower >= 0.0):
            continue
        if gain > best.gain:
            kept = float(np.sign(share) * np.clip(abs(share), _LEAST_SHARE, _MOST_SHARE))
            values = {**linear.values(moves * (kept / share)), **start, entry.effect: kept * effect}
            best = Promise(name, gain, (values,), mean_square)
    return best


def _of_artefact(linear: Linear, name: Name) -> Promise:
    system, fit = linear.system, linear.fit
    if name in ORDINARY:
        own = linear.descent.information.copy()
        mine = [j for j, c in enumerate(linear.descent.problem.coordinates) if c.name == name]
        own[mine] /= BEYOND**2
        moves, _, gain, mean_square = linear.solve(np.empty((linear.force.size, 0)), np.empty(0), np.empty(0), own)
        # What the fit pays already for an error that is larger than ordinary.
        released = 0.5 * (1.0 - BEYOND**-2.0) * float(np.sum(linear.point.prior[mine] ** 2))
        return Promise(name, gain + released, (linear.values(moves),), mean_square)
    problem = system.problem((*fit.names, name), fit.values)
    mine = [j for j, c in enumerate(problem.coordinates) if c.name == name]
    columns, _ = Training(problem).slopes_by(problem.start, mine)
    information = np.full(len(mine), (BEYOND * system.error_sd(name)) ** -2.0)
    moves, found, gain, mean_square = linear.solve(columns, information, np.zeros(len(mine)))
    values = {problem.coordinates[j].label: float(v) for j, v in zip(mine, found, strict=True)}
    return Promise(name, gain, ({**linear.values(moves), **values},), mean_square)
