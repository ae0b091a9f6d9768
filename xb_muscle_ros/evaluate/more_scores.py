"""What some recordings allow beside force errors and SRS: force-pCa curves, k_tr, residual force enhancement."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from xb_muscle_ros.evaluate.bags import SAME_LENGTH_L0
from xb_muscle_ros.evaluate.force_scores import models_of
from xb_muscle_ros.evaluate.srs_table import SrsTable
from xb_muscle_ros.evaluate.trials import MEASURED, Trials
from xb_muscle_ros.scores.enhancement import Enhancement
from xb_muscle_ros.scores.estimate import Missing
from xb_muscle_ros.scores.force_pca import ForcePca, fit_force_pca
from xb_muscle_ros.trials.trial import Array

# Muscles activated alike reach the same peak of calcium.
_SAME_CALCIUM = 0.02


def force_pca_of_trials(trials: Trials) -> list[dict[str, Any]]:
    """Hill fits of isometric force against pCa, for each fibre of several pCa: measured, then by each model.

    Where there is no fit, ``why`` in place of its numbers.
    """
    rows = []
    for fibre in trials.fibres:
        mine = trials.is_of(fibre) & np.isfinite(trials.pca)
        levels = np.unique([float(f"{pca:.6g}") for pca in trials.pca[mine]])
        if levels.size < 2:
            continue  # no one expects a curve
        for label in (MEASURED, *models_of(trials)):
            force = (trials.measured if label == MEASURED else trials.models[label])["isometric_f0"]
            means = np.array([_mean(force[mine & np.isclose(trials.pca, pca)]) for pca in levels])
            rows.append(_force_pca_row(fibre, label, fit_force_pca(levels, means)))
    return rows


def force_pca_of_table(table: SrsTable, label: str) -> list[dict[str, Any]]:
    """The same of a table of SRS and isometric force."""
    return [_force_pca_row(name, label, fit_force_pca(table.pca, table.isometric_f0(name))) for name in table.fibres]


def k_tr_rows(trials: Trials) -> list[dict[str, Any]]:
    """k_tr of every trial with a release and restretch, measured and by each model; 1/s with standard error.

    Simulated rates have no error. Where there is no rate, ``why``.
    """
    rows = []
    for label in (MEASURED, *models_of(trials)):
        values = trials.measured if label == MEASURED else trials.models[label]
        for i in np.flatnonzero(trials.good).tolist():
            rate, why = float(values["k_tr"][i]), trials.why(i, label).get("k_tr", "")
            if np.isfinite(rate) or why:
                rows.append(
                    {
                        "fibre": trials.fibre[i],
                        "trial": trials.trial[i],
                        "pca": _or_none(trials.pca[i]),
                        "of": label,
                        "k_per_s": _or_none(rate),
                        "se_per_s": _or_none(values["k_tr_se"][i]),
                        "why": why,
                    }
                )
    return rows


def _or_none(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def enhancement_pairs(trials: Trials) -> list[tuple[dict[str, Any], dict[str, Any]]]:
    """Stretched trials and the isometric ones to set them beside.

    A stretched trial has one stretch and nothing else. Its partner is of the same fibre, isometric throughout at the
    length where the stretch ends, and activated alike: the last such trial before it in the order of the bags, or else
    the first after it.
    """
    shapes = list(trials.shapes())
    still = [(k, shape) for k, shape in enumerate(shapes) if not shape["moves"]]
    pairs = []
    for k, shape in enumerate(shapes):
        if shape["stretch_l0"] is None:
            continue
        fitting = [(j, other) for j, other in still if _matches(shape, other)]
        before, after = [o for j, o in fitting if j < k], [o for j, o in fitting if j > k]
        if before or after:
            pairs.append((shape, before[-1] if before else after[0]))
    return pairs


def enhancement_rows(
    pairs: Sequence[tuple[dict[str, Any], dict[str, Any]]], results: Sequence[dict[str, Any]]
) -> list[dict[str, Any]]:
    """Residual force enhancement of every pair, measured and by each model; ``why`` where there is none."""
    rows = []
    for (stretched, isometric), found in zip(pairs, results, strict=True):
        for label, value in [(MEASURED, found["measured"]), *found["models"].items()]:
            rows.append(
                {
                    "fibre": stretched["fibre"],
                    "stretched": stretched["trial"],
                    "isometric": isometric["trial"],
                    "stretch_l0": stretched["stretch_l0"],
                    "of": label,
                    "at_s": found["at_s"],
                    **dict.fromkeys(Enhancement._fields),
                    "why": "",
                    **value,
                }
            )
    return rows


def _matches(stretched: dict[str, Any], isometric: dict[str, Any]) -> bool:
    peak = stretched["peak_calcium_um"]
    alike = abs(peak - isometric["peak_calcium_um"]) <= _SAME_CALCIUM * peak
    near = abs(stretched["final_length_l0"] - isometric["final_length_l0"]) <= SAME_LENGTH_L0
    return bool(stretched["fibre"] == isometric["fibre"] and alike and near)


def _force_pca_row(fibre: str, label: str, fit: ForcePca | Missing) -> dict[str, Any]:
    why = fit.why if isinstance(fit, Missing) else ""
    numbers = {} if isinstance(fit, Missing) else fit._asdict()
    return {"fibre": fibre, "of": label, **dict.fromkeys(ForcePca._fields), **numbers, "why": why}


def _mean(values: Array) -> float:
    some = values[np.isfinite(values)]
    return float(np.mean(some)) if some.size else float("nan")
