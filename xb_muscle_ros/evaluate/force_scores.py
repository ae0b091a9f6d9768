"""Force RMSD of models over fibres: means with s.d., the slices of the paper's figure 5, and paired t-tests."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.evaluate.sets import rank
from xb_muscle_ros.evaluate.trials import WINDOWS, Trials
from xb_muscle_ros.scores.conditions import COMMON_AMPLITUDE_L0, COMMON_PCA, COMMON_RECOVERY_S
from xb_muscle_ros.scores.paired import bonferroni_threshold, paired_t
from xb_muscle_ros.trials.trial import Array

SLICES = ("pca", "amplitude_l0", "recovery_s")


class Spread(NamedTuple):
    """Over fibres.

    Attributes:
        mean, sd: of the fibres' means, F0; sd (n - 1) is None for one fibre.
        fibres: fibre -> its mean over trials, F0.
        trials: how many went in.
    """

    mean: float
    sd: float | None
    fibres: dict[str, float]
    trials: int


def spread(trials: Trials, values: Array, where: npt.NDArray[np.bool_]) -> Spread | None:
    """Fibre means of some trials' values, and their mean and s.d.; None where no trial has a value."""
    used = where & np.isfinite(values)
    means = {}
    for fibre in trials.fibres:
        mine = used & trials.is_of(fibre)
        if np.any(mine):
            means[fibre] = float(np.mean(values[mine]))
    if not means:
        return None
    each = np.array(list(means.values()))
    sd = float(np.std(each, ddof=1)) if each.size > 1 else None
    return Spread(float(np.mean(each)), sd, means, int(np.count_nonzero(used & trials.good)))


def models_of(trials: Trials) -> list[str]:
    """Parameter sets that were compared, simplest model first."""
    return sorted(trials.models, key=lambda name: (rank(name), name))


def overall(trials: Trials) -> dict[str, dict[str, Spread | None]]:
    """Force RMSD by model and window, over all trials."""
    return _spreads(trials, trials.good)


def _spreads(trials: Trials, where: npt.NDArray[np.bool_]) -> dict[str, dict[str, Spread | None]]:
    return {
        name: {window: spread(trials, trials.models[name][f"rmsd_{window}"], where) for window in WINDOWS}
        for name in models_of(trials)
    }


def common_condition(trials: Trials) -> dict[str, float]:
    """Condition that slices have in common: the paper's where any trial has it, else the most frequent value."""
    papers = {"pca": COMMON_PCA, "amplitude_l0": COMMON_AMPLITUDE_L0, "recovery_s": COMMON_RECOVERY_S}
    chosen: dict[str, float] = {}
    for name, wanted in papers.items():
        values = getattr(trials, name)[trials.good]
        values = values[np.isfinite(values)]
        if not values.size:
            continue
        if np.any(_near(values, wanted)):
            chosen[name] = wanted
        else:
            counted = Counter(float(f"{v:.6g}") for v in values)
            chosen[name] = min(counted, key=lambda v: (-counted[v], v))
    return chosen


def slices(trials: Trials) -> dict[str, list[dict[str, Any]]]:
    """Force RMSD with one of pCa, amplitude and recovery time varied, the others at the common condition.

    Returns:
        by what is varied: one entry for each level, with ``level`` and ``models``: model -> window -> spread.
    """
    common = common_condition(trials)
    found: dict[str, list[dict[str, Any]]] = {}
    for varied in SLICES:
        held = trials.good
        for name in SLICES:
            if name != varied and name in common:
                held = held & _near(getattr(trials, name), common[name])
        values = getattr(trials, varied)
        levels = np.unique([float(f"{v:.6g}") for v in values[held & np.isfinite(values)]]).tolist()
        found[varied] = [{"level": level, "models": _spreads(trials, held & _near(values, level))} for level in levels]
    return found


def neighbours(models: Sequence[str]) -> list[tuple[str, str]]:
    """Pairs of parameter sets whose models are adjacent in complexity among those compared, simpler one first."""
    ranks = sorted({rank(name) for name in models})
    return [
        (first, second)
        for low, high in pairwise(ranks)
        for first in models
        for second in models
        if rank(first) == low and rank(second) == high
    ]


def paired_tests(trials: Trials) -> dict[str, Any]:
    """Paired t-tests of force RMSD between neighbours in complexity, in each window, over fibres.

    A fibre's value is its mean over the trials that both models of a pair have.

    Returns:
        ``threshold`` (0.05 over the number of comparisons), ``comparisons``: one entry for each.
    """
    pairs = [(a, b, window) for a, b in neighbours(models_of(trials)) for window in WINDOWS]
    threshold = bonferroni_threshold(len(pairs))
    entries = []
    for first, second, window in pairs:
        a, b = (trials.models[name][f"rmsd_{window}"] for name in (first, second))
        both = np.isfinite(a) & np.isfinite(b)
        of_a, of_b = spread(trials, a, both), spread(trials, b, both)
        names = list(of_a.fibres) if of_a else []
        result = paired_t(
            [of_a.fibres[n] for n in names] if of_a else [], [of_b.fibres[n] for n in names] if of_b else []
        )
        significant = None if result.p is None else result.p < threshold
        names_and_window = {"first": first, "second": second, "window": window}
        entries.append({**names_and_window, **result._asdict(), "significant": significant})
    return {"threshold": threshold, "comparisons": entries}


def _near(values: Array, level: float) -> npt.NDArray[np.bool_]:
    near: npt.NDArray[np.bool_] = np.isclose(values, level, rtol=1e-3, atol=1e-6)
    return near
