"""What replay says of each trial: errors, stiffness, isometric force; as records, table and file."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from xb_muscle_ros.files import write_text
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.scores.estimate import MARK, MARK_NOTE, Estimate, error_text, mark, notes_of, quotient
from xb_muscle_ros.scores.readout import ISOMETRIC, SRS_CONDITIONING, SRS_TEST, TEXT, read_off, read_off_measured
from xb_muscle_ros.scores.rmsd import force_rmsd, short_windows, windows
from xb_muscle_ros.trials.simulated import Simulated
from xb_muscle_ros.trials.trial import Trial

Record = dict[str, Any]
# Keys of ``replay.json`` for what is read off a force.
_NAMES = {SRS_CONDITIONING: "srs_conditioning", SRS_TEST: "srs_test", ISOMETRIC: "isometric_force_f0"}


def record(trial: Trial, simulated: Simulated, fibre: Fibre) -> Record:
    """One entry of ``replay.json``; forces in F0, stiffness in F0/L0, null where a phase or a measurement is absent.

    Measured numbers have standard errors, ``..._se``; ``notes`` say why numbers are missing that could be expected.
    """
    facts = trial.facts
    force = simulated.force_n / facts.f0_n
    measured_s, measured = trial.force_time_s, trial.measured_f0
    has_measured = measured_s.size > 0
    at_measured = np.interp(measured_s, simulated.time_s, force) if has_measured else force[:0]
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
    ours = read_off(trial, simulated.time_s, force)
    theirs = read_off_measured(trial) if has_measured else dict.fromkeys(TEXT, Estimate(None))
    for key, name in _NAMES.items():
        entry[name] = ours[key].value
        entry[f"measured_{name}"], entry[f"measured_{name}_se"] = theirs[key].value, theirs[key].se
    entry["relative_srs"] = None
    entry["measured_relative_srs"], entry["measured_relative_srs_se"] = None, None
    entry["notes"] = [f"RMSD, {name}: {why}" for name, why in short_windows(trial).items() if has_measured]
    for key, text in TEXT.items():
        told = f"{text}, measured: {theirs[key].why}" if theirs[key].why else ""
        if not told and ours[key].why:
            told = f"{text}, simulated: {ours[key].why}"
        entry["notes"] += [told] if told else []
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
        entry["relative_srs"] = quotient(Estimate(entry["srs_test"]), Estimate(best["srs_test"])).value
        if entry is best:
            # Its own error cancels.
            entry["measured_relative_srs"] = None if entry["measured_srs_test"] is None else 1.0
            continue
        found = quotient(_measured_test(entry), _measured_test(best))
        entry["measured_relative_srs"], entry["measured_relative_srs_se"] = found.value, found.se
        if found.value is None and found.why and entry["measured_srs_test"] is not None:
            entry["notes"].append(f"relative SRS, measured: {found.why}")


def _measured_test(entry: Record) -> Estimate:
    return Estimate(entry["measured_srs_test"], entry["measured_srs_test_se"])


_COLUMNS = (
    ("trial", "trial", "{}"),
    ("pca", "pCa", "{:.1f}"),
    ("amplitude_l0", "AMP [% L0]", "{:.2f}"),
    ("recovery_s", "RT [s]", "{:g}"),
    ("rmsd_f0.whole", "RMSD whole", "{:.2f}"),
    ("rmsd_f0.conditioning", "cond.", "{:.2f}"),
    ("rmsd_f0.test", "test [% F0]", "{:.2f}"),
    ("srs_conditioning", "SRS cond.", "{:.1f}"),
    ("measured_srs_conditioning", "meas. ± SE", "{:.1f}"),
    ("srs_test", "SRS test", "{:.1f}"),
    ("measured_srs_test", "meas. ± SE [F0/L0]", "{:.1f}"),
    ("isometric_force_f0", "iso", "{:.3f}"),
    ("measured_isometric_force_f0", "meas. ± SE [F0]", "{:.3f}"),
)
_PERCENT = {"amplitude_l0", "rmsd_f0.whole", "rmsd_f0.conditioning", "rmsd_f0.test"}


def table(records: Sequence[Record], title: str) -> str:
    """Records as text in columns; a dash where there is nothing to say, and below it what dashes and marks mean."""
    rows = [
        [head for _, head, _ in _COLUMNS],
        *([_cell(entry, key, form) for key, _, form in _COLUMNS] for entry in records),
    ]
    widths = [max(len(row[i]) for row in rows) for i in range(len(_COLUMNS))]
    lines = [
        "  ".join(
            cell.ljust(w) if i == 0 else cell.rjust(w) for i, (cell, w) in enumerate(zip(row, widths, strict=True))
        )
        for row in rows
    ]
    notes = [MARK_NOTE] if any(cell.endswith(MARK) for row in rows[1:] for cell in row[1:]) else []
    notes += notes_of([(entry["trial"], line) for entry in records for line in entry.get("notes", ())])
    return "\n".join([title, lines[0], "-" * len(lines[0]), *lines[1:], *notes])


def _cell(entry: Record, key: str, form: str) -> str:
    value: Any = entry
    for part in key.split("."):
        value = value[part]
    if value is None:
        return "–"
    se = entry.get(f"{key}_se")
    return form.format(100.0 * value if key in _PERCENT else value) + error_text(se) + mark(value if se else None, se)


def write_json(path: Path, records: Sequence[Record], extra: Record | None = None) -> None:
    """Write ``replay.json``: ``trials`` and whatever else belongs to the run."""
    write_text(path, json.dumps({"trials": list(records), **(extra or {})}, indent=1, allow_nan=False) + "\n")
