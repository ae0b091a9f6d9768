"""SRS of a model beside measured SRS: RMSD over sets of conditions, AIC, and the profiles that the paper draws."""

from __future__ import annotations

import functools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import NamedTuple

import numpy as np

from xb_muscle_ros.evaluate.sets import REFERENCE_OF_AIC, ModelSet
from xb_muscle_ros.evaluate.srs_table import UNCONDITIONED, SrsTable
from xb_muscle_ros.scores.conditions import (
    CLASSES,
    COMMON_AMPLITUDE_L0,
    COMMON_CLASS,
    COMMON_RECOVERY_S,
    CONDITIONS,
    LARGE,
    Mask,
    sets,
)
from xb_muscle_ros.scores.relative import AVERAGINGS, Averaged, Rmsd, rmsd
from xb_muscle_ros.scores.statistics import aic


class Reading(NamedTuple):
    """One way to read what the paper says of averages.

    Attributes:
        averaging: one of `AVERAGINGS`.
        unconditioned: one of `UNCONDITIONED`.
        classes: ``own``: a model's class at a pCa is that of its own isometric force, as in the authors' programs;
            ``measured``: that of the fibre's measured force.
        large: a key of `scores.conditions.LARGE`.
    """

    averaging: str
    unconditioned: str
    classes: str
    large: str


TEXT = Reading("mean", "reference", "own", "text")
RELEASED = Reading("mean", "conditioning", "own", "released")
READINGS = {"text": TEXT, "released": RELEASED}
"""``text``: as the paper's Methods define it. ``released``: as the authors' public programs compute it."""
ALL_READINGS = tuple(
    Reading(*combination) for combination in product(AVERAGINGS, UNCONDITIONED, ("own", "measured"), tuple(LARGE))
)


@dataclass(frozen=True)
class SrsScores:
    """Relative SRS of one model under one reading.

    Attributes:
        rmsd: by set of conditions, ``large``, ``small`` and ``all``; None where none of its conditions was measured.
        conditions: how many of each set were compared.
        aic: over all conditions; None where it cannot be had.
        relative_aic: AIC less the reference's; None where it cannot be had, or is not asked for.
        profile_rmsd: along each profile; None where it was not measured.
    """

    rmsd: Mapping[str, float | None]
    conditions: Mapping[str, int]
    aic: float | None
    relative_aic: float | None = None
    profile_rmsd: Mapping[str, float | None] = field(default_factory=dict)


@functools.lru_cache(maxsize=1024)
def relative_at_conditions(table: SrsTable, reading: Reading, data: SrsTable | None) -> Averaged:
    """Relative SRS over fibres, shape (classes, conditions).

    Args:
        table: measured or simulated.
        reading: how to average.
        data: the measured table; makes the classes where the reading says so.
    """
    whole = table.relative(reading.averaging, reading.unconditioned, data if reading.classes == "measured" else None)
    n = table.at_conditions(whole.n.astype(np.float64))
    return Averaged(
        centre=table.at_conditions(whole.centre),
        sd=table.at_conditions(whole.sd),
        n=np.where(np.isfinite(n), n, 0.0).astype(np.int64),
    )


def score(model: SrsTable, data: SrsTable, reading: Reading, fitted_parameters: int) -> SrsScores:
    """RMSD of relative SRS between the mean model and the mean measurement, and the AIC over all conditions."""
    found = _differences(model, data, reading, sets(reading.large))
    return SrsScores(
        {name: each.value for name, each in found.items()},
        {name: each.n for name, each in found.items()},
        aic(found["all"].rss, found["all"].n, fitted_parameters),
    )


def _differences(model: SrsTable, data: SrsTable, reading: Reading, masks: Mapping[str, Mask]) -> dict[str, Rmsd]:
    ours, theirs = (relative_at_conditions(table, reading, data).centre for table in (model, data))
    return {name: rmsd(ours, theirs, mask) for name, mask in masks.items()}


def profile_masks() -> dict[str, Mask]:
    """Conditions that the paper's figure 6 A to C draw, shape (classes, conditions): one thing varied at a time."""
    at = np.array(CLASSES) == COMMON_CLASS
    amplitude = np.array([c.amplitude_l0 for c in CONDITIONS])
    recovery = np.array([c.recovery_s for c in CONDITIONS])
    common_amplitude, common_recovery = amplitude == COMMON_AMPLITUDE_L0, recovery == COMMON_RECOVERY_S
    everywhere = np.ones(at.size, dtype=bool)
    return {
        "activation": everywhere[:, None] & (common_amplitude & common_recovery),
        "amplitude": at[:, None] & (common_recovery & (amplitude > 0.0)),
        "recovery": at[:, None] & common_amplitude,
    }


def profile_rmsd(model: SrsTable, data: SrsTable, reading: Reading) -> dict[str, float | None]:
    """RMSD of relative SRS along each profile; None where it was not measured."""
    return {name: each.value for name, each in _differences(model, data, reading, profile_masks()).items()}


class AicReference(NamedTuple):
    """What AICs are shown relative to.

    Attributes:
        model: name of the set; None where AICs are absolute.
        note: why it is not the paper's (Hill without series element); empty where it is.
    """

    model: str | None
    note: str


def aic_reference(models: Sequence[ModelSet]) -> AicReference:
    """The set that AICs are relative to: Hill without series element, or the nearest there is."""
    own = [each.name for each in models if each.borrowed_from is None]
    if REFERENCE_OF_AIC in own:
        return AicReference(REFERENCE_OF_AIC, "")
    why = "Hill without series element has no parameter set of its own"
    if "hill_se" in own:
        return AicReference("hill_se", f"{why}: AIC is relative to Hill with series element")
    return AicReference(None, f"{why}, and neither has Hill with series element: AIC is absolute")


def relative_aic(scores: Mapping[str, SrsScores], reference: AicReference) -> dict[str, float | None]:
    """AIC less the reference's, by model; None where either is missing or conditions differ."""
    if reference.model is None:
        return {name: each.aic for name, each in scores.items()}
    base = scores.get(reference.model)
    shown: dict[str, float | None] = {}
    for name, each in scores.items():
        alike = base is not None and base.conditions["all"] == each.conditions["all"]
        shown[name] = each.aic - base.aic if alike and base and each.aic is not None and base.aic is not None else None
    return shown


def rows(table: SrsTable, reading: Reading, data: SrsTable | None) -> Iterator[dict[str, float | str | int | None]]:
    """Relative SRS of every condition, for JSON and CSV."""
    averaged = relative_at_conditions(table, reading, data)
    masks = sets(reading.large)
    for level, name in enumerate(CLASSES):
        for k, condition in enumerate(CONDITIONS):
            centre, sd = float(averaged.centre[level, k]), float(averaged.sd[level, k])
            yield {
                "activation": name,
                "amplitude_l0": condition.amplitude_l0,
                "recovery_s": condition.recovery_s,
                "reduction": "large" if masks["large"][level, k] else "small",
                "relative_srs": centre if np.isfinite(centre) else None,
                "sd": sd if np.isfinite(sd) else None,
                "fibres": int(averaged.n[level, k]),
            }
