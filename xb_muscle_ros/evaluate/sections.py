"""Parts of ``evaluate.json``: from results to plain data, in an order that does not depend on the run."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from xb_muscle_ros.evaluate import force_scores
from xb_muscle_ros.evaluate.force_scores import Spread, models_of
from xb_muscle_ros.evaluate.more_scores import MEASURED
from xb_muscle_ros.evaluate.sets import ModelSet
from xb_muscle_ros.evaluate.srs_scores import (
    READINGS,
    aic_reference,
    profile_rmsd,
    relative_aic,
    rows,
    score,
)
from xb_muscle_ros.evaluate.srs_table import SrsTable
from xb_muscle_ros.evaluate.trials import Trials
from xb_muscle_ros.scores.activation import CLASSES

TRIAL_COLUMNS = (
    "bag", "fibre", "trial", "pca", "amplitude_l0", "recovery_s", "of", "rmsd_whole", "rmsd_conditioning", "rmsd_test",
    "srs_conditioning", "srs_test", "relative_srs", "isometric_f0", "k_tr", "k_tr_se",
)  # fmt: skip
FORCE_COLUMNS = ("varied", "level", "model", "window", "mean_f0", "sd_f0", "fibres", "trials")
RELATIVE_COLUMNS = (
    "reading", "of", "activation", "amplitude_l0", "recovery_s", "reduction", "relative_srs", "sd", "fibres",
)  # fmt: skip
CELL_COLUMNS = (
    "of", "fibre", "pca", "activation", "isometric_f0", "recovery_s", "amplitude_l0", "srs_test", "relative_srs",
)  # fmt: skip


def sets_section(models: Sequence[ModelSet]) -> list[dict[str, Any]]:
    """Which sets were used, how each was obtained, and which are missing."""
    return [
        {
            "model": each.name,
            "title": each.title,
            "fitted_parameters": each.fitted_parameters,
            "borrowed_from": each.borrowed_from,
            "obtained": each.provenance(),
            "missing": list(each.missing),
        }
        for each in models
    ]


def force_section(trials: Trials) -> dict[str, Any]:
    """Force RMSD over fibres, F0: overall, in slices, and the tests between models."""
    return {
        "unit": "F0",
        "overall": {name: _windows(found) for name, found in force_scores.overall(trials).items()},
        "common_condition": force_scores.common_condition(trials),
        "slices": {
            varied: [
                {"level": entry["level"], "models": {name: _windows(found) for name, found in entry["models"].items()}}
                for entry in entries
            ]
            for varied, entries in force_scores.slices(trials).items()
        },
        "paired_t_tests": force_scores.paired_tests(trials),
    }


def force_rows(section: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    """Rows of ``force_rmsd.csv``."""
    levels = [("all trials", None, section["overall"])]
    levels += [(varied, entry["level"], entry["models"]) for varied, es in section["slices"].items() for entry in es]
    for varied, level, models in levels:
        for name, found in models.items():
            for window, held in found.items():
                if held is not None:
                    yield {
                        "varied": varied,
                        "level": level,
                        "model": name,
                        "window": window,
                        "mean_f0": held["mean"],
                        "sd_f0": held["sd"],
                        "fibres": len(held["fibres"]),
                        "trials": held["trials"],
                    }


def srs_section(tables: Mapping[str, SrsTable], data: SrsTable, models: Sequence[ModelSet]) -> dict[str, Any]:
    """SRS of models beside measured SRS: RMSD over sets of conditions, AIC, profiles; under both readings."""
    reference = aic_reference([each for each in models if each.name in tables])
    section: dict[str, Any] = {
        "measured_fibres": list(data.fibres),
        "aic_relative_to": reference.model,
        "aic_note": reference.note,
        "readings": {name: reading._asdict() for name, reading in READINGS.items()},
        "models": {},
    }
    for reading_name, reading in READINGS.items():
        scores = {
            each.name: score(tables[each.name], data, reading, each.fitted_parameters)
            for each in models
            if each.name in tables
        }
        shown = relative_aic(scores, reference)
        for name, found in scores.items():
            section["models"].setdefault(name, {"fibres": list(tables[name].fibres)})[reading_name] = {
                "rmsd": found.rmsd,
                "conditions": found.conditions,
                "aic": found.aic,
                "relative_aic": shown[name],
                "profile_rmsd": profile_rmsd(tables[name], data, reading),
            }
    return section


def relative_rows(tables: Mapping[str, SrsTable], data: SrsTable) -> Iterator[dict[str, Any]]:
    """Rows of ``relative_srs.csv``: every condition, measured and by each model, under both readings."""
    for reading_name, reading in READINGS.items():
        for of, table in [(MEASURED, data), *tables.items()]:
            for row in rows(table, reading, None if table is data else data):
                yield {"reading": reading_name, "of": of, **row}


def cell_rows(tables: Mapping[str, SrsTable]) -> Iterator[dict[str, Any]]:
    """Rows of ``srs_cells.csv``: every cell of every table, with SRS relative to the fibre's reference trial."""
    for of, table in tables.items():
        for name, fibre in table.fibres.items():
            unconditioned = table.unconditioned(name, "reference")
            classes, force = table.classes(name), table.isometric_f0(name)
            for i, j, k in np.ndindex(fibre.test.shape):
                test = float(fibre.test[i, j, k])
                if np.isfinite(test):
                    below = float(unconditioned[i])
                    yield {
                        "of": of,
                        "fibre": name,
                        "pca": float(table.pca[i]),
                        "activation": CLASSES[classes[i]] if classes[i] >= 0 else None,
                        "isometric_f0": float(force[i]),
                        "recovery_s": float(table.recovery_s[j]),
                        "amplitude_l0": float(table.amplitude_l0[k]),
                        "srs_test": test,
                        "relative_srs": test / below if np.isfinite(below) and below else None,
                    }


