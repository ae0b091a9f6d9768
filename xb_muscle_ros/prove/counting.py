"""Scores of many judged diagnoses, each with its 95 % interval and the bar it has to reach."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple, TypeVar

import numpy as np
from scipy.stats import binomtest

from xb_muscle_ros.diagnose.names import FAMILY
from xb_muscle_ros.diagnose.result import Verdict
from xb_muscle_ros.prove.answers import NO_DIAGNOSIS
from xb_muscle_ros.prove.judging import Judged, JudgedComposite, JudgedEffect, JudgedName, JudgedSingle

T = TypeVar("T")

SIZES_F0 = (0.0, 0.005, 0.01, 0.02, 0.04)
"""Least sizes of the classes in which effects are counted."""
LARGE_SINGLE_F0, LARGE_F0 = 0.02, 0.01
"""Single effects of this class, and effects of composites of this size, count for the bars on naming."""


class Score(NamedTuple):
    """A share of cases, or a mean.

    Attributes:
        value: None where no case counts.
        lower, upper: 95 % interval: Clopper–Pearson for shares, bootstrap for medians.
        bar: to reach; None where it has none.
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


def share(
    name: str, meaning: str, hits: Iterable[bool | None], bar: float | None = None, at_most: bool = False
) -> Score:
    """Share of cases that are so; None does not count."""
    found = [bool(hit) for hit in hits if hit is not None]
    if not found:
        return Score(name, meaning, None, 0, None, None, bar, at_most)
    lower, upper = interval(sum(found), len(found))
    return Score(name, meaning, sum(found) / len(found), len(found), lower, upper, bar, at_most)


def median(name: str, meaning: str, values: Iterable[float | None], bar: float | None = None) -> Score:
    """Median over cases, with a bootstrap interval; None does not count."""
    found, random = np.array([value for value in values if value is not None]), np.random.default_rng(1)
    if not found.size:
        return Score(name, meaning, None, 0, None, None, bar)
    drawn = np.median(found[random.integers(0, found.size, (2000, found.size))], axis=1)
    lower, upper = np.percentile(drawn, [2.5, 97.5])
    return Score(name, meaning, float(np.median(found)), found.size, float(lower), float(upper), bar)


def of_singles(judged: Sequence[JudgedSingle]) -> list[Score]:
    """All scores of a benchmark of singles; those with a bar first."""
    of = {kind: [j for j in judged if j.kind == kind] for kind in ("null", "artefact", "single", "pair", "outside")}
    large = [j for j in of["single"] if (j.size_class_f0 or 0.0) >= LARGE_SINGLE_F0]
    spoke = [j for j in judged if j.says(Verdict.PHYSICS)]
    real = [*of["single"], *of["pair"]]
    concealed = [*real, *of["outside"]]
    return [
        share("null_physics", "false alarm on nulls", (j.physics for j in of["null"]), 0.05, True),
        share(
            "artefact_physics", "measurement artefact called physics", (j.physics for j in of["artefact"]), 0.10, True
        ),
        share("large_family", "effect of 2 % F0 and more: right family first", (j.family for j in large), 0.80),
        share("large_exact", "effect of 2 % F0 and more: right mechanism first", (j.exact for j in large), 0.65),
        share("precision_family", "right family when the verdict is physics", (j.family for j in spoke), 0.90),
        share(
            "outside_abstains", "outside the library: verdict is not physics",
            (not j.says(Verdict.PHYSICS) for j in of["outside"]), 0.80,
        ),
        share("located", "first mismatch is where the effect is", (j.located for j in concealed), 0.90),
        median(
            "gain", "held-out gain over the gain of the true model, effects named right (median)",
            (j.gain for j in of["single"] if j.exact and j.says(Verdict.PHYSICS)), 0.8,
        ),
        share("precision_exact", "right mechanism when the verdict is physics", (j.exact for j in spoke)),
        share("coverage", "verdict is physics where physics is missing", (j.says(Verdict.PHYSICS) for j in real)),
        share(
            "coverage_large", "the same, effects of 2 % F0 and more",
            (j.says(Verdict.PHYSICS) for j in real if (j.size_class_f0 or 0.0) >= LARGE_SINGLE_F0),
        ),
        share("null_measurement", "measurement blamed on nulls", (j.says(Verdict.MEASUREMENT) for j in of["null"])),
        _null_quiet(of["null"]),
        share(
            "artefact_exact", "measurement artefact named right",
            (j.says(Verdict.MEASUREMENT) and j.exact for j in of["artefact"]),
        ),
        share(
            "artefact_family", "family of the artefact named right",
            (j.says(Verdict.MEASUREMENT) and j.family for j in of["artefact"]),
        ),
        share("pair_first", "pairs: first name is either of the two", (j.exact for j in of["pair"])),
        share("pair_family", "pairs: first name is of either family", (j.family for j in of["pair"])),
        share(
            "outside_unexplained", "outside the library: verdict is unexplained",
            (j.says(Verdict.UNEXPLAINED) for j in of["outside"]),
        ),
        share(
            "mismatch_found", "a mismatch is reported where something is concealed",
            (j.located is not None for j in concealed),
        ),
        share(
            "located_beside_nuisances", "first mismatch is where constants and nuisance parameters leave most",
            (j.located_beside_nuisances for j in concealed),
        ),
        *_of_all(judged),
    ]  # fmt: skip


