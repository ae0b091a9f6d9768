"""Held-out scores of explanations: every trial predicted by fits that did not see it, and what they say of a pair."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.diagnose.refit import Fit, refit_task
from xb_muscle_ros.diagnose.study import Study
from xb_muscle_ros.work import Options, run

Array = npt.NDArray[np.float64]

# Mean square of a held-out trial where the model has no solution, F0².
_NOWHERE = 1.0
_LEAST = 1e-12


def folds_of(study: Study, folds: int) -> list[frozenset[str]]:
    """Trials in groups that are held out together: whole trials, those of like conditions in different groups.

    Empty where there are fewer than three trials: nothing is held out then.
    """
    names = [t.name for t in study.trials]
    if len(names) < 3:
        return []
    count = min(folds, len(names))
    order = sorted(range(len(names)), key=lambda i: (float(study.trials[i].calcium_um[0]), i))
    return [frozenset(names[i] for i in order[k::count]) for k in range(count)]


class HeldOut(NamedTuple):
    """Scores of one explanation on trials that its fits did not see.

    Attributes:
        mse: mean square difference by trial, F0².
        samples: of each trial.
    """

    mse: Mapping[str, float]
    samples: Mapping[str, int]

    @property
    def rmsd_f0(self) -> float:
        """Over all samples, F0."""
        total = sum(self.mse[name] * n for name, n in self.samples.items())
        return float(np.sqrt(total / sum(self.samples.values())))


class Difference(NamedTuple):
    """How much better one explanation predicts than another.

    Attributes:
        delta_elpd: sum over trials of the logarithm of the ratio of their differences: each trial counts once.
        se: its standard error over trials.
    """

    delta_elpd: float
    se: float


def held_out(
    study: Study, fits: Sequence[Fit], folds: Sequence[frozenset[str]], most: int, options: Options
) -> dict[str, HeldOut]:
    """Scores of explanations by label.

    Args:
        study: all trials.
        fits: to all of them; refits start there.
        folds: see `folds_of`.
        most: points to try in a refit.
        options: where the work is done.
    """
    plain = study.to_json()
    tasks = [
        {
            "study": plain,
            "names": [n.value for n in fit.explanation.names],
            "starts": [dict(fit.values)],
            "held_out": sorted(fold),
            "most": most,
            "predict": True,
        }
        for fit in fits
        for fold in folds
    ]
    rows = run(refit_task, tasks, replace(options, label="held out"))
    samples = {t.name: t.measured_f0.size for t in study.trials}
    found: dict[str, HeldOut] = {}
    for i, fit in enumerate(fits):
        mse: dict[str, float] = {}
        for j, fold in enumerate(folds):
            row = rows[i * len(folds) + j]
            mse.update(row["heldout_mse"] if row is not None else dict.fromkeys(fold, _NOWHERE))
        found[fit.explanation.label] = HeldOut(mse, samples)
    return found


def difference(better: HeldOut, worse: HeldOut) -> Difference:
    """How much better the first predicts than the second, trial by trial."""
    gains = np.array(
        [0.5 * np.log(max(worse.mse[name], _LEAST) / max(better.mse[name], _LEAST)) for name in better.samples]
    )
    se = float(np.std(gains, ddof=1) * np.sqrt(gains.size)) if gains.size > 1 else float("inf")
    return Difference(float(np.sum(gains)), se)
