"""Rows of the CSV files of an evaluation: column -> value, the same columns in every row of a file."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import numpy as np

from xb_muscle_ros.evaluate.force_scores import force_rows
from xb_muscle_ros.evaluate.results import Results
from xb_muscle_ros.evaluate.srs_scores import READINGS, rows
from xb_muscle_ros.evaluate.srs_table import SrsTable
from xb_muscle_ros.evaluate.trials import MEASURED, WINDOWS, Trials
from xb_muscle_ros.scores.conditions import CLASSES
from xb_muscle_ros.scores.estimate import Estimate, quotient
from xb_muscle_ros.scores.readout import ISOMETRIC, SRS_CONDITIONING, SRS_TEST, references, relative_srs
from xb_muscle_ros.scores.redevelopment import K_TR

Row = Mapping[str, Any]
_RELATIVE = "relative_srs"
# Of tables that may be without rows.
COLUMNS = {"srs_cells": (
    "of", "fibre", "pca", "activation", "isometric_f0", "recovery_s", "amplitude_l0", "srs_test", "srs_test_se",
    "relative_srs", "relative_srs_se",
)}  # fmt: skip


def tables(results: Results) -> dict[str, Iterable[Row]]:
    """Rows of every table that an evaluation has, by the name of its file."""
    found, made = results.sections, dict[str, Iterable[Row]]()
    if results.trials is not None:
        made["trials"] = trial_rows(results.trials)
    if found.force_rmsd is not None and found.force_rmsd.overall:
        made["force_rmsd"] = force_rows(found.force_rmsd)
    if results.data is not None:
        made["relative_srs"] = relative_rows(results.tables, results.data)
        made["srs_cells"] = cell_rows({MEASURED: results.data, **results.tables})
    if found.paper is not None:
        made["srs_rmsd"] = (row.as_row() for row in found.paper.readings)
    return made


def trial_rows(trials: Trials) -> Iterator[Row]:
    """Rows of ``trials.csv``: each trial as measured, then by each model."""
    usable = list(trials.usable())
    reference = references([(f.fibre, f.pca, f.amplitude_l0, f.recovery_s) for _, f in usable])
    for (index, facts), at in zip(usable, reference, strict=True):
        for of in (MEASURED, *trials.models):
            found = dict(trials.found[index].scores.get(of, {}))
            if at is not None:
                below = trials.found[usable[at][0]].scores.get(of, {}).get(SRS_TEST, Estimate(None))
                test = found.get(SRS_TEST, Estimate(None))
                found[_RELATIVE] = relative_srs(test, below, usable[at][0] == index)
            why = [f"{name}: {each.why}" for name, each in found.items() if each.why and name != _RELATIVE]
            relative = found.get(_RELATIVE, Estimate(None))
            if relative.value is None and relative.why:
                why.append(f"{_RELATIVE}: {relative.why}")
            yield {
                **{"bag": trials.found[index].bag, "fibre": facts.fibre, "trial": facts.trial, "pca": facts.pca},
                **{"amplitude_l0": facts.amplitude_l0, "recovery_s": facts.recovery_s, "of": of},
                **{name: found.get(name, Estimate(None)).value for name in (f"rmsd_{window}" for window in WINDOWS)},
                **_with_errors(found, SRS_CONDITIONING, SRS_TEST, _RELATIVE, ISOMETRIC, K_TR),
                "why": "; ".join(why),
            }


def relative_rows(tables: Mapping[str, SrsTable], data: SrsTable) -> Iterator[Row]:
    """Rows of ``relative_srs.csv``: every condition, measured and by each model, under both readings."""
    for reading_name, reading in READINGS.items():
        for of, table in [(MEASURED, data), *tables.items()]:
            for row in rows(table, reading, None if table is data else data):
                yield {"reading": reading_name, "of": of, **row}


def cell_rows(tables: Mapping[str, SrsTable]) -> Iterator[Row]:
    """Rows of ``srs_cells.csv``: every cell of every table, with SRS relative to the fibre's reference trial."""
    for of, table in tables.items():
        for name, fibre in table.fibres.items():
            below = [_estimate(*each) for each in zip(*table.unconditioned(name, "reference"), strict=True)]
            classes, force = table.classes(name), table.isometric_f0(name)
            test_se = np.full(fibre.test.shape, np.nan) if fibre.test_se is None else fibre.test_se
            for i, j, k in np.argwhere(np.isfinite(fibre.test)).tolist():
                test = _estimate(fibre.test[i, j, k], test_se[i, j, k])
                yield {
                    **{"of": of, "fibre": name, "pca": float(table.pca[i])},
                    "activation": CLASSES[classes[i]] if classes[i] >= 0 else None,
                    "isometric_f0": float(force[i]),
                    "recovery_s": float(table.recovery_s[j]),
                    "amplitude_l0": float(table.amplitude_l0[k]),
                    **_with_errors({SRS_TEST: test, _RELATIVE: quotient(test, below[i])}, SRS_TEST, _RELATIVE),
                }


def _with_errors(found: Mapping[str, Estimate], *names: str) -> Row:
    row: dict[str, Any] = {}
    for name in names:
        row[name], row[f"{name}_se"], _ = found.get(name, Estimate(None))
    return row


def _estimate(value: float, se: float) -> Estimate:
    if not np.isfinite(value):
        return Estimate(None)
    return Estimate(float(value), float(se) if np.isfinite(se) else None)
