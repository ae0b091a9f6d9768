"""What is left of an effect once the parameters of the base have been fitted to it: the only size that matters."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.prove.generator.truth import Truth, study_forces
from xb_muscle_ros.prove.generator.world import Mesh, Stimulus, World

Array = npt.NDArray[np.float64]

_FITTED = ("f", "k11", "k21", "k22", "kon", "koop", "JF", "kappa", "n", "kse", "kse0", "kpe")
_STEP = 0.02
# The fit's samples are worth as many independent ones of this SD (F0), against priors of SD 1 on log-parameters.
_WORTH = 50.0
_WORTH_SD = 0.01
_FPE0_SD = 0.02
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
        names: of the constants that are fitted by their logarithms; Fpe0 is fitted as well.
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
        self._at = np.zeros(len(self.names) + 1)
        self._plain = np.concatenate(self._forces(self._at))
        columns = []
        for i in range(self._at.size):
            moved = self._at.copy()
            moved[i] = _STEP
            columns.append((np.concatenate(self._forces(moved)) - self._plain) / _STEP)
        self.jacobian = np.column_stack(columns)
        n = self._plain.size
        self._weight = np.sqrt(_WORTH / n) / _WORTH_SD

    def plain(self) -> list[Array]:
        """Forces of the base at the true constants."""
        return self._split(self._plain)

    def left_at_once(self, forces: Sequence[Array]) -> float:
        """RMS left of data by a linear fit, F0."""
        r = np.concatenate(list(forces)) - self._plain
        step = self._solve(self.jacobian, r, self._at)
        return float(np.sqrt(np.mean((r - self.jacobian @ step) ** 2)))

    def __call__(self, forces: Sequence[Array], sweeps: int = 10) -> Refitted:
        """Fit data: Gauss–Newton steps with a Jacobian that learns from each step (Broyden), halved where need be."""
        data = np.concatenate(list(forces))
        at, jacobian = self._at.copy(), self.jacobian.copy()
        model = self._plain
        cost = self._cost(data - model, at)
        for _ in range(sweeps):
            step = self._solve(jacobian, data - model, at)
            taken = False
            for _ in range(4):
                trial = np.concatenate(self._forces(at + step))
                found = self._cost(data - trial, at + step)
                # Secant update: the matrix maps the step taken to the change that was seen.
                seen = trial - model - jacobian @ step
                jacobian = jacobian + np.outer(seen, step) / (step @ step)
                if found < cost:
                    taken = True
                    break
                step = 0.35 * step
            if not taken:
                break
            gain = cost - found
            at, model, cost = at + step, trial, found
            if gain < 0.01 * cost:
                break
        left = data - model
        return Refitted(float(np.sqrt(np.mean(left**2))), self._split(left), self._values(at))

    def _cost(self, r: Array, at: Array) -> float:
        return float(self._weight**2 * np.sum(r**2) + np.sum(at**2))

    def _solve(self, jacobian: Array, r: Array, at: Array) -> Array:
        """Step of the penalised least squares; log-parameters move by no more than 1 at once."""
        a = np.vstack([self._weight * jacobian, np.eye(at.size)])
        b = np.concatenate([self._weight * r, -at])
        step: Array = np.linalg.lstsq(a, b, rcond=None)[0]
        return step / max(1.0, float(np.max(np.abs(step))))

    def _values(self, at: Array) -> dict[str, float]:
        values = {
            name: float(self._base.values[name] * np.exp(change))
            for name, change in zip(self.names, at[:-1], strict=True)
        }
        return {**values, "Fpe0": float(self._base.values["Fpe0"] + _FPE0_SD * at[-1])}

    def _forces(self, at: Array) -> list[Array]:
        return study_forces(Truth(self._base.with_values(self._values(at))), self._study, _COARSE)

    def _split(self, joined: Array) -> list[Array]:
        return np.split(joined, np.cumsum([s.length.size for s in self._study])[:-1])