def of_composites(judged: Sequence[JudgedComposite], calibration: Sequence[Score]) -> list[Score]:
    """All scores of a benchmark of composites but for its calibration, which is given; those with a bar first."""
    of = {kind: [j for j in judged if j.kind == kind] for kind in ("null", "artefact", "composite", "outside")}
    names = [name for j in judged for name in j.named]
    effects = [effect for j in judged for effect in j.effects]
    large = _large(effects)
    beside = [j for j in of["outside"] if j.effects]
    return [
        share("names_family", "names of the right family among all mechanisms named", _family_right(names), 0.92),
        share(
            "found_family", "effects with a unique contribution of 1 % F0 and more: family in the answer",
            (e.family_found for e in large), 0.75,
        ),
        share("null_named", "nulls with any mechanism named", (bool(j.named) for j in of["null"]), 0.02, True),
        share("artefact_physics", "artefacts called physics", (j.physics for j in of["artefact"]), 0.05, True),
        share("outside_silent", "outside effect not named", map(_no_wrong_family, of["outside"]), 0.85),
        *(s for s in calibration if s.bar is not None),
        share("names_exact", "right names among all mechanisms named", (name.exact_right for name in names)),
        share("found_exact", "the same effects: name in the answer", (e.exact_found for e in large)),
        share("found_all", "effects of any size: family in the answer", (e.family_found for e in effects)),
        *(
            share(
                f"found_of_{n}", f"effects of 1 % F0 and more, {n} in the case",
                (e.family_found for j in of["composite"] if len(j.effects) == n for e in _large(j.effects)),
            )
            for n in range(1, 5)
        ),
        share(
            "found_beside_outside", "effects of 1 % F0 and more beside an effect outside of the library",
            (e.family_found for j in beside for e in _large(j.effects)),
        ),
        share(
            "complete", "every effect of 1 % F0 and more found, no wrong family",
            (all(e.family_found for e in _large(j.effects)) and _no_wrong_family(j) for j in of["composite"]),
        ),
        share("silent", "no mechanism named where there are some", (not j.named for j in of["composite"])),
        share(
            "outside_alone_silent", "outside effect alone: no mechanism named",
            (_no_wrong_family(j) for j in of["outside"] if not j.effects),
        ),
        share(
            "outside_beside_silent", "outside effect beside a mechanism: no wrong family", map(_no_wrong_family, beside)
        ),
        _null_quiet(of["null"]),
        share("null_artefact", "nulls with an artefact named", (bool(j.artefacts_named) for j in of["null"])),
        share(
            "artefact_found", "artefacts beyond the ordinary: family named",
            (
                FAMILY[label] in {name.family for name in j.artefacts_named}
                for j in of["artefact"] for label in j.artefacts
            ),
        ),
        share(
            "artefact_names_family", "artefacts of the right family among all named",
            _family_right(name for j in judged for name in j.artefacts_named),
        ),
        *(s for s in calibration if s.bar is None),
        median(
            "gain", "held-out gain over the gain of the true model, cases with a mechanism named (median)",
            (j.gain for j in of["composite"] if j.named),
        ),
        *_of_all(judged),
    ]  # fmt: skip


def by_size(rows: Sequence[T], size: Callable[[T], float], hits: Mapping[str, Callable[[T], bool]]) -> list[Any]:
    """How many rows of each class of size are hits, by name of the hit."""
    found = []
    for low, high in itertools.pairwise((*SIZES_F0, float("inf"))):
        here = [row for row in rows if low <= size(row) < high]
        shares = {name: share(name, "", map(hit, here))._asdict() for name, hit in hits.items()}
        found.append({"from_f0": low, "n": len(here), **shares})
    return found


def _of_all(judged: Sequence[Judged]) -> list[Score]:
    return [
        share("worse", "answer predicts held-out conditions worse than the base", (j.worse for j in judged)),
        share("failed", "the tool could not do the case", (j.verdict == NO_DIAGNOSIS for j in judged)),
    ]


def _null_quiet(nulls: Iterable[Judged]) -> Score:
    quiet = (j.says(Verdict.NONE, Verdict.PARAMETERS) for j in nulls)
    return share("null_quiet", "nulls: verdict none or parameters", quiet)


def _large(effects: Iterable[JudgedEffect]) -> list[JudgedEffect]:
    return [effect for effect in effects if effect.size_f0 >= LARGE_F0]


def _family_right(names: Iterable[JudgedName]) -> list[bool]:
    return [name.family_right for name in names]


def _no_wrong_family(j: JudgedComposite) -> bool:
    """No name but of a family that is there; none at all where an outside effect is alone."""
    return all(name.family_right for name in j.named)