def trial_rows(trials: Trials) -> Iterator[dict[str, Any]]:
    """Rows of ``trials.csv``: each trial as measured, then by each model."""
    good = np.flatnonzero(trials.good).tolist()
    partner = _reference_of(trials)
    for i in good:
        for of in (MEASURED, *models_of(trials)):
            values = trials.measured if of == MEASURED else trials.models[of]
            held = {name: float(column[i]) for name, column in values.items()}
            below = float(values["srs_test"][partner[i]]) if partner[i] >= 0 else float("nan")
            yield {
                "bag": trials.bag[i],
                "fibre": trials.fibre[i],
                "trial": trials.trial[i],
                "pca": float(trials.pca[i]),
                "amplitude_l0": float(trials.amplitude_l0[i]),
                "recovery_s": float(trials.recovery_s[i]),
                "of": of,
                "rmsd_whole": None,
                "rmsd_conditioning": None,
                "rmsd_test": None,
                **held,
                "relative_srs": held["srs_test"] / below if below else None,
            }


def _reference_of(trials: Trials) -> list[int]:
    """For each trial the reference trial of its fibre and pCa, nearest in recovery time; -1 where there is none."""
    references: dict[tuple[str, str], list[int]] = {}
    for i in np.flatnonzero(trials.good & (trials.amplitude_l0 == 0.0)).tolist():
        references.setdefault((trials.fibre[i], f"{trials.pca[i]:.6g}"), []).append(i)
    recovery = np.nan_to_num(trials.recovery_s)
    found = []
    for i, fibre in enumerate(trials.fibre):
        among = references.get((fibre, f"{trials.pca[i]:.6g}"), [])
        found.append(min(among, key=lambda r: abs(recovery[r] - recovery[i]), default=-1))
    return found


def _windows(found: Mapping[str, Spread | None]) -> dict[str, Any]:
    return {window: None if held is None else held._asdict() for window, held in found.items()}
