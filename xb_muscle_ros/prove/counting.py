"""Scores of many judged diagnoses, each with its 95 % interval and the bar it has to reach."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import binomtest

from xb_muscle_ros.diagnose.result import Verdict
from xb_muscle_ros.prove.judging import Judged

SIZES = (0.0, 0.005, 0.01, 0.02, 0.04)
LARGE_F0 = 0.02
"""Effects of this class and above count for the bars on naming."""
_BINS = np.linspace(0.0, 1.0, 6)


class Score(NamedTuple):
    """A share of cases, or a mean.

    Attributes:
        name: fixed.
        meaning: in words.
        value: None where no case counts.
        n: cases that count.
        lower, upper: 95 % interval: Clopper–Pearson for shares, bootstrap for medians.
        bar: to reach; None where it is only told.
        at_most: the bar is an upper one.
    """

    name: str
    meaning: str
    value: float | None
    n: int
    lower: float | None
    upper: float | None
    bar: float | None = None
    at_most: bool = False

    @property
    def reached(self) -> bool | None:
        """Whether the value reaches its bar."""
        if self.bar is None or self.value is None:
            return None
        return self.value <= self.bar if self.at_most else self.value >= self.bar


def interval(hits: int, n: int) -> tuple[float, float]:
    """Clopper–Pearson 95 % interval of a share; n at least 1."""
    found = binomtest(hits, n).proportion_ci(0.95, method="exact")
    return float(found.low), float(found.high)


def share(name: str, meaning: str, hits: Iterable[bool], bar: float | None = None, at_most: bool = False) -> Score:
    """Share of cases that are so."""
    found = [bool(hit) for hit in hits]
    if not found:
        return Score(name, meaning, None, 0, None, None, bar, at_most)
    lower, upper = interval(sum(found), len(found))
    return Score(name, meaning, sum(found) / len(found), len(found), lower, upper, bar, at_most)


def median(name: str, meaning: str, values: Sequence[float], bar: float | None = None) -> Score:
    """Median over cases, with a bootstrap interval."""
    if not values:
        return Score(name, meaning, None, 0, None, None, bar)
    found, random = np.array(values), np.random.default_rng(1)
    drawn = np.median(found[random.integers(0, found.size, (2000, found.size))], axis=1)
    lower, upper = np.percentile(drawn, [2.5, 97.5])
    return Score(name, meaning, float(np.median(found)), found.size, float(lower), float(upper), bar)


def scores(judged: Sequence[Judged]) -> list[Score]:
    """All scores; those with a bar first."""
    of = {kind: [j for j in judged if j.kind == kind] for kind in ("null", "fault", "single", "pair", "outside")}
    large = [j for j in of["single"] if (j.size_class_f0 or 0.0) >= LARGE_F0]
    spoke = [j for j in judged if j.verdict == Verdict.PHYSICS.value]
    real = [*of["single"], *of["pair"]]
    concealed = [*real, *of["outside"]]
    barred = [
        share("null_physics", "false alarm on nulls", (j.physics for j in of["null"]), 0.05, True),
        share("fault_physics", "measurement fault called physics", (j.physics for j in of["fault"]), 0.10, True),
        share("large_family", "effect of 2 % F0 and more: right family first", (j.family for j in large), 0.80),
        share("large_exact", "effect of 2 % F0 and more: right mechanism first", (j.exact for j in large), 0.65),
        share("precision_family", "right family when the verdict is physics", (j.family for j in spoke), 0.90),
        share("outside_abstains", "outside the library: verdict is not physics", _silent(of["outside"]), 0.80),
        share("located", "first mismatch is where the effect is", _known(j.located for j in concealed), 0.90),
        _gain(of["single"]),
    ]
    told = [
        share("precision_exact", "right mechanism when the verdict is physics", (j.exact for j in spoke)),
        share("coverage", "verdict is physics where physics is missing", (_says_physics(j) for j in real)),
        share(
            "coverage_large", "the same, effects of 2 % F0 and more",
            (_says_physics(j) for j in real if (j.size_class_f0 or 0.0) >= LARGE_F0),
        ),
        share("null_measurement", "measurement blamed on nulls", (_blames(j) for j in of["null"])),
        share("null_quiet", "nulls: verdict none or parameters", (_quiet(j) for j in of["null"])),
        share("fault_exact", "measurement fault named right", (_blames(j) and j.exact for j in of["fault"])),
        share("fault_family", "family of the fault named right", (_blames(j) and j.family for j in of["fault"])),
        share("pair_first", "pairs: first name is either of the two", (j.exact for j in of["pair"])),
        share("pair_family", "pairs: first name is of either family", (j.family for j in of["pair"])),
        share("outside_unexplained", "outside the library: verdict is unexplained", _unexplained(of["outside"])),
        share("mismatch_found", "a mismatch is told where something is concealed", _told(concealed)),
        share(
            "located_beside_nuisances", "first mismatch is where constants and usual faults leave most",
            _known(j.located_beside_nuisances for j in concealed),
        ),
        share("failed", "the tool could not do the case", (j.verdict == "error" for j in judged)),
    ]  # fmt: skip
    return [*barred, *told]


def by_size(judged: Sequence[Judged]) -> list[dict[str, Any]]:
    """Naming and gain of single effects for each class of size."""
    rows = []
    for size in SIZES:
        here = [j for j in judged if j.kind == "single" and j.size_class_f0 == size]
        told = [share("exact", "", (j.exact for j in here)), share("family", "", (j.family for j in here))]
        told.append(share("physics", "", (_says_physics(j) for j in here)))
        rows.append({"size_class_f0": size, "n": len(here), **{s.name: s._asdict() for s in told}})
    return rows


def calibration(judged: Sequence[Judged]) -> dict[str, Any]:
    """Stated confidence against the share that was right, over all cases with an answer."""
    rows = [(float(j.confidence), j.exact) for j in judged if j.confidence is not None and j.answer != j.verdict]
    bins = []
    for low, high in itertools.pairwise(_BINS):
        here = [row for row in rows if low <= row[0] < high or (high == 1.0 and row[0] == 1.0)]
        if here:
            right = share("right", "", (hit for _, hit in here))
            bins.append({"mean_confidence": float(np.mean([c for c, _ in here])), **right._asdict()})
    brier = float(np.mean([(c - hit) ** 2 for c, hit in rows])) if rows else None
    return {"n": len(rows), "brier": brier, "bins": bins}


def _gain(singles: Sequence[Judged]) -> Score:
    """Median held-out gain of effects named right, over that of the true model."""
    gains = [j.gain for j in singles if j.exact and _says_physics(j) and j.gain is not None]
    return median("gain", "held-out gain over the gain of the true model, effects named right (median)", gains, 0.8)


def _says_physics(j: Judged) -> bool:
    return j.verdict == Verdict.PHYSICS.value


def _blames(j: Judged) -> bool:
    return j.verdict == Verdict.MEASUREMENT.value


def _quiet(j: Judged) -> bool:
    return j.verdict in (Verdict.NONE.value, Verdict.PARAMETERS.value)


def _silent(judged: Sequence[Judged]) -> list[bool]:
    return [not _says_physics(j) for j in judged]


def _unexplained(judged: Sequence[Judged]) -> list[bool]:
    return [j.verdict == Verdict.UNEXPLAINED.value for j in judged]


def _known(values: Iterable[bool | None]) -> list[bool]:
    return [value for value in values if value is not None]


def _told(judged: Sequence[Judged]) -> list[bool]:
    return [j.located is not None for j in judged]
