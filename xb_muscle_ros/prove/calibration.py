"""Whether stated probabilities are as often right as they say."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.prove.counting import Score, share
from xb_muscle_ros.prove.judging import JudgedComposite, JudgedName
from xb_muscle_ros.trials.trial import Array

BINS = 10
"""Bins of equal width; a bin has its lower edge, the last its upper edge as well."""
_RESAMPLES = 2000


class Stated(NamedTuple):
    """A probability, and whether what it is of was there."""

    probability: float
    right: bool


def error(cases: Sequence[Sequence[Stated]]) -> float | None:
    """Expected calibration error: mean over all statements of |mean probability - share right| of their bins.

    Returns:
        None where there is no statement.
    """
    sums = _sums(cases)
    return float(_error(sums.sum(axis=0))) if sums[..., 0].any() else None


def calibration_score(name: str, meaning: str, cases: Sequence[Sequence[Stated]], bar: float | None = None) -> Score:
    """Expected calibration error with a bootstrap interval over cases; `n` counts statements."""
    value = error(cases)
    if value is None:
        return Score(name, meaning, None, 0, None, None, bar, True)
    sums = _sums(cases)
    random = np.random.default_rng(1)
    # How often each case is drawn in each resample.
    drawn = random.multinomial(len(cases), np.full(len(cases), 1.0 / len(cases)), _RESAMPLES).astype(np.float64)
    resampled = _error(np.tensordot(drawn, sums, axes=1))
    lower, upper = np.nanpercentile(resampled, [2.5, 97.5])
    return Score(name, meaning, value, int(sums[..., 0].sum()), float(lower), float(upper), bar, True)


def reliability(cases: Iterable[Iterable[Stated]], bins: int = BINS) -> list[dict[str, Any]]:
    """Bins that have statements: edges, mean probability, share right with its Clopper–Pearson interval."""
    statements = [stated for case in cases for stated in case]
    places = _places(np.array([stated.probability for stated in statements]), bins)
    rows = []
    for place in range(bins):
        here = [stated for stated, at in zip(statements, places, strict=True) if at == place]
        if here:
            mean = float(np.mean([stated.probability for stated in here]))
            right = share("right", "", (stated.right for stated in here))
            rows.append({"from": place / bins, "to": (place + 1) / bins, "mean_probability": mean, **right._asdict()})
    return rows


def of_composites(judged: Sequence[JudgedComposite]) -> list[Score]:
    """Calibration errors of inclusion probabilities, as they are stated and in four other ways."""
    rows: dict[str, tuple[str, Callable[[JudgedComposite], list[Stated]]]] = {
        "calibration": (" of inclusion probabilities, as stated", lambda j: as_stated(j.statements)),
        "calibration_components": (", every component by its family", lambda j: by_family(j.statements)),
        "calibration_families": (", one statement for each family of a case", lambda j: as_families(j.statements)),
        "calibration_exact": (
            ", by name (components of one name)", lambda j: as_stated(s for s in j.statements if s.single)
        ),
        "calibration_artefacts": (" of artefacts, by family", lambda j: by_family(j.artefact_statements)),
    }  # fmt: skip
    return [
        calibration_score(name, "expected calibration error" + of, [stated(j) for j in judged], bar)
        for (name, (of, stated)), bar in zip(rows.items(), (0.05, None, None, None, None), strict=True)
    ]


def as_stated(statements: Iterable[JudgedName]) -> list[Stated]:
    """Probabilities, each of what it says is there: a mechanism by name, a family of several by its family."""
    known = ((s, s.exact_right if s.single else s.family_right) for s in statements)
    return [Stated(s.probability, right) for s, right in known if s.probability is not None]


def by_family(statements: Iterable[JudgedName]) -> list[Stated]:
    """Probabilities, each right where an effect of its family is there."""
    return [Stated(s.probability, s.family_right) for s in statements if s.probability is not None]


def as_families(statements: Iterable[JudgedName]) -> list[Stated]:
    """One probability for each family: that any of its components is there, if they are independent."""
    absent: dict[str, float] = {}
    right: dict[str, bool] = {}
    for s in statements:
        if s.probability is not None:
            absent[s.family] = absent.get(s.family, 1.0) * (1.0 - s.probability)
            right[s.family] = s.family_right
    return [Stated(1.0 - probability, right[family]) for family, probability in absent.items()]


def _places(probability: Array, bins: int = BINS) -> npt.NDArray[np.int64]:
    """Bin of each probability."""
    # Rounded, because 0.3 * 10 lies below 3 for a computer and 0.7 * 10 need not.
    places = np.floor(np.round(probability * bins, 9)).astype(np.int64)
    return np.asarray(np.minimum(places, bins - 1))


def _sums(cases: Sequence[Sequence[Stated]]) -> Array:
    """Number, sum of probabilities and number right by case and bin, shape (cases, bins, 3)."""
    sums = np.zeros((len(cases), BINS, 3))
    for row, statements in zip(sums, cases, strict=True):
        values = np.array([(1.0, s.probability, float(s.right)) for s in statements]).reshape(-1, 3)
        np.add.at(row, _places(values[:, 1]), values)
    return sums


def _error(sums: Array) -> Array:
    """Of sums over cases, shape (..., bins, 3); NaN where there is no statement."""
    with np.errstate(invalid="ignore"):
        return np.asarray(np.abs(sums[..., 1] - sums[..., 2]).sum(axis=-1) / sums[..., 0].sum(axis=-1))
