"""What van der Zee et al. 2026 report, beside the same of our simulations and of the authors' released output."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from xb_muscle_ros.evaluate.sets import ModelSet
from xb_muscle_ros.evaluate.srs_scores import ALL_READINGS, READINGS, Reading, SrsScores, profile_rmsd, score
from xb_muscle_ros.evaluate.srs_table import SrsTable
from xb_muscle_ros.scores.conditions import CLASSES, LARGE_ABOVE_L0, LARGE_BELOW_S, SETS


class Reported(NamedTuple):
    """A number of the paper.

    Attributes:
        quantity: key of what is computed in its place, see `computed`.
        lower, upper: what the paper gives: a value (equal), or a bound (the other is infinite).
        where: place in the paper.
    """

    quantity: str
    model: str
    lower: float
    upper: float
    where: str

    @property
    def text(self) -> str:
        """The number as the paper has it."""
        if self.lower == self.upper:
            return f"{self.lower:g}"
        if not np.isfinite(self.lower):
            return f"<= {self.upper:g}"
        if not np.isfinite(self.upper):
            return f"> {self.lower:g}"
        return f"{self.lower:g} to {self.upper:g}"


_INF = float("inf")
_COOPERATIVE, _OTHERS = ("3state_coop", "4state_coop"), ("hill", "hill_se", "2state")
_SIX = ("hill", "hill_se", "2state", "2state_coop", "3state_coop", "4state_coop")

_PANELS = {"activation": "Fig 6A", "amplitude": "Fig 6B", "recovery": "Fig 6C"}

REPORTED: tuple[Reported, ...] = (
    Reported("srs_rmsd.large", "hill_se", 0.312, 0.312, "Results, Fig 6D"),
    Reported("srs_rmsd.large", "4state_coop", 0.101, 0.101, "Results, Fig 6D"),
    *(Reported("srs_rmsd.large", model, 0.2, _INF, "Abstract") for model in ("hill", "2state")),
    *(Reported("srs_rmsd.small", model, 0.103, 0.180, "Results, Fig 6E") for model in _SIX),
    Reported("srs_rmsd.all", "hill_se", 0.204, 0.204, "Results, Fig 6F"),
    *(Reported("srs_rmsd.all", model, 0.103, 0.104, "Results, Fig 6F") for model in _COOPERATIVE),
    *(
        row
        for along, panel in _PANELS.items()
        for row in (
            *(Reported(f"profile.{along}", model, 0.15, _INF, f"Results, {panel}") for model in _OTHERS),
            *(Reported(f"profile.{along}", model, -_INF, 0.1, f"Results, {panel}") for model in _COOPERATIVE),
        )
    ),
    Reported("reduction.mean", "3state_coop", 0.3, _INF, "Results, Fig 7: AMP > 3 % L0, RT < 0.5 s, submaximal"),
    *(Reported("k_tr", model, -_INF, 2.0, "Methods: of the fibres, 1/s") for model in _SIX),
)
"""Numbers that a table of SRS, or a simulated manoeuvre, can be set beside."""

NEED_RECORDINGS = (
    "force RMSD in the three windows (Fig 5) and its paired t-tests (p < 1e-4 between the Hill-type models and from "
    "2-state to 3-state cooperative, threshold 0.0033 for 15 comparisons): need the recordings of the 7 fibres; give "
    "their bags as well"
)
_NO_REDEVELOPMENT = "force does not redevelop: after the restretch it is above its isometric level"


class Source(NamedTuple):
    """Where computed numbers come from: our simulation, or the authors' released output.

    Attributes:
        name: heads columns.
        tables: parameter set -> its table of SRS.
        k_tr: parameter set -> k_tr at pCa 4.5 of each fibre that has it, 1/s.
    """

    name: str
    tables: Mapping[str, SrsTable]
    k_tr: Mapping[str, Sequence[float]]


@dataclass(frozen=True)
class Comparison:
    """One reported number, and ours.

    Attributes:
        quantity, model, where: see `Reported`.
        paper: the number as the paper has it.
        values: source -> reading -> number; None where it cannot be had.
        agrees: the same -> whether it is the paper's number or in its range to 0.01, or within its bound.
        remark: what is to be said of it.
    """

    quantity: str
    model: str
    paper: str
    where: str
    values: Mapping[str, Mapping[str, float | None]]
    agrees: Mapping[str, Mapping[str, bool | None]]
    remark: str


@dataclass(frozen=True)
class ReadingRow:
    """SRS RMSD and AIC of a source's model under one reading; on how many fibres."""

    source: str
    model: str
    fibres: int
    reading: Reading
    scores: SrsScores

    def as_row(self) -> dict[str, Any]:
        """Entry of ``evaluate.json``, and row of ``srs_rmsd.csv``."""
        rmsd = {f"rmsd_{name}": self.scores.rmsd[name] for name in SETS}
        of = {"source": self.source, "model": self.model, "fibres": self.fibres}
        return {**of, **self.reading._asdict(), **rmsd, "aic": self.scores.aic}


