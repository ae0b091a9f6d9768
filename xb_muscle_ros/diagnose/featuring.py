"""Tabulated features that no fit has met, as base and answer predict them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from xb_muscle_ros.diagnose.feature_tables import FeatureTable, seen
from xb_muscle_ros.diagnose.result import Diagnosis, Feature, FeatureScore
from xb_muscle_ros.diagnose.search.system import Names
from xb_muscle_ros.diagnose.searching import Searched
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.evaluate.srs_scores import READINGS, relative_at_conditions
from xb_muscle_ros.evaluate.srs_table import FibreSrs, SrsTable, place
from xb_muscle_ros.fit.features import Feature as Cell
from xb_muscle_ros.fit.features import simulated
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.scores.conditions import COMMON_AMPLITUDE_L0, CONDITIONS, Condition, sets
from xb_muscle_ros.scores.relative import Rmsd, rmsd
from xb_muscle_ros.trials.trial import Array

_KINDS = {
    "isometric_force": "isometric force",
    "srs_test": "SRS of the test stretch",
    "srs_conditioning": "SRS of the conditioning stretch",
}


def with_features(d: Diagnosis, study: Searched, table: FeatureTable, fitted: bool) -> Diagnosis:
    """The record with what base and answer make of a table's cells.

    Relative SRS of a table that no fit has met is scored at the conditions of which no trace has the stretch.

    Args:
        study: fits of base and answer.
        fitted: whether the fits had to meet it; its test stretches of run-down fibres are predicted all the same.
    """
    rows: list[Feature] = []
    values: dict[str, dict[str, Array]] = {"before": {}, "after": {}}
    lines = list(table.notes_of_fit if fitted else ()) + list(table.notes)
    for i, fibre in enumerate(study.fibres):
        cells = table.cells.get(fibre.name)
        if cells is None:
            continue
        try:
            both = [_of_set(study, names, i, cells) for names in ((), study.judged.chosen)]
        except UserError as error:
            lines.append(f"fibre {fibre.name}: features were not predicted: {error}")
            continue
        values["before"][fibre.name], values["after"][fibre.name] = both
        rows += [
            Feature(
                fibre=fibre.name,
                name=_KINDS[cell.kind],
                condition=_condition(cell),
                measured=float(cell.value),
                before=float(before),
                after=float(after),
                used=fitted and any(_is(cell, f) for f in table.features[fibre.name]),
                traced=seen(cell, study.studies[i].trials),
            )
            for cell, before, after in zip(cells, *both, strict=True)
        ]
    found = () if fitted else _scores(study, table, values)
    return replace(
        d,
        features=(*d.features, *rows),
        feature_scores=(*d.feature_scores, *found),
        notes=(*d.notes, *lines),
    )


def _is(cell: Cell, other: Cell) -> bool:
    """Whether two cells are of one condition."""
    return (cell.kind, cell.pca, cell.recovery_s, cell.amplitude_l0) == (
        other.kind, other.pca, other.recovery_s, other.amplitude_l0,
    )  # fmt: skip


def _of_set(study: Searched, names: Names, i: int, cells: tuple[Cell, ...]) -> Array:
    problem = study.explorer.systems[i].problem(names, study.explorer.fits[names][i].values)
    muscle = Muscle(problem.fibre_at(problem.start))
    return simulated(muscle, cells, problem.solution_shifts(problem.start))


def _condition(cell: Cell) -> str:
    where = f"pCa {cell.pca:g}"
    if cell.kind != "srs_test":
        return where
    if cell.amplitude_l0 == 0.0:
        return f"{where}, no conditioning stretch"
    return f"{where}, after {100.0 * cell.amplitude_l0:.3g} % L0 and {cell.recovery_s:g} s"


def _scores(study: Searched, table: FeatureTable, values: dict[str, dict[str, Array]]) -> tuple[FeatureScore, ...]:
    """RMSD of relative SRS at concealed conditions, by reading and set of conditions."""
    names = list(values["before"])
    if not names:
        return ()
    shown = set()
    for each in study.studies:
        for cell in table.cells.get(each.fibre.name, ()):
            if cell.kind == "srs_test" and seen(cell, each.trials):
                shown.add((cell.amplitude_l0, cell.recovery_s))
    concealed = [c for c in CONDITIONS if not any(_same(c, s) for s in shown)]
    cells = {name: table.cells[name] for name in names}
    both = [
        relative_srs_rmsd(as_table(label, table.data, cells, values[label]), table.data, concealed)
        for label in ("before", "after")
    ]
    rows = []
    for reading, of_base in both[0].items():
        for key, before in of_base.items():
            after = both[1][reading][key]
            if before.value is not None and after.value is not None:
                rows.append(FeatureScore(reading, key, before.n, before.value, after.value))
    return tuple(rows)


def _same(condition: tuple[float, float], other: tuple[float, float]) -> bool:
    return abs(condition[0] - other[0]) <= 1e-6 and abs(condition[1] - other[1]) <= 1e-6 * max(other[1], 1.0)


def as_table(
    label: str, like: SrsTable, features: Mapping[str, Sequence[Cell]], values: Mapping[str, Array]
) -> SrsTable:
    """Predictions of several fibres on the axes of a table; NaN where a fibre has no feature.

    Args:
        like: whose axes are taken; every feature lies on them.
        features: of each fibre.
        values: what was predicted of them.
    """
    shape = (like.pca.size, like.recovery_s.size, like.amplitude_l0.size)
    held = {}
    for name, own in features.items():
        test, conditioning, isometric = (np.full(shape, np.nan) for _ in range(3))
        for f, value in zip(own, values[name].tolist(), strict=True):
            i = place(like.pca, f.pca)
            j, k = place(like.recovery_s, f.recovery_s), place(like.amplitude_l0, f.amplitude_l0)
            if f.kind == "isometric_force":
                isometric[i] = value
            elif f.kind == "srs_conditioning":
                conditioning[i, :, place(like.amplitude_l0, COMMON_AMPLITUDE_L0)] = value
            else:
                test[i, j, k] = value
        held[name] = FibreSrs(test, conditioning, isometric)
    return SrsTable(label, like.pca, like.recovery_s, like.amplitude_l0, held)


def relative_srs_rmsd(
    model: SrsTable, data: SrsTable, concealed: Sequence[Condition] | None = None
) -> dict[str, dict[str, Rmsd]]:
    """How far the mean relative SRS is from the measured, by the readings of docs/evaluate.md.

    Args:
        model: see `as_table`.
        concealed: conditions (amplitude, recovery) that count; None for all 21.

    Returns:
        by reading (``text`` and ``released``) and set of conditions (``large``, ``small`` and ``all`` reductions).
    """
    counted = np.array([concealed is None or condition in concealed for condition in CONDITIONS])
    found = {}
    for name, reading in READINGS.items():
        ours = relative_at_conditions(model, reading, data).centre
        theirs = relative_at_conditions(data, reading, data).centre
        found[name] = {key: rmsd(ours, theirs, mask & counted) for key, mask in sets(reading.large).items()}
    return found
