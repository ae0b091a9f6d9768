"""What replay says of each trial: errors, stiffness, isometric force; as records, table and file."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from xb_muscle_ros.files import write_text
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.scores.rmsd import force_rmsd, windows
from xb_muscle_ros.scores.stiffness import ratio, stiffness_of_phase
from xb_muscle_ros.trials.simulated import Simulated
from xb_muscle_ros.trials.trial import Array, Trial

Record = dict[str, Any]


def _isometric_mean(trial: Trial, time_s: Array, force_f0: Array) -> float | None:
    """Mean force of the isometric phase before anything else happens, F0."""
    phase = trial.phases_by_name().get("isometric")
    if phase is None or time_s.size == 0:
        return None
    inside = (time_s >= phase.start_s) & (time_s <= phase.end_s)
    return float(np.mean(force_f0[inside])) if np.any(inside) else None


def record(trial: Trial, simulated: Simulated, fibre: Fibre) -> Record:
    """One entry of ``replay.json``; forces in F0, stiffness in F0/L0, null where a phase or a measurement is absent."""
    facts = trial.facts
    time_s, length = trial.time_s, trial.length_change_l0
    force = simulated.force_n / facts.f0_n
    measured_s, measured = trial.force_time_s, trial.measured_f0
    has_measured = measured_s.size > 0
    at_measured = np.interp(measured_s, simulated.time_s, force) if has_measured else force[:0]
    length_at_measured = np.interp(measured_s, time_s, length) if has_measured else length[:0]
    phases = trial.phases_by_name()
    entry: Record = {
        "trial": facts.trial,
        "fibre": fibre.name,
        "model": fibre.model,
        "method": fibre.method,
        "pca": facts.pca,
        "amplitude_l0": facts.amplitude_l0,
        "recovery_s": facts.recovery_s,
        "rmsd_f0": {
            name: force_rmsd(measured_s, at_measured, measured, window) if has_measured else None
            for name, window in windows(trial).items()
        },
    }
    for key, name in (("conditioning", "conditioning_stretch"), ("test", "test_stretch")):
        phase = phases.get(name)
        entry[f"srs_{key}"] = stiffness_of_phase(simulated.time_s, length, force, phase)
        entry[f"measured_srs_{key}"] = (
            stiffness_of_phase(measured_s, length_at_measured, measured, phase) if has_measured else None
        )
    entry["relative_srs"] = None
    entry["measured_relative_srs"] = None
    entry["isometric_force_f0"] = _isometric_mean(trial, simulated.time_s, force)
    entry["measured_isometric_force_f0"] = _isometric_mean(trial, measured_s, measured)
    return entry


def add_relative_stiffness(records: Sequence[Record]) -> None:
    """Fill in relative SRS where a reference trial (amplitude 0) of the same fibre and pCa is among the records."""
    for entry in records:
        references = [
            r for r in records if r["amplitude_l0"] == 0.0 and r["fibre"] == entry["fibre"] and r["pca"] == entry["pca"]
        ]
        if not references:
            continue
        # A reference of the same recovery time first: it lay nearest in the order of the experiment.
        best = min(references, key=lambda r: abs((r["recovery_s"] or 0.0) - (entry["recovery_s"] or 0.0)))
        entry["relative_srs"] = ratio(entry["srs_test"], best["srs_test"])
        entry["measured_relative_srs"] = ratio(entry["measured_srs_test"], best["measured_srs_test"])


_COLUMNS = (
    ("trial", "trial", "{}"),
    ("pca", "pCa", "{:.1f}"),
    ("amplitude_l0", "AMP [% L0]", "{:.2f}"),
    ("recovery_s", "RT [s]", "{:g}"),
    ("rmsd_f0.whole", "RMSD whole", "{:.2f}"),
    ("rmsd_f0.conditioning", "cond.", "{:.2f}"),
    ("rmsd_f0.test", "test [% F0]", "{:.2f}"),
    ("srs_conditioning", "SRS cond.", "{:.1f}"),
    ("measured_srs_conditioning", "meas.", "{:.1f}"),
    ("srs_test", "SRS test", "{:.1f}"),
    ("measured_srs_test", "meas. [F0/L0]", "{:.1f}"),
    ("isometric_force_f0", "iso", "{:.3f}"),
    ("measured_isometric_force_f0", "meas. [F0]", "{:.3f}"),
)
_PERCENT = {"amplitude_l0", "rmsd_f0.whole", "rmsd_f0.conditioning", "rmsd_f0.test"}


def table(records: Sequence[Record], title: str) -> str:
    """Records as text in columns; a dash where there is nothing to say."""
    rows = [[head for _, head, _ in _COLUMNS]]
    for entry in records:
        row = []
        for key, _, form in _COLUMNS:
            value: Any = entry
            for part in key.split("."):
                value = value[part]
            if value is None:
                row.append("–")
            else:
                row.append(form.format(100.0 * value if key in _PERCENT else value))
        rows.append(row)
    widths = [max(len(row[i]) for row in rows) for i in range(len(_COLUMNS))]
    lines = [
        "  ".join(
            cell.ljust(w) if i == 0 else cell.rjust(w) for i, (cell, w) in enumerate(zip(row, widths, strict=True))
        )
        for row in rows
    ]
    return "\n".join([title, lines[0], "-" * len(lines[0]), *lines[1:]])


def write_json(path: Path, records: Sequence[Record], extra: Record | None = None) -> None:
    """Write ``replay.json``: ``trials`` and whatever else belongs to the run."""
    write_text(path, json.dumps({"trials": list(records), **(extra or {})}, indent=1, allow_nan=False) + "\n")