@dataclass(frozen=True)
class PaperSection:
    """What the paper reports beside the same of our simulations.

    Attributes:
        sources: names.
        readings_shown: names of the readings under which numbers are compared.
        comparison: one for each reported number.
        readings: every source and model under every reading.
        recordings: whether recordings were evaluated as well.
    """

    sources: Sequence[str]
    readings_shown: Sequence[str]
    comparison: Sequence[Comparison]
    readings: Sequence[ReadingRow]
    recordings: bool


def paper_section(
    sources: Sequence[Source], data: SrsTable, models: Sequence[ModelSet], recordings: bool
) -> PaperSection:
    """All of it."""
    comparison, readings = compare(sources, data, models), readings_table(sources, data, models, ALL_READINGS)
    return PaperSection([source.name for source in sources], list(READINGS), comparison, readings, recordings)


def compare(
    sources: Sequence[Source], data: SrsTable, models: Sequence[ModelSet], reported: Sequence[Reported] = REPORTED
) -> list[Comparison]:
    """One entry for each reported number."""
    held = {each.name: each for each in models}
    entries = []
    for row in reported:
        values = {
            source.name: {name: computed(row, source, data, reading) for name, reading in READINGS.items()}
            for source in sources
        }
        agrees = {s: {r: _agrees(v, row) for r, v in by.items()} for s, by in values.items()}
        remark = _remark(row, held.get(row.model), values)
        entries.append(Comparison(row.quantity, row.model, row.text, row.where, values, agrees, remark))
    return entries


def computed(row: Reported, source: Source, data: SrsTable, reading: Reading) -> float | None:
    """Our number in the place of a reported one; None where the source has no set for the model."""
    kind, _, which = row.quantity.partition(".")
    if kind == "k_tr":
        rates = source.k_tr.get(row.model, ())
        return float(np.mean(rates)) if rates else None
    table = source.tables.get(row.model)
    if table is None or not table.fibres:
        return None
    found: dict[str, Callable[[], float | None]] = {
        "srs_rmsd": lambda: score(table, data, reading, 0).rmsd[which],
        "profile": lambda: profile_rmsd(table, data, reading)[which],
        "reduction": lambda: mean_reduction(table, reading, data),
    }
    return found[kind]()


def mean_reduction(table: SrsTable, reading: Reading, data: SrsTable | None) -> float | None:
    """Reduction of SRS (1 - relative SRS), mean over the cells that the text calls large reductions."""
    whole = table.relative(reading.averaging, reading.unconditioned, data if reading.classes == "measured" else None)
    levels = np.array([name in ("low", "intermediate") for name in CLASSES])
    chosen = np.ix_(levels, table.recovery_s < LARGE_BELOW_S, table.amplitude_l0 > LARGE_ABOVE_L0)
    cells = whole.centre[chosen]
    return float(1.0 - np.nanmean(cells)) if np.any(np.isfinite(cells)) else None


def _agrees(value: float | None, row: Reported) -> bool | None:
    if value is None:
        return None
    # A bound is a bound; a value is met where nobody would tell two bars of the figure apart.
    slack = 0.01 if np.isfinite(row.lower) and np.isfinite(row.upper) else 0.0
    return bool(row.lower - slack <= value <= row.upper + slack)


def _remark(row: Reported, held: ModelSet | None, values: Mapping[str, Mapping[str, float | None]]) -> str:
    if held is None:
        return "no parameter set released for this model"
    if row.quantity == "k_tr":
        measured = "the paper's is measured; ours is the models' at pCa 4.5 after a release by a fifth of the length"
        return measured if any(v is not None for by in values.values() for v in by.values()) else _NO_REDEVELOPMENT
    notes = []
    if held.borrowed_from:
        notes.append(f"set borrowed from {held.borrowed_from}, not fitted for this model")
    if held.missing:
        notes.append(f"no set for fibres {', '.join(held.missing)}")
    if not any(_agrees(v, row) for by in values.values() for v in by.values()):
        notes.append("not reproduced with these sets")
    return "; ".join(notes)


def readings_table(
    sources: Sequence[Source], data: SrsTable, models: Sequence[ModelSet], readings: Sequence[Reading]
) -> list[ReadingRow]:
    """Every source and model under every reading."""
    return [
        ReadingRow(
            source.name, each.name, len(table.fibres), reading, score(table, data, reading, each.fitted_parameters)
        )
        for source in sources
        for each in models
        if (table := source.tables.get(each.name)) is not None and table.fibres
        for reading in readings
    ]
