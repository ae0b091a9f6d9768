"""The residual of a model that lacks something, once all that it has is fitted again, ordinary artefacts among it."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from xb_muscle_ros.trials.trial import Array

# Ten independent observations of 0.3 % F0 a trial, against priors of SD 1 on every coordinate.
WORTH, WORTH_SD = 10.0, 0.003
# Simulations between two takings of slopes at most, the relative gain that is one, and how many without it end them.
_MODELS, _GAIN, _IDLE = 18, 0.05, 4
# What slopes taken anew are to gain, or else it was the last time; twice they are taken anyway.
_WORTHWHILE, _SURELY = 0.1, 2
# How far one step may go in a logarithm.
_FARTHEST = 0.7


class LinearFit(NamedTuple):
    """A linear fit.

    Attributes:
        residual: F0, shape (samples,).
        prior_residual: how far each coordinate went, in SDs of its prior, shape (coordinates,).
    """

    residual: Array
    prior_residual: Array

    @property
    def rms(self) -> float:
        """Of the residual, F0."""
        return float(np.sqrt(np.mean(self.residual**2)))


class Rest:
    """All that may change to take up a difference: constants, other effects' scales, ordinary measurement artefacts."""

    def __init__(self, columns: Array, trials: int) -> None:
        """Take the change of all forces by one prior SD of each coordinate.

        Args:
            columns: shape (samples of all trials, coordinates), F0.
        """
        self._columns = columns
        self._weight = np.sqrt(WORTH * trials / self._columns.shape[0]) / WORTH_SD

    def fit(self, difference: Array) -> LinearFit:
        """Penalised least squares of data minus model, F0, shape (samples,); NaN where these are not finite."""
        if not (np.all(np.isfinite(difference)) and np.all(np.isfinite(self._columns))):
            return LinearFit(np.full(difference.size, np.nan), np.full(self._columns.shape[1], np.nan))
        a = self._weight * self._columns
        factor = cho_factor(a.T @ a + np.eye(a.shape[1]))
        at: Array = cho_solve(factor, self._weight * (a.T @ difference))
        return LinearFit(difference - self._columns @ at, at)

    def refit(
        self, data: Array, model: Callable[[Array], Array], slopes: Callable[[Array], Array], logarithms: int,
        anew: int,
    ) -> LinearFit:  # fmt: skip
        """Fit data by damped Gauss-Newton steps whose slopes are corrected by what each step has shown (Broyden).

        Args:
            data: F0, shape (samples,).
            model: forces at coordinates, in SDs of their priors.
            slopes: change of all forces by each coordinate, there.
            logarithms: so many coordinates, the first, are logarithms: a step is not to go far in them.
            anew: how often slopes may be taken anew where such steps gain no more.
        """
        at = np.zeros(self._columns.shape[1])
        force, columns = model(at), self._columns
        cost = self._cost(data - force, at)
        for taken in range(anew + 1):
            before = cost
            at, force, cost = self._descend(data, model, logarithms, at, force, columns)
            if taken == anew or (taken >= _SURELY and not cost < (1.0 - _WORTHWHILE) * before):
                break
            columns = slopes(at)
        return LinearFit(data - force, at)

    def _descend(
        self, data: Array, model: Callable[[Array], Array], logarithms: int, at: Array, force: Array, columns: Array
    ) -> tuple[Array, Array, float]:
        """Steps from one taking of slopes; where they led, forces there, and their cost."""
        columns, damping, idle = columns.copy(), 1e-3, 0
        cost = self._cost(data - force, at)
        for _ in range(_MODELS):
            step = self._step(columns, data - force, at, damping)
            step *= min(1.0, _FARTHEST / max(float(np.max(np.abs(step[:logarithms]))), 1e-12))
            found = model(at + step)
            then = self._cost(data - found, at + step)
            if np.isfinite(then) and np.any(step):
                columns += np.outer(found - force - columns @ step, step) / (step @ step)
            idle = 0 if then < (1.0 - _GAIN) * cost else idle + 1
            if then < cost:
                at, force, cost, damping = at + step, found, then, max(damping / 5.0, 1e-6)
            else:
                damping *= 10.0
            if idle > _IDLE:
                break
        return at, force, cost

    def _cost(self, residual: Array, at: Array) -> float:
        return float(self._weight**2 * np.sum(residual**2) + np.sum(at**2))

    def _step(self, columns: Array, residual: Array, at: Array, damping: float) -> Array:
        a = self._weight * columns
        curvature = a.T @ a + np.eye(at.size)
        curvature[np.diag_indices(at.size)] *= 1.0 + damping
        return np.asarray(np.linalg.solve(curvature, self._weight * (a.T @ residual) - at))
