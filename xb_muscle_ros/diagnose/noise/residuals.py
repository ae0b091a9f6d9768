"""Residuals of a fit in every trial, beside the noise of its recording."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from xb_muscle_ros.diagnose.noise.cells import Residual, slices
from xb_muscle_ros.diagnose.noise.discrepancy import discrepancy
from xb_muscle_ros.diagnose.noise.law import law
from xb_muscle_ros.diagnose.noise.significance import Significance, significance
from xb_muscle_ros.diagnose.residual import ResidualLaw
from xb_muscle_ros.diagnose.search.descent import Fit
from xb_muscle_ros.diagnose.search.system import System
from xb_muscle_ros.errors import naming
from xb_muscle_ros.fit.linear_fit import LinearFit
from xb_muscle_ros.fit.problem import Problem
from xb_muscle_ros.fit.training import Training
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.scores.noise.model import NoiseModel
from xb_muscle_ros.simulation.offline import outputs
from xb_muscle_ros.trials.trial import Array, Trial


@dataclass(frozen=True)
class Around:
    """A fit at all samples that were recorded, taken as linear.

    Attributes:
        problem: with the fit as its start.
        residual_f0: measured less simulated force of all trials, one below the other, F0.
        fit: normal equations, without coordinates at a bound.
    """

    problem: Problem
    residual_f0: Array
    fit: LinearFit

    @staticmethod
    def of(recorded: System, fit: Fit, effective_samples: float) -> Around:
        """A fit of thinned trials, which had so many independent residuals, in the system with all samples."""
        problem = recorded.problem(fit.names, fit.values)
        training = Training(problem)
        slopes, _ = training.slopes(problem.start)
        lower, upper = problem.bounds
        margin = 1e-6 * np.maximum(1.0, np.abs(upper - lower))
        free = (problem.start > lower + margin) & (problem.start < upper - margin)
        residual = training.measured - training.force(problem.start)
        scale = max(float(np.sqrt(np.mean(residual**2))), recorded.noise_f0)
        weights = np.full(residual.size, np.sqrt(effective_samples / residual.size) / scale)
        return Around(problem, residual, LinearFit(np.nan_to_num(slopes[:, free]), weights, problem.information[free]))

    def by_trial(self) -> list[Array]:
        """The residual of each trial."""
        sizes = [t.measured_f0.size for t in self.problem.trials]
        return np.split(self.residual_f0, np.cumsum(sizes)[:-1])


@dataclass(frozen=True)
class Recordings:
    """The trials of one fibre, in the order of its system, with their noise; draws and seed are of the bootstrap."""

    trials: tuple[Trial, ...]
    noise: NoiseModel
    draws: int
    seed: int

    def residuals(self, around: Around) -> list[Residual]:
        """Residual of every trial."""
        found = []
        for trial, fitted, value in zip(self.trials, around.problem.trials, around.by_trial(), strict=True):
            times = fitted.force_time_s
            found.append(
                Residual(
                    trial=fitted.name,
                    pca=trial.facts.pca,
                    time_s=times,
                    value_f0=value,
                    phases=trial.facts.phases,
                    length_l0=np.interp(times, fitted.time_s, fitted.length_l0),
                    calcium_um=np.interp(times, fitted.time_s, fitted.calcium_um),
                )
            )
        return found

    def significance(self, around: Around) -> Significance:
        """Of a fit's residual."""
        return significance(self.residuals(around), around.fit, self.noise, self.draws, self.seed)

    def usual_noise_f0(self) -> float:
        """Median over trials of the noise's standard deviation, F0: one trial's slow creep is not everybody's noise."""
        return float(np.median([noise.sd_f0 for noise in self.noise.trials]))

    def law(self, around: Around) -> ResidualLaw | None:
        """The law of a fit's residual."""
        return law(around.problem.fibre.name, self.residuals(around), around.fit, _scalings(around.problem))

    def benchmark(self, around: Around, folds: Sequence[Collection[str]]) -> tuple[float, int] | None:
        """Squared error of held-out trials by a fit taken as linear with a discrepancy without physics.

        Returns:
            sum of squares, F0², and samples; None where a fold leaves nothing to learn from.
        """
        found, scalings = self.residuals(around), _scalings(around.problem)
        total, samples = 0.0, 0
        for fold in folds:
            held = [r.trial in fold for r in found]
            if all(held):
                return None
            weights = around.fit.weights * np.repeat([0.0 if h else 1.0 for h in held], [r.time_s.size for r in found])
            without = LinearFit(around.fit.slopes, weights, around.fit.prior)
            value = without.residual(around.residual_f0[:, None])[:, 0]
            parts = slices(found, value.size)
            here = [r._replace(value_f0=value[part]) for r, part in zip(found, parts, strict=True)]
            predicted = discrepancy(here, held, without, scalings).predicted_f0
            held_out = [r.value_f0 for r, h in zip(here, held, strict=True) if h]
            total += sum(float(np.sum((v - p) ** 2)) for v, p in zip(held_out, predicted, strict=True))
            samples += sum(v.size for v in held_out)
        return total, samples


def _scalings(problem: Problem) -> Mapping[str, list[Array]]:
    """What a law may scale with, at the times of the force: activation, calcium and force."""
    muscle = Muscle(problem.fibre_at(problem.start))
    activation, calcium, force = [], [], []
    for trial in problem.trials:
        with naming(f"trial {trial.name}"):
            out = outputs(muscle, trial.dt_s, trial.length_l0, trial.calcium_um)
        activation.append(np.interp(trial.force_time_s, trial.time_s, out["n_on"]))
        force.append(np.interp(trial.force_time_s, trial.time_s, out["force_ce_f0"]))
        given = np.interp(trial.force_time_s, trial.time_s, trial.calcium_um)
        calcium.append(given / (given + 1.0))
    return {"activation": activation, "calcium": calcium, "force": force}
