"""What replay says of each trial: errors, stiffness, isometric force; as records and as a table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.scores.estimate import Estimate, notes_of
from xb_muscle_ros.scores.readout import (
    ISOMETRIC,
    SRS_CONDITIONING,
    SRS_TEST,
    TEXT,
    read_off,
    read_off_measured,
    references,
    relative_srs,
)
from xb_muscle_ros.scores.rmsd import force_rmsds, short_windows
from xb_muscle_ros.tables import MARK, MARK_NOTE, Columns, aligned, filled, number, with_error
from xb_muscle_ros.trials.simulated import Simulated
from xb_muscle_ros.trials.spool import release
from xb_muscle_ros.trials.trial import Trial

RELATIVE = "relative_srs"
# Keys of ``replay.json`` for what is read off a force.
_NAMES = {
    SRS_CONDITIONING: "srs_conditioning",
    SRS_TEST: "srs_test",
    ISOMETRIC: "isometric_force_f0",
    RELATIVE: RELATIVE,
}


@dataclass(frozen=True)
class Record:
    """One trial.

    Attributes:
        fibre, model, method: what it was simulated with.
        pca, amplitude_l0, recovery_s: condition; None where not known.
        rmsd_f0: of the force by window, F0; None where the trial lacks it.
        simulated, measured: SRS of both stretches (F0/L0), isometric force (F0) and relative SRS, by name.
        notes: why numbers are missing that could be expected.
    """

    trial: str
    fibre: str
    model: str
    method: str
    pca: float | None
    amplitude_l0: float | None
    recovery_s: float | None
    rmsd_f0: Mapping[str, float | None]
    simulated: Mapping[str, Estimate]
    measured: Mapping[str, Estimate]
    notes: tuple[str, ...] = ()

    def as_row(self) -> dict[str, Any]:
        """One entry of ``replay.json``; measured numbers have standard errors, ``..._se``."""
        row: dict[str, Any] = {key: value for key, value in vars(self).items() if key not in ("simulated", "measured")}
        for key, name in _NAMES.items():
            measured = self.measured[key]
            row |= {name: self.simulated[key].value, f"measured_{name}": measured.value}
            row[f"measured_{name}_se"] = measured.se
        return row


def record(trial: Trial, simulated: Simulated, fibre: Fibre) -> Record:
    """What there is to say of one trial; relative SRS is left to `with_relative_srs`."""
    facts = trial.facts
    force = simulated.force_n / facts.f0_n
    release(simulated.force_n)
    ours = read_off(trial, simulated.time_s, force)
    theirs = read_off_measured(trial) if trial.force_time_s.size else dict.fromkeys(TEXT, Estimate(None))
    notes = [f"RMSD, {name}: {why}" for name, why in short_windows(trial).items()]
    for key, text in TEXT.items():
        if why := theirs[key].why:
            notes.append(f"{text}, measured: {why}")
        elif why := ours[key].why:
            notes.append(f"{text}, simulated: {why}")
    return Record(
        facts.trial, fibre.name, fibre.model, fibre.method, facts.pca, facts.amplitude_l0, facts.recovery_s,
        force_rmsds(trial, simulated.time_s, force), {**ours, RELATIVE: Estimate(None)},
        {**theirs, RELATIVE: Estimate(None)}, tuple(notes),
    )  # fmt: skip


def with_relative_srs(records: Sequence[Record]) -> list[Record]:
    """The same with relative SRS where the reference trial of the fibre and pCa is among them."""
    found = references([(each.fibre, each.pca, each.amplitude_l0, each.recovery_s) for each in records])
    return [each if at is None else _relative(each, records[at]) for each, at in zip(records, found, strict=True)]


def _relative(entry: Record, reference: Record) -> Record:
    ours, theirs = (
        relative_srs(of[SRS_TEST], below[SRS_TEST], entry is reference)
        for of, below in ((entry.simulated, reference.simulated), (entry.measured, reference.measured))
    )
    lost = theirs.value is None and theirs.why and entry.measured[SRS_TEST].value is not None
    return replace(
        entry,
        simulated={**entry.simulated, RELATIVE: ours},
        measured={**entry.measured, RELATIVE: theirs},
        notes=(*entry.notes, f"relative SRS, measured: {theirs.why}") if lost else entry.notes,
    )


def _measured(key: str, form: str, record: Record) -> str:
    return with_error(record.measured[key].value, record.measured[key].se, form)


_COLUMNS: Columns[Record] = {
    "trial": lambda r: r.trial,
    "pCa": lambda r: number(r.pca, ".1f"),
    "AMP [% L0]": lambda r: number(r.amplitude_l0, ".2f", 100.0),
    "RT [s]": lambda r: number(r.recovery_s, "g"),
    "RMSD whole": lambda r: number(r.rmsd_f0["whole"], ".2f", 100.0),
    "cond.": lambda r: number(r.rmsd_f0["conditioning"], ".2f", 100.0),
    "test [% F0]": lambda r: number(r.rmsd_f0["test"], ".2f", 100.0),
    "SRS cond.": lambda r: number(r.simulated[SRS_CONDITIONING].value, ".1f"),
    "meas. cond. ± SE": lambda r: _measured(SRS_CONDITIONING, ".1f", r),
    "SRS test": lambda r: number(r.simulated[SRS_TEST].value, ".1f"),
    "meas. test ± SE [F0/L0]": lambda r: _measured(SRS_TEST, ".1f", r),
    "iso": lambda r: number(r.simulated[ISOMETRIC].value, ".3f"),
    "meas. iso ± SE [F0]": lambda r: _measured(ISOMETRIC, ".3f", r),
}


def table(records: Sequence[Record], title: str) -> str:
    """Records as text in columns; a dash where there is nothing to say, and below it what dashes and marks mean."""
    head, rows = filled(_COLUMNS, records)
    notes = [MARK_NOTE] if any(cell.endswith(MARK) for row in rows for cell in row[1:]) else []
    notes += notes_of([(each.trial, line) for each in records for line in each.notes])
    return "\n".join([title, aligned(head, rows), *notes])
