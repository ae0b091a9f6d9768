"""What a fit left, seen by the statistics: residuals with their trials' facts, significance, law, flexible bound."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.diagnose.cells import Residual
from xb_muscle_ros.diagnose.conflict import Conflict, conflicts
from xb_muscle_ros.diagnose.flexible import flexible_fit
from xb_muscle_ros.diagnose.kernel import Law, law
from xb_muscle_ros.diagnose.linear_fit import LinearFit
from xb_muscle_ros.diagnose.refit import Fit
from xb_muscle_ros.diagnose.screen import Linear
from xb_muscle_ros.diagnose.significance import Significance, significance
from xb_muscle_ros.diagnose.study import Study
from xb_muscle_ros.errors import naming
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.scores.noise.model import NoiseModel
from xb_muscle_ros.scores.noise.trials import noise_of
from xb_muscle_ros.trials.trial import Trial

Array = npt.NDArray[np.float64]


class Bound(NamedTuple):
    """Held-out RMSD of fits taken as linear, on one footing, F0.

    Attributes:
        before_f0: parameters alone.
        after_f0: the explanation.
        flexible_f0: parameters and a discrepancy without physics, which an explanation is measured by.
    """

    before_f0: float
    after_f0: float
    flexible_f0: float

    def share(self, refitted_f0: float) -> float | None:
        """Of the flexible discrepancy's gain that the explanation reaches; None where that gains nothing.

        Args:
            refitted_f0: held-out RMSD of refits of the explanation. The better one counts: a fit taken as linear runs
                away where a shape is hardly known, a refit may get stuck, and neither has seen those trials.
        """
        most = self.before_f0 - self.flexible_f0
        return (self.before_f0 - min(self.after_f0, refitted_f0)) / most if most > 0.0 else None


@dataclass(frozen=True)
class Recordings:
    """The trials themselves beside the study that is made of them.

    Attributes:
        trials: in the order of the study.
        noise: of each.
        draws: of the bootstrap.
        seed: of its draws.
    """

    trials: tuple[Trial, ...]
    noise: NoiseModel
    draws: int
    seed: int

    @staticmethod
    def of(trials: Sequence[Trial], draws: int, seed: int) -> Recordings:
        """With the noise that their isometric windows show.

        Raises:
            UserError: no trial holds still for long enough.
        """
        return Recordings(tuple(trials), noise_of(trials), draws, seed)

    def residuals(self, study: Study, linear: Linear) -> list[Residual]:
        """What a fit left of every trial."""
        edges = np.cumsum([0, *(t.measured_f0.size for t in study.trials)])
        found = []
        for trial, fitted, begin, end in zip(self.trials, study.trials, edges[:-1], edges[1:], strict=True):
            found.append(
                Residual(
                    trial=fitted.name,
                    pca=trial.facts.pca,
                    time_s=fitted.force_time_s,
                    value_f0=linear.residual_f0[begin:end],
                    phases=trial.facts.phases,
                    length_l0=np.interp(fitted.force_time_s, fitted.time_s, fitted.length_l0),
                    calcium_um=np.interp(fitted.force_time_s, fitted.time_s, fitted.calcium_um),
                )
            )
        return found

    def significance(self, study: Study, linear: Linear) -> Significance:
        """Of what a fit left."""
        return significance(self.residuals(study, linear), linear.fit, self.noise, self.draws, self.seed)

    def usual_noise_f0(self) -> float:
        """Median over trials of the noise's standard deviation, F0: one trial's slow creep is not everybody's noise."""
        return float(np.median([noise.sd_f0 for noise in self.noise.trials]))

    def conflicts(self, study: Study, linear: Linear) -> list[Conflict]:
        """Whether parts of the study want parameters that conflict."""
        return conflicts(self.residuals(study, linear), linear.fit, self.noise)

    def law(self, study: Study, linear: Linear) -> Law | None:
        """The law of what a fit left."""
        return law(self.residuals(study, linear), linear.fit, _scalings(study, linear))

    def bound(self, study: Study, base: Linear, last: Linear, folds: Sequence[frozenset[str]]) -> Bound | None:
        """What base, explanation and a flexible discrepancy foretell of trials left out; None without folds."""
        found = (
            self._foretold(study, base, folds, False),
            self._foretold(study, last, folds, False),
            self._foretold(study, base, folds, True),
        )
        before, after, flexible = found
        return None if before is None or after is None or flexible is None else Bound(before, after, flexible)

    def _foretold(self, study: Study, linear: Linear, folds: Sequence[frozenset[str]], flexible: bool) -> float | None:
        """Held-out RMSD of a fit taken as linear, F0; None where a fold leaves nothing to learn from.

        Args:
            study: all trials.
            linear: the fit to all of them; coordinates give way to what they would be had a fold not been fitted.
            folds: held out together.
            flexible: add what a discrepancy without physics learns from the other trials: the bound for a mechanism.
        """
        found = self.residuals(study, linear)
        scalings = _scalings(study, linear) if flexible else {}
        squares, samples = 0.0, 0
        for fold in folds:
            held = [r.trial in fold for r in found]
            if all(held):
                return None
            weights = linear.fit.weights * np.repeat([0.0 if h else 1.0 for h in held], [r.time_s.size for r in found])
            without = LinearFit(linear.fit.slopes, weights, linear.fit.prior)
            value = without.left(linear.residual_f0[:, None])[:, 0]
            edges = np.cumsum([0, *(r.time_s.size for r in found)])
            here = [r._replace(value_f0=value[a:b]) for r, a, b in zip(found, edges[:-1], edges[1:], strict=True)]
            left = [r.value_f0 for r, h in zip(here, held, strict=True) if h]
            if flexible:
                told = flexible_fit(here, held, without, scalings).predicted_f0
                left = [value - prediction for value, prediction in zip(left, told, strict=True)]
            squares += sum(float(np.sum(part**2)) for part in left)
            samples += sum(part.size for part in left)
        return float(np.sqrt(squares / samples)) if samples else None


def _scalings(study: Study, linear: Linear) -> dict[str, list[Array]]:
    """What a law may scale with, at the times of the force: activation, calcium and force."""
    muscle = Muscle(linear.problem.fibre_at(linear.problem.start))
    activation, calcium, force = [], [], []
    for trial in study.trials:
        with naming(f"trial {trial.name}"):
            state = muscle.settle(float(trial.length_l0[0]), float(trial.calcium_um[0]))
            out = muscle.outputs_of(muscle.run(state, trial.dt_s, trial.length_l0, trial.calcium_um))
        activation.append(np.interp(trial.force_time_s, trial.time_s, out["n_on"]))
        force.append(np.interp(trial.force_time_s, trial.time_s, out["force_ce_f0"]))
        given = np.interp(trial.force_time_s, trial.time_s, trial.calcium_um)
        calcium.append(given / (given + 1.0))
    return {"activation": activation, "calcium": calcium, "force": force}


def simulated(study: Study, fit: Fit) -> list[Array]:
    """Recorded force of every trial at the times that count by a fit, F0."""
    problem = fit.problem(study)
    return problem.predicted(problem.start)


def rmsd(measured: Sequence[Array], predicted: Sequence[Array]) -> float:
    """Root-mean-square difference over all samples of all trials, F0."""
    squares = sum(float(np.sum((m - p) ** 2)) for m, p in zip(measured, predicted, strict=True))
    return float(np.sqrt(squares / sum(m.size for m in measured)))
