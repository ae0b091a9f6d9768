"""One score for all: SRS and relative SRS beside the measured table, over large and small reductions."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from xb_muscle_ros.evaluate.srs_scores import READINGS, RELEASED, score
from xb_muscle_ros.evaluate.srs_table import SrsTable, place
from xb_muscle_ros.scores.conditions import sets
from xb_muscle_ros.scores.relative import nanmean, rmsd
from xb_muscle_ros.trials.trial import Array


@dataclass(frozen=True)
class Score:
    """A model beside the measurement; None where nothing is known to both.

    Attributes:
        relative: by reading and set of conditions: RMSD of relative SRS, as `evaluate` has it.
        srs: by set of conditions: RMSD of SRS, F0/L0.
        unconditioned: root-mean-square error of the SRS of the unconditioned stretch over fibres and pCa, F0/L0.
        isometric: the same of isometric force, F0.
    """

    relative: Mapping[str, Mapping[str, float | None]]
    srs: Mapping[str, float | None]
    unconditioned: float | None
    isometric: float | None


def score_of(model: SrsTable, data: SrsTable) -> Score:
    """Scores of a table under both readings; SRS (F0/L0) with the classes and averages of ``released``."""
    ours, theirs = mean_srs(model), mean_srs(data)
    return Score(
        {name: score(model, data, reading, 0).rmsd for name, reading in READINGS.items()},
        {name: rmsd(ours, theirs, mask).value for name, mask in sets(RELEASED.large).items()},
        _error(model, data, lambda table, fibre: table.unconditioned(fibre, RELEASED.unconditioned)[0]),
        _error(model, data, SrsTable.isometric_f0),
    )


def mean_srs(table: SrsTable) -> Array:
    """SRS at the conditions, mean over a fibre's pCa of one class, then over fibres, (classes, conditions), F0/L0."""
    pooled = table.pooled(RELEASED.unconditioned)
    return table.at_conditions(nanmean(np.array([fibre.test for fibre in pooled.values()])))


def _error(model: SrsTable, data: SrsTable, of: Callable[[SrsTable, str], Array]) -> float | None:
    """Root-mean-square difference of what each fibre of the model has at each pCa."""
    ours = np.array([of(model, fibre) for fibre in model.fibres])
    places = [place(data.pca, pca) for pca in model.pca]
    measured = [of(data, fibre) for fibre in model.fibres]
    theirs = np.array([[np.nan if i is None else each[i] for i in places] for each in measured])
    return rmsd(ours, theirs, np.ones(ours.shape, dtype=bool)).value
