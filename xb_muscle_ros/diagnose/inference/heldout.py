"""Conditions left out of the fit, and what sets predict of them.

A held-out trial's own errors (its solution's pCa, its zero of force) come from its force before anything moves, and
from nothing else (`fit.calibration`).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from xb_muscle_ros.diagnose.component import HeldOutGain
from xb_muscle_ros.diagnose.search.descent import Fit, fitted
from xb_muscle_ros.diagnose.search.explore import Explorer
from xb_muscle_ros.diagnose.search.system import SATURATING, Names, System
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.fit.calibration import calibrated_force
from xb_muscle_ros.fit.correction import Correction
from xb_muscle_ros.fit.data import FitTrial
from xb_muscle_ros.trials.trial import Array
from xb_muscle_ros.work import run

Trials = Mapping[tuple[int, str], Array]
"""Force by fibre (its place in the study) and trial, F0."""

UNIT = "log RMSD ratio"
# Differences below this are none, F0: a recording is not better known.
LEAST_F0 = 5e-4


def folds_of(trials: Sequence[FitTrial], most: int) -> list[frozenset[str]]:
    """Trials that are left out together: whole solutions where each has trials enough, else trials spread over them.

    The solution that defines F0 stays in every fit then: without it nobody knows what force is measured in. Empty where
    there are fewer than three trials.
    """
    if len(trials) < 3:
        return []
    count = Counter(t.solution for t in trials)
    if len(count) >= 3 and min(count.values()) >= 2:
        groups = [frozenset(t.name for t in trials if t.solution == s) for s in count if s != SATURATING]
        if len(groups) <= most:
            return groups
    order = sorted(range(len(trials)), key=lambda i: (float(trials[i].calcium_um[0]), i))
    folds = min(most, len(trials))
    return [frozenset(trials[i].name for i in order[k::folds]) for k in range(folds)]


def predict_task(task: Mapping[str, Any]) -> list[list[float]] | None:
    """Forces of held-out trials by a set that is fitted without them; None where the model has no solution."""
    system = System.from_json(task["system"])
    trials = [FitTrial.from_json(row) for row in task["trials"]]
    held = {t.name for t in trials}
    found = fitted(system.without(held), task["names"], [task["values"]], task["most"], task["tolerance"])
    if found is None:
        return None
    closure = {name: np.array(values) for name, values in task["closure_f0"].items()}
    try:
        return [predicted(system.without(held), found, trial, closure.get(trial.name)).tolist() for trial in trials]
    except UserError:
        return None


def predicted(system: System, fit: Fit, trial: FitTrial, closure_f0: Array | None) -> Array:
    """Recorded force of a trial that a fit did not see, F0.

    Raises:
        UserError: the model has no solution.
    """
    problem = system.problem(fit.names, fit.values)
    own = None if closure_f0 is None else Correction.level({trial.name: closure_f0}, np.zeros(len(problem.features)))
    problem = replace(problem, correction=own)
    return calibrated_force(problem, problem.start, trial).force_f0


class HeldOut:
    """Predictions of every left-out trial by every set that was asked for.

    Attributes:
        folds: of each fibre, which are left out in turn; empty where nothing can be.
    """

    def __init__(self, explorer: Explorer, recorded: Sequence[System]) -> None:
        self.explorer, self.recorded = explorer, list(recorded)
        self.folds = [folds_of(system.trials, explorer.effort.folds) for system in recorded]
        self._found: dict[Names, dict[tuple[int, str], Array]] = {}

    def __bool__(self) -> bool:
        return any(self.folds)

    def predict(self, sets: Collection[Names]) -> None:
        """Predict the left-out trials by fits of sets that did not see them."""
        missing = [names for names in dict.fromkeys(sets) if names not in self._found]
        tasks, places = [], []
        for names in missing:
            for i, (system, full, folds) in enumerate(
                zip(self.explorer.systems, self.recorded, self.folds, strict=True)
            ):
                plain = system.to_json()
                for fold in folds:
                    trials = [t for t in full.trials if t.name in fold]
                    task = {
                        "system": plain,
                        "trials": [t.to_json() for t in trials],
                        "closure_f0": {t.name: full.closure_f0[t.name].tolist() for t in trials if full.closure_f0},
                        "names": list(names),
                        "values": dict(self.explorer.fits[names][i].values),
                        "most": max(2, self.explorer.effort.most // 2),
                        "tolerance": self.explorer.effort.tolerance,
                    }
                    tasks.append(task)
                    places.append((names, i, [t.name for t in trials]))
        rows = run(predict_task, tasks, replace(self.explorer.options, label="held out")) if tasks else []
        for (names, i, held), row in zip(places, rows, strict=True):
            found = self._found.setdefault(names, {})
            for k, name in enumerate(held):
                if row is not None:
                    found[i, name] = np.array(row[k])

    def forces(self, names: Names) -> Trials:
        """Predictions by a set; trials without a solution are not among them."""
        return self._found.get(names, {})

    def rmsd_by_trial(self, names: Names) -> dict[tuple[int, str], float]:
        """Of each left-out trial, F0; infinite where the model had no solution."""
        found = self.forces(names)
        out = {}
        for i, (full, folds) in enumerate(zip(self.recorded, self.folds, strict=True)):
            held = set().union(*folds) if folds else set()
            for t in full.trials:
                if t.name in held:
                    force = found.get((i, t.name))
                    rms = np.inf if force is None else float(np.sqrt(np.mean((force - t.measured_f0) ** 2)))
                    out[i, t.name] = rms
        return out

    def rmsd(self, names: Names, fibre: int | None = None) -> float | None:
        """Over all samples of all left-out trials, F0; None where there are none, or one has no solution."""
        by_trial = self.rmsd_by_trial(names)
        sizes = {(i, t.name): t.measured_f0.size for i, s in enumerate(self.recorded) for t in s.trials}
        chosen = [key for key in by_trial if fibre is None or key[0] == fibre]
        if not chosen or names not in self._found:
            return None
        total = sum(by_trial[key] ** 2 * sizes[key] for key in chosen)
        value = float(np.sqrt(total / sum(sizes[key] for key in chosen)))
        return value if np.isfinite(value) else None

    def gain(self, better: Names, worse: Names, fibre: int | None = None) -> HeldOutGain | None:
        """What one set gains over another; None where nothing was left out, or a trial has no solution."""
        with_f0, without_f0 = self.rmsd(better, fibre), self.rmsd(worse, fibre)
        if with_f0 is None or without_f0 is None:
            return None
        own, other = self.rmsd_by_trial(better), self.rmsd_by_trial(worse)
        keys = [key for key in own if fibre is None or key[0] == fibre]
        logs = np.array([np.log(max(other[k], LEAST_F0) / max(own[k], LEAST_F0)) for k in keys])
        se = float(np.std(logs, ddof=1) / np.sqrt(logs.size)) if logs.size > 1 else float("inf")
        return HeldOutGain(float(np.mean(logs)), min(se, 1e3), UNIT, int(logs.size), without_f0, with_f0)
