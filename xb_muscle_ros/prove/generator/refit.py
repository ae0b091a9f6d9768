"""What is left of an effect once the parameters of the base have been fitted to it: the only size that matters."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.prove.generator.truth import Truth, study_forces
from xb_muscle_ros.prove.generator.world import Mesh, Stimulus, World

Array = npt.NDArray[np.float64]

_FITTED = ("f", "k11", "k21", "k22", "kon", "koop", "JF", "kappa", "n", "kse", "kse0")
_STEP = 0.02
_SWEEPS = 10
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
        rms: of what is left over all samples, F0.
        left: data minus base, F0, by trial.
        values: of the fitted constants.
    """

    rms: float
    left: list[Array]
    values: dict[str, float]


class Refit:
    """Fits of one plain base to studies of one plan; the Jacobian is taken once, at the true constants.

    Attributes:
        names: of the constants that are fitted by their logarithms; kpe and Fpe0 are fitted as well.
        jacobian: (samples of all trials, fitted constants), F0.
    """

    def __init__(self, base: World, study: Sequence[Stimulus]) -> None:
        """Take the Jacobian.

        Args:
            base: the plain world that the tool is given, with the true constants.
            study: stated calcium and recorded length of every trial.
        """
        self._base, self._study = base, list(study)
        self.names = tuple(name for name in _FITTED if name in base.values)
        self._at = np.zeros(len(self.names) + len(_PARALLEL_SD))
        self._plain = np.concatenate(self._forces(self._at))
        self.jacobian = self._jacobian_at(self._at, self._plain)
        n = self._plain.size
        self._weight = np.sqrt(_WORTH / n) / _WORTH_SD

    def plain(self) -> list[Array]:
        """Forces of the base at the true constants."""
        return self.split(self._plain)

    def left_at_once(self, forces: Sequence[Array]) -> float:
        """RMS left of data by a linear fit, F0."""
        r = np.concatenate(list(forces)) - self._plain
        return float(np.sqrt(np.mean((r - self.jacobian @ self._solve(self.jacobian, r, self._at)) ** 2)))

    def __call__(self, forces: Sequence[Array], thorough: bool = False) -> Refitted:
        """Fit data.

        Args:
            forces: of every trial, F0.
            thorough: take the Jacobian anew where the first descent ended, and go on from there.
        """
        data = np.concatenate(list(forces))
        at, model = self._descend(data, self._at, self._plain, self.jacobian)
        if thorough:
            at, model = self._descend(data, at, model, self._jacobian_at(at, model))
        left = data - model
        return Refitted(float(np.sqrt(np.mean(left**2))), self.split(left), self._values(at))

    def _descend(self, data: Array, at: Array, model: Array, jacobian: Array) -> tuple[Array, Array]:
        """Gauss–Newton steps with a Jacobian that learns from each of them (Broyden), shortened where need be."""
        cost = self._cost(data - model, at)
        for _ in range(_SWEEPS):
            step = self._solve(jacobian, data - model, at)
            step = step / max(1.0, float(np.max(np.abs(step))))
            for _ in range(4):
                trial = np.concatenate(self._forces(at + step))
                found = self._cost(data - trial, at + step)
                # The matrix learns to map the step taken to the change that was seen.
                jacobian = jacobian + np.outer(trial - model - jacobian @ step, step) / (step @ step)
                if found < cost:
                    break
                step = 0.35 * step
            else:
                break
            gain = cost - found
            at, model, cost = at + step, trial, found
            if gain < 0.01 * cost:
                break
        return at, model

    def _jacobian_at(self, at: Array, model: Array) -> Array:
        columns = []
        for i in range(at.size):
            moved = at.copy()
            moved[i] += _STEP
            columns.append((np.concatenate(self._forces(moved)) - model) / _STEP)
        return np.column_stack(columns)

    def _cost(self, r: Array, at: Array) -> float:
        return float(self._weight**2 * np.sum(r**2) + np.sum(at**2))

    def _solve(self, jacobian: Array, r: Array, at: Array) -> Array:
        """Step of the penalised least squares."""
        a = np.vstack([self._weight * jacobian, np.eye(at.size)])
        b = np.concatenate([self._weight * r, -at])
        step: Array = np.linalg.lstsq(a, b, rcond=None)[0]
        return step

    def _values(self, at: Array) -> dict[str, float]:
        values = {
            name: float(self._base.values[name] * np.exp(change)) for name, change in zip(self.names, at, strict=False)
        }
        for (name, sd), change in zip(_PARALLEL_SD.items(), at[len(self.names) :], strict=True):
            values[name] = float(self._base.values[name] + sd * change)
        return values

    def _forces(self, at: Array) -> list[Array]:
        return study_forces(Truth(self._base.with_values(self._values(at))), self._study, _COARSE)

    def split(self, joined: Array) -> list[Array]:
        """Samples of all trials by trial."""
        return np.split(joined, np.cumsum([s.length.size for s in self._study])[:-1])
