"""Force RMSD of models over fibres: means with s.d., the slices of the paper's figure 5, and paired t-tests."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.evaluate.sets import rank
from xb_muscle_ros.evaluate.srs_table import levels, near
from xb_muscle_ros.evaluate.trials import WINDOWS, Trials
from xb_muscle_ros.scores.conditions import COMMON_AMPLITUDE_L0, COMMON_PCA, COMMON_RECOVERY_S
from xb_muscle_ros.scores.statistics import Paired, bonferroni_threshold, paired_t
from xb_muscle_ros.trials.trial import Array

SLICES = ("pca", "amplitude_l0", "recovery_s")


@dataclass(frozen=True)
class Spread:
    """Over fibres.

    Attributes:
        mean, sd: of the fibres' means, F0; sd (n - 1) is None for one fibre.
        fibres: fibre -> its mean over trials, F0.
        trials: how many went in.
    """

    mean: float
    sd: float | None
    fibres: Mapping[str, float]
    trials: int


Spreads = Mapping[str, Mapping[str, Spread | None]]
"""By model and window; None where no trial has a value."""


@dataclass(frozen=True)
class Slice:
    """Trials at one level of what is varied, the rest at the common condition."""

    level: float
    models: Spreads


@dataclass(frozen=True)
class PairedTest:
    """Paired t-test between two models in one window; `significant` is None where there is no test."""

    first: str
    second: str
    window: str
    found: Paired
    significant: bool | None

    def as_row(self) -> dict[str, Any]:
        """Entry of ``evaluate.json``."""
        names = {"first": self.first, "second": self.second, "window": self.window}
        return {**names, **self.found._asdict(), "significant": self.significant}


@dataclass(frozen=True)
class PairedTests:
    """Tests between neighbours in complexity; a p below the threshold, 0.05 over their number, is significant."""

    threshold: float
    comparisons: Sequence[PairedTest]


@dataclass(frozen=True)
class ForceScores:
    """``force_rmsd`` of ``evaluate.json``.

    Attributes:
        common_condition: that slices have in common.
        slices: by what is varied, one for each level.
        unit: of all RMSD.
    """

    overall: Spreads
    common_condition: Mapping[str, float]
    slices: Mapping[str, Sequence[Slice]]
    paired_t_tests: PairedTests
    unit: str = "F0"


def force_scores(trials: Trials) -> ForceScores:
    """All force RMSD of the recordings."""
    return ForceScores(overall(trials), common_condition(trials), slices(trials), paired_tests(trials))


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


def overall(trials: Trials) -> Spreads:
    """Force RMSD over all trials."""
    return _spreads(trials, trials.good)


def _spreads(trials: Trials, where: npt.NDArray[np.bool_]) -> Spreads:
    return {
        name: {window: spread(trials, trials.column(name, f"rmsd_{window}")[0], where) for window in WINDOWS}
        for name in trials.models
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
        if np.any(near(values, wanted)):
            chosen[name] = wanted
        else:
            counted = Counter(float(f"{v:.6g}") for v in values)
            chosen[name] = min(counted, key=lambda v: (-counted[v], v))
    return chosen


def slices(trials: Trials) -> dict[str, list[Slice]]:
    """Force RMSD with one of pCa, amplitude and recovery time varied, the others at the common condition."""
    common = common_condition(trials)
    found: dict[str, list[Slice]] = {}
    for varied in SLICES:
        held = trials.good
        for name in SLICES:
            if name != varied and name in common:
                held = held & near(getattr(trials, name), common[name])
        values = getattr(trials, varied)
        at = levels(values[held & np.isfinite(values)]).tolist()
        found[varied] = [Slice(level, _spreads(trials, held & near(values, level))) for level in at]
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


def paired_tests(trials: Trials) -> PairedTests:
    """Paired t-tests of force RMSD between neighbours in complexity, in each window, over fibres.

    A fibre's value is its mean over the trials that both models of a pair have.
    """
    pairs = [(a, b, window) for a, b in neighbours(trials.models) for window in WINDOWS]
    threshold = bonferroni_threshold(len(pairs))
    tests = []
    for first, second, window in pairs:
        a, b = (trials.column(name, f"rmsd_{window}")[0] for name in (first, second))
        both = np.isfinite(a) & np.isfinite(b)
        # The same trials, and so the same fibres in the same order.
        of_a, of_b = (list(held.fibres.values()) if (held := spread(trials, v, both)) else [] for v in (a, b))
        found = paired_t(of_a, of_b)
        tests.append(PairedTest(first, second, window, found, None if found.p is None else found.p < threshold))
    return PairedTests(threshold, tests)


def force_rows(scores: ForceScores) -> Iterator[dict[str, Any]]:
    """Rows of ``force_rmsd.csv``."""
    groups: list[tuple[str, float | None, Spreads]] = [("all trials", None, scores.overall)]
    groups += [(varied, each.level, each.models) for varied, at in scores.slices.items() for each in at]
    for varied, level, models in groups:
        for name, windows in models.items():
            for window, held in windows.items():
                if held is not None:
                    where = {"varied": varied, "level": level, "model": name, "window": window}
                    numbers = {"mean_f0": held.mean, "sd_f0": held.sd, "fibres": len(held.fibres)}
                    yield {**where, **numbers, "trials": held.trials}
