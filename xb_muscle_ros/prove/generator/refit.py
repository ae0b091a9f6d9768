"""The residual of an effect once the parameters of the base have been fitted to it: the only size that matters."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from xb_muscle_ros.prove.generator.truth import Truth, study_forces
from xb_muscle_ros.prove.generator.world import Mesh, Stimulus, World
from xb_muscle_ros.trials.trial import Array

_FITTED = ("f", "k11", "k21", "k22", "kon", "koop", "JF", "kappa", "n", "kse", "kse0")
_STEP = 0.02
# Steps at most, how far one may go, and the relative gain below which there is no next one.
_STEPS, _FARTHEST, _ENOUGH = 20, 0.7, 0.01
# The fit's samples are worth as many independent ones of this SD (F0), against priors of SD 1 on log-parameters.
_WORTH = 50.0
_WORTH_SD = 0.01
# The parallel spring is fitted by its values: it may be next to nothing.
_PARALLEL_SD = {"kpe": 0.003, "Fpe0": 0.02}
# Fits want differences, not values: steps of 0.5 ms are good to 0.002 % of F0.
_COARSE = Mesh(steps=2)


class Refitted(NamedTuple):
    """A refit of the plain base.

    Attributes:
        rms: of the residual over all samples, F0.
        residual: data minus base, F0, by trial.
        at: where these lie: changes of their logarithms, and of the parallel spring.
    """

    rms: float
    residual: list[Array]
    values: dict[str, float]
    at: Array


class Refit:
    """Fits of one plain base to studies of one plan, by Levenberg and Marquardt's method.

    Attributes:
        names: of the constants that are fitted by their logarithms; kpe and Fpe0 are fitted as well.
        jacobian: at the true constants, (samples of all trials, fitted constants), F0.
    """

    def __init__(
        self, base: World, study: Sequence[Stimulus], dress: Callable[[World], Truth] = Truth, mesh: Mesh = _COARSE
    ) -> None:
        """Take the Jacobian at the true constants of the plain world that the tool is given.

        Args:
            study: stated calcium and recorded length of every trial.
            dress: puts on it the effects that the model has as well.
        """
        self._base, self._study, self._dress, self._mesh = base, list(study), dress, mesh
        self.names = tuple(name for name in _FITTED if name in base.values)
        self._at = np.zeros(len(self.names) + len(_PARALLEL_SD))
        self._plain = self._model(self._at)
        self.jacobian = self._jacobian_at(self._at, self._plain)
        n = self._plain.size
        self._weight = np.sqrt(_WORTH / n) / _WORTH_SD

    def plain(self) -> list[Array]:
        """Forces of the base at the true constants."""
        return self.split(self._plain)

    def linear_rms(self, forces: Sequence[Array]) -> float:
        """RMS residual of a linear fit, F0."""
        r = np.concatenate(list(forces)) - self._plain
        return float(np.sqrt(np.mean((r - self.jacobian @ self._solve(self.jacobian, r, self._at)) ** 2)))

    def __call__(self, forces: Sequence[Array], start: Refitted | None = None) -> Refitted:
        """Fit data.

        Args:
            forces: of every trial, F0.
            start: a fit of like data to go on from; None for the true constants.
        """
        data = np.concatenate(list(forces))
        at, model, jacobian = self._at, self._plain, self.jacobian
        if start is not None and self._cost(data - (found := self._model(start.at)), start.at) < self._cost(
            data - model, at
        ):
            at, model, jacobian = start.at, found, self._jacobian_at(start.at, found)
        at, model = self._descend(data, at, model, jacobian)
        residual = data - model
        return Refitted(float(np.sqrt(np.mean(residual**2))), self.split(residual), self.values_at(at), at)

    def _descend(self, data: Array, at: Array, model: Array, jacobian: Array) -> tuple[Array, Array]:
        """Damped Gauss-Newton steps, the Jacobian taken anew after each.

        Effects that slow or weaken every head lie in a long bent valley of the constants: shortcuts end in its walls.
        """
        cost, damping = self._cost(data - model, at), 1e-3
        for _ in range(_STEPS):
            last = cost
            for _ in range(6):
                step = self._solve(jacobian, data - model, at, damping)
                step = step * min(1.0, _FARTHEST / max(float(np.max(np.abs(step))), 1e-12))
                trial = self._model(at + step)
                found = self._cost(data - trial, at + step)
                if found < cost:
                    at, model, cost, damping = at + step, trial, found, max(damping / 5.0, 1e-6)
                    break
                damping *= 8.0
            # A cost that is not finite fails every comparison.
            if not last - cost >= _ENOUGH * cost:
                break
            jacobian = self._jacobian_at(at, model)
        return at, model

    def _jacobian_at(self, at: Array, model: Array) -> Array:
        columns = []
        for i in range(at.size):
            moved = at.copy()
            moved[i] += _STEP
            columns.append((self._model(moved) - model) / _STEP)
        return np.column_stack(columns)

    def _cost(self, r: Array, at: Array) -> float:
        return float(self._weight**2 * np.sum(r**2) + np.sum(at**2))

    def _solve(self, jacobian: Array, r: Array, at: Array, damping: float = 0.0) -> Array:
        """Step of the penalised least squares."""
        curvature = self._weight**2 * jacobian.T @ jacobian + np.eye(at.size)
        curvature[np.diag_indices(at.size)] *= 1.0 + damping
        step: Array = np.linalg.solve(curvature, self._weight**2 * jacobian.T @ r - at)
        return step

    def values_at(self, at: Array) -> dict[str, float]:
        """Constants where their coordinates are so."""
        values = {
            name: float(self._base.values[name] * np.exp(change)) for name, change in zip(self.names, at, strict=False)
        }
        for (name, sd), change in zip(_PARALLEL_SD.items(), at[len(self.names) :], strict=True):
            values[name] = float(self._base.values[name] + sd * change)
        return values

    def _model(self, at: Array) -> Array:
        world = self._base.with_values(self.values_at(at))
        return np.concatenate(study_forces(self._dress(world), self._study, self._mesh))

    def split(self, joined: Array) -> list[Array]:
        """Samples of all trials by trial."""
        return np.split(joined, np.cumsum([s.length.size for s in self._study])[:-1])
