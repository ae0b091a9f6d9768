"""Parts of ``evaluate.json``, in an order that does not depend on the run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from xb_muscle_ros.evaluate.curves import ForcePcaRow
from xb_muscle_ros.evaluate.enhancement import EnhancementRow
from xb_muscle_ros.evaluate.sets import ModelSet
from xb_muscle_ros.evaluate.srs_scores import READINGS, SrsScores, aic_reference, profile_rmsd, relative_aic, score
from xb_muscle_ros.evaluate.srs_table import SrsTable
from xb_muscle_ros.evaluate.trials import MEASURED, WINDOWS, Trials
from xb_muscle_ros.scores.estimate import Missing, notes_of
from xb_muscle_ros.scores.readout import TEXT
from xb_muscle_ros.tables import unsound


@dataclass(frozen=True)
class SetSection:
    """Which parameter set was used, how it was obtained (by fibre), and for which fibres it is missing."""

    model: str
    title: str
    fitted_parameters: int
    borrowed_from: str | None
    obtained: Mapping[str, str]
    missing: Sequence[str]


@dataclass(frozen=True)
class TrialsSection:
    """Which recordings were used: how many, of which fibres; why others were not; fibres without a parameter set."""

    used: int
    fibres: Sequence[str]
    left_out: Sequence[str]
    missing: Mapping[str, Sequence[str]]


@dataclass(frozen=True)
class ModelSrs:
    """Of one model: fibres of its table, and scores by reading."""

    fibres: Sequence[str]
    under: Mapping[str, SrsScores]

    def as_row(self) -> dict[str, Any]:
        """Entry of ``evaluate.json``."""
        return {"fibres": self.fibres, **self.under}


@dataclass(frozen=True)
class SrsSection:
    """SRS of models beside measured SRS.

    Attributes:
        aic_relative_to, aic_note: see `AicReference`.
        readings: what each is.
        left_out: by reading, how many measured relative SRS are ``left_out`` of means, and ``of`` how many.
        repeats_left_out: see `SrsTable`.
        models: simplest first.
    """

    measured_fibres: Sequence[str]
    aic_relative_to: str | None
    aic_note: str
    readings: Mapping[str, Mapping[str, str]]
    left_out: Mapping[str, Mapping[str, int]]
    repeats_left_out: int
    models: Mapping[str, ModelSrs]

    @property
    def shown(self) -> list[str]:
        """Readings with any condition to compare; recordings without reference trials leave one out."""
        return [
            name for name in self.readings if any(each.under[name].conditions["all"] for each in self.models.values())
        ]


def sets_section(models: Sequence[ModelSet]) -> list[SetSection]:
    """Which sets were used."""
    return [
        SetSection(each.name, each.title, each.fitted_parameters, each.borrowed_from, each.provenance(), each.missing)
        for each in models
    ]


def srs_section(tables: Mapping[str, SrsTable], data: SrsTable, models: Sequence[ModelSet]) -> SrsSection:
    """RMSD over sets of conditions, AIC and profiles, under both readings."""
    models = [each for each in models if each.name in tables]
    reference = aic_reference(models)
    under: dict[str, dict[str, SrsScores]] = {each.name: {} for each in models}
    for reading_name, reading in READINGS.items():
        scores = {each.name: score(tables[each.name], data, reading, each.fitted_parameters) for each in models}
        relative = relative_aic(scores, reference)
        for name, found in scores.items():
            profiles = profile_rmsd(tables[name], data, reading)
            under[name][reading_name] = replace(found, relative_aic=relative[name], profile_rmsd=profiles)
    out = {name: data.left_out(reading.unconditioned) for name, reading in READINGS.items()}
    return SrsSection(
        list(data.fibres),
        reference.model,
        reference.note,
        {name: reading._asdict() for name, reading in READINGS.items()},
        {name: {"left_out": count, "of": total} for name, (count, total) in out.items()},
        data.repeats_left_out,
        {name: ModelSrs(list(tables[name].fibres), scores) for name, scores in under.items()},
    )


def notes(trials: Trials, curves: Sequence[ForcePcaRow], enhancements: Sequence[EnhancementRow]) -> list[str]:
    """Lines on what could be expected of the recordings and is not there, or is no better than its error."""
    names = {**TEXT, **{f"rmsd_{name}": f"RMSD, {name}" for name in WINDOWS}}
    told: list[tuple[str, str]] = []
    for index, facts in trials.usable():
        measured = trials.why(index, MEASURED)
        for of in (MEASURED, *trials.models):
            own = measured if of == MEASURED else trials.why(index, of)
            told += [
                (facts.trial, f"{names.get(name, name)}, {of}: {why}")
                for name, why in own.items()
                if of == MEASURED or name not in measured
            ]
    lines = notes_of(told)
    for name, text in TEXT.items():
        found = [trials.found[index].scores[MEASURED][name] for index, _ in trials.usable()]
        known = [each for each in found if each.value is not None]
        if bad := sum(unsound(each.value, each.se) for each in known):
            lines.append(
                f"{text}, measured: the standard error is as large as the value in {bad} of {len(known)} trials"
            )
    missing = {(row.fibre, row.fit.why) for row in curves if isinstance(row.fit, Missing)}
    lines += [f"force-pCa curve, fibre {fibre}: {why}" for fibre, why in sorted(missing)]
    lines += [
        f"residual force enhancement, {row.of}, of trial {row.stretched}: {row.found.why}"
        for row in enhancements
        if isinstance(row.found, Missing)
    ]
    return lines


def left_out_lines(section: SrsSection) -> list[str]:
    """Lines on the measured SRS that are left out of means for their standard errors."""
    repeats = section.repeats_left_out
    lines = [f"SRS of the test stretch, measured: {repeats} repeats are left out of means for their standard errors"]
    return lines[: bool(repeats)] + [
        f"relative SRS, reading '{name}': {count['left_out']} of {count['of']} measured ones are left out of means, "
        "because a standard error is as large as the unconditioned SRS"
        for name, count in section.left_out.items()
        if count["left_out"]
    ]
