"""Parts of ``evaluate.json``: from results to plain data, in an order that does not depend on the run."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from xb_muscle_ros.evaluate import force_scores
from xb_muscle_ros.evaluate.force_scores import Spread, models_of
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
from xb_muscle_ros.evaluate.trials import MEASURED, WINDOWS, Trials
from xb_muscle_ros.scores.activation import CLASSES
from xb_muscle_ros.scores.estimate import Estimate, notes_of, quotient
from xb_muscle_ros.scores.readout import TEXT
from xb_muscle_ros.tables import unsound
from xb_muscle_ros.trials.trial import Array

TRIAL_COLUMNS = (
    "bag", "fibre", "trial", "pca", "amplitude_l0", "recovery_s", "of", "rmsd_whole", "rmsd_conditioning", "rmsd_test",
    "srs_conditioning", "srs_conditioning_se", "srs_test", "srs_test_se", "relative_srs", "relative_srs_se",
    "isometric_f0", "isometric_f0_se", "k_tr", "k_tr_se", "why",
)  # fmt: skip
FORCE_COLUMNS = ("varied", "level", "model", "window", "mean_f0", "sd_f0", "fibres", "trials")
RELATIVE_COLUMNS = (
    "reading", "of", "activation", "amplitude_l0", "recovery_s", "reduction", "relative_srs", "sd", "fibres",
)  # fmt: skip
CELL_COLUMNS = (
    "of", "fibre", "pca", "activation", "isometric_f0", "recovery_s", "amplitude_l0", "srs_test", "srs_test_se",
    "relative_srs", "relative_srs_se",
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
        "left_out": {
            name: dict(zip(("left_out", "of"), data.left_out(reading.unconditioned), strict=True))
            for name, reading in READINGS.items()
        },
        "repeats_left_out": data.repeats_left_out,
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
            error = table.unconditioned_se(name, "reference")
            classes, force = table.classes(name), table.isometric_f0(name)
            for i, j, k in np.ndindex(fibre.test.shape):
                test = _estimate(fibre.test[i, j, k], None if fibre.test_se is None else fibre.test_se[i, j, k])
                if test.value is not None:
                    relative = quotient(test, _estimate(unconditioned[i], error[i]))
                    yield {
                        "of": of,
                        "fibre": name,
                        "pca": float(table.pca[i]),
                        "activation": CLASSES[classes[i]] if classes[i] >= 0 else None,
                        "isometric_f0": float(force[i]),
                        "recovery_s": float(table.recovery_s[j]),
                        "amplitude_l0": float(table.amplitude_l0[k]),
                        "srs_test": test.value,
                        "srs_test_se": test.se,
                        "relative_srs": relative.value,
                        "relative_srs_se": relative.se,
                    }


def trial_rows(trials: Trials) -> Iterator[dict[str, Any]]:
    """Rows of ``trials.csv``: each trial as measured, then by each model."""
    good = np.flatnonzero(trials.good).tolist()
    partner = _reference_of(trials)
    for i in good:
        for of in (MEASURED, *models_of(trials)):
            values = trials.measured if of == MEASURED else trials.models[of]
            held = {name: float(column[i]) for name, column in values.items()}
            relative = _relative(values, i, partner[i])
            why = dict(trials.why(i, of))
            if relative.value is None and relative.why:
                why["relative_srs"] = relative.why
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
                "relative_srs": relative.value,
                "relative_srs_se": relative.se,
                "why": "; ".join(f"{name}: {text}" for name, text in why.items()),
            }


def _relative(values: Mapping[str, Array], i: int, reference: int) -> Estimate:
    """Relative SRS of a trial; of a reference trial itself it is 1 without error."""
    if reference < 0:
        return Estimate(None)
    test, below = (_estimate(values["srs_test"][k], values["srs_test_se"][k]) for k in (i, reference))
    if reference == i and test.value:
        return Estimate(1.0)
    return quotient(test, below)


def _estimate(value: float, se: float | None) -> Estimate:
    known = se is not None and np.isfinite(se)
    return (
        Estimate(float(value), float(se) if known and se is not None else None)
        if np.isfinite(value)
        else Estimate(None)
    )


def notes(trials: Trials, section: Mapping[str, Any]) -> list[str]:
    """Lines on what could be expected of the recordings and is not there, or is no better than its error."""
    names = {**TEXT, "k_tr": "k_tr", **{f"rmsd_{name}": f"RMSD, {name}" for name in WINDOWS}}
    told: list[tuple[str, str]] = []
    for i in np.flatnonzero(trials.good).tolist():
        measured = trials.why(i, MEASURED)
        told += [(trials.trial[i], f"{names.get(name, name)}, measured: {why}") for name, why in measured.items()]
        for of in models_of(trials):
            own = {name: why for name, why in trials.why(i, of).items() if name not in measured}
            told += [(trials.trial[i], f"{names.get(name, name)}, {of}: {why}") for name, why in own.items()]
    lines = notes_of(told)
    for name, text in TEXT.items():
        pairs = zip(trials.measured[name][trials.good], trials.measured[f"{name}_se"][trials.good], strict=True)
        known = [(float(value), float(se)) for value, se in pairs if np.isfinite(value)]
        bad = sum(unsound(value, se) for value, se in known)
        if bad:
            lines.append(
                f"{text}, measured: the standard error is as large as the value in {bad} of {len(known)} trials"
            )
    missing = {(row["fibre"], row["why"]) for row in section["force_pca"] if row["why"]}
    lines += [f"force-pCa curve, fibre {fibre}: {why}" for fibre, why in sorted(missing)]
    lines += [
        f"residual force enhancement, {row['of']}, of trial {row['stretched']}: {row['why']}"
        for row in section["residual_force_enhancement"]
        if row["why"]
    ]
    return lines


def left_out_lines(section: Mapping[str, Any]) -> list[str]:
    """Lines on the measured SRS that are left out of means for their standard errors."""
    repeats = section["repeats_left_out"]
    lines = [f"SRS of the test stretch, measured: {repeats} repeats are left out of means for their standard errors"]
    return lines[: bool(repeats)] + [
        f"relative SRS, reading '{name}': {count['left_out']} of {count['of']} measured ones are left out of means, "
        "because a standard error is as large as the unconditioned SRS"
        for name, count in section["left_out"].items()
        if count["left_out"]
    ]


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
