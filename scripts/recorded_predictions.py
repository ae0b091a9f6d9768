"""Held-out trials as two fibre files predict them: the fitted base, and the answer's augmented fibre.

A prediction has nothing of the held-out trial but what its own force tells before anything moves: its solution's pCa
shift and its force offset (`fit.calibration`). Measurement errors that a study shares (time shift, length gain) are
taken as the study has them where held-out trials were recorded as the training ones were, and have no part elsewhere.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.diagnose.noise.closure import by_distribution, has_closure
from xb_muscle_ros.diagnose.result import Diagnosis
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.fit.calibration import Calibrated, calibrated_force
from xb_muscle_ros.fit.coordinates import fault_coordinates
from xb_muscle_ros.fit.data import FitTrial, fit_trials
from xb_muscle_ros.fit.problem import Problem
from xb_muscle_ros.models.fibre_file import Fibre, changed, load_fibre
from xb_muscle_ros.trials.trial import Trial

Array = npt.NDArray[np.float64]

# Artefacts that a trial's force tells before anything moves.
_OWN = ("pca_shift", "force_offset")
# Artefacts of a whole set of recordings; of run-down the order of all trials would have to be known.
_SHARED = ("length_gain", "time_shift", "transducer_lag")
# What is averaged at the end of a trial, s.
END_S = 0.5


def base_fibre(start: Fibre, d: Diagnosis) -> Fibre:
    """The base as the diagnosis fitted it: the start, smoothing off, with the fitted values.

    By the distribution where the Gaussian form's own error was taken out of the fit, as augmented fibres are.
    """
    row = next(r for r in d.by_fibre if r.fibre == start.name)
    values = {"smoothing": 0.0, **{name: fitted for name, _, fitted, _ in row.base_parameters}}
    made = changed(start, values, f"base of fibre {start.name}")
    trials = f"{row.trials} trials of fibre {start.name}"
    made = replace(made, source=f"fitted by this package to {trials}, nothing added (base of a diagnosis)")
    return by_distribution(made) if row.closure_f0 and has_closure(made) else made


def predicted(fibre: Fibre, trial: FitTrial, shared: Mapping[str, float]) -> Calibrated | None:
    """Recorded force of a trial, F0, and the errors of its own that it was given; None where there is no solution."""
    coordinates = fault_coordinates((*_OWN, *shared), [trial.name], [trial.solution], {})
    problem = Problem(fibre, (trial,), coordinates, {})
    try:
        return calibrated_force(problem, np.array([shared.get(c.name, 0.0) for c in coordinates]), trial, known=False)
    except UserError:
        return None


def shared_errors(d: Diagnosis, fibre: str, model: str) -> dict[str, float]:
    """Errors that all recordings of a fibre share, by name, with one of the models ``before`` and ``after``."""
    own = [row for row in d.nuisance_parameters if row.fibre == fibre and row.name in _SHARED]
    return {row.name: (row.before or 0.0) if model == "before" else row.value for row in own}


def predictions(
    d: Diagnosis, folder: Path, bases: Sequence[Fibre], held_out: Mapping[str, Sequence[Trial]], alike: bool
) -> tuple[list[dict[str, Any]], dict[str, Array]]:
    """A row for every held-out trial, and its forces.

    Args:
        d: the diagnosis.
        folder: with its augmented fibre files.
        bases: fitted base of each fibre.
        held_out: trials by what they test.
        alike: they were recorded as the training ones were.

    Returns:
        rows with RMSD (F0; None: no solution), errors of the trial's own and mean force in the last `END_S` by model;
        arrays ``p<k>_time_s``, ``p<k>_measured_f0``, ``p<k>_before_f0`` and ``p<k>_after_f0``.
    """
    every = [(tests, trial) for tests, group in held_out.items() for trial in group]
    rows: list[dict[str, Any]] = []
    arrays: dict[str, Array] = {}
    for k, (tests, given) in enumerate(every):
        (trial,) = fit_trials([given], [False], whole=True)
        base = next(fibre for fibre in bases if fibre.name == given.facts.fibre)
        models = {"before": base}
        if base.name in d.augmented:
            models["after"] = load_fibre(folder / d.augmented[base.name])
        late = trial.force_time_s >= trial.force_time_s[-1] - END_S
        row: dict[str, Any] = {
            "fibre": base.name, "trial": trial.name, "tests": tests, "pca": given.facts.pca, "rmsd_f0": {}, "own": {},
            "end_f0": {"measured": float(np.mean(trial.measured_f0[late]))},
        }  # fmt: skip
        arrays |= {f"p{k}_time_s": trial.force_time_s, f"p{k}_measured_f0": trial.measured_f0}
        for name, fibre in models.items():
            found = predicted(fibre, trial, shared_errors(d, base.name, name) if alike else {})
            force = np.full(trial.measured_f0.size, np.nan) if found is None else found.force_f0
            arrays[f"p{k}_{name}_f0"] = force
            left = float(np.sqrt(np.mean((force - trial.measured_f0) ** 2)))
            row["rmsd_f0"][name] = left if np.isfinite(left) else None
            row["own"][name] = {} if found is None else dict(found.own)
            row["end_f0"][name] = None if found is None else float(np.mean(force[late]))
        rows.append(row)
    return rows, arrays


def warned_beforehand(d: Diagnosis, fibre: str) -> bool:
    """Whether the diagnosis warned of absurd forces outside its study, before any held-out trial was looked at."""
    return any(line.startswith(f"fibre {fibre}: the answer") for line in d.warnings)
