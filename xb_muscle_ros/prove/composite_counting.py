"""Scores of judged composites, each with its 95 % interval and the bar it has to reach."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

from xb_muscle_ros.diagnose.names import FAMILY, Name
from xb_muscle_ros.diagnose.result import Verdict
from xb_muscle_ros.prove.calibration import Stated, calibration_score
from xb_muscle_ros.prove.composite_judging import JudgedComposite, JudgedEffect, JudgedName
from xb_muscle_ros.prove.counting import Score, median, share
from xb_muscle_ros.prove.judging import NO_DIAGNOSIS

LARGE_F0 = 0.01
"""Effects that leave as much beside the rest count for the bar on finding them."""
SIZES_F0 = (0.0, 0.005, 0.01, 0.02, 0.04)
"""Least sizes of the classes in which effects are told."""


def scores(judged: Sequence[JudgedComposite]) -> list[Score]:
    """All scores; those with a bar first."""
    of = {kind: [j for j in judged if j.kind == kind] for kind in ("null", "fault", "composite", "outside")}
    names = [name for j in judged for name in j.named]
    effects = [effect for j in judged for effect in j.effects]
    large = _large(effects)
    alone = [j for j in of["outside"] if not j.effects]
    beside = [j for j in of["outside"] if j.effects]
    artefact_names = [name for j in judged for name in j.artefacts_named]
    barred = [
        share("names_family", "names of the right family among all mechanisms named", _family_right(names), 0.92),
        share(
            "found_family", "effects that leave 1 % F0 and more beside the rest: family in the answer",
            (e.family_found for e in large), 0.75,
        ),
        share("null_named", "nulls with any mechanism named", (bool(j.named) for j in of["null"]), 0.02, True),
        share("fault_physics", "artefacts called physics", (j.physics for j in of["fault"]), 0.05, True),
        share("outside_silent", "outside effect not named", (_outside_silent(j) for j in of["outside"]), 0.85),
        calibration_score(
            "calibration", "expected calibration error of inclusion probabilities, as stated",
            [as_stated(j.statements) for j in judged],
            0.05,
        ),
    ]  # fmt: skip
    told = [
        share("names_exact", "right names among all mechanisms named", (name.exact_right for name in names)),
        share("found_exact", "the same effects: name in the answer", (e.exact_found for e in large)),
        share("found_all", "effects of any size: family in the answer", (e.family_found for e in effects)),
        *(
            share(f"found_of_{n}", f"effects of 1 % F0 and more, {n} in the case", _found_among(of["composite"], n))
            for n in range(1, 5)
        ),
        share(
            "found_beside_outside", "effects of 1 % F0 and more beside an effect outside of the library",
            (e.family_found for e in _large(e for j in beside for e in j.effects)),
        ),
        share("complete", "every effect of 1 % F0 and more found, no wrong family", _complete(of["composite"])),
        share("silent", "no mechanism named where there are some", (not j.named for j in of["composite"])),
        share("outside_alone_silent", "outside effect alone: no mechanism named", (_outside_silent(j) for j in alone)),
        share(
            "outside_beside_silent", "outside effect beside a mechanism: no wrong family",
            (_outside_silent(j) for j in beside),
        ),
        share("null_quiet", "nulls: verdict none or parameters", (_quiet(j) for j in of["null"])),
        share("null_artefact", "nulls with an artefact named", (bool(j.artefacts_named) for j in of["null"])),
        share("artefact_found", "artefacts beyond the ordinary: family named", _artefacts_found(of["fault"])),
        share("artefact_names_family", "artefacts of the right family among all named", _family_right(artefact_names)),
        calibration_score(
            "calibration_components", "expected calibration error, every component by its family",
            [by_family(j.statements) for j in judged],
        ),
        calibration_score(
            "calibration_families", "expected calibration error, one statement for each family of a case",
            [as_families(j.statements) for j in judged],
        ),
        calibration_score(
            "calibration_exact", "expected calibration error, by name (components of one name)",
            [by_name(j.statements) for j in judged],
        ),
        calibration_score(
            "calibration_artefacts", "expected calibration error of artefacts, by family",
            [by_family(j.artefact_statements) for j in judged],
        ),
        median(
            "gain", "held-out gain over the gain of the true model, cases with a mechanism named (median)",
            [j.gain for j in of["composite"] if j.named and j.gain is not None],
        ),
        share("failed", "the tool could not do the case", (j.verdict == NO_DIAGNOSIS for j in judged)),
    ]  # fmt: skip
    return [*barred, *told]


def by_size(judged: Sequence[JudgedComposite]) -> list[dict[str, Any]]:
    """How many of the effects of each size are found."""
    effects = [effect for j in judged for effect in j.effects]
    rows = []
    for low, high in itertools.pairwise((*SIZES_F0, float("inf"))):
        here = [effect for effect in effects if low <= effect.size_f0 < high]
        found = share("family", "", (e.family_found for e in here)), share("exact", "", (e.exact_found for e in here))
        rows.append({"from_f0": low, "n": len(here), **{s.name: s._asdict() for s in found}})
    return rows


def _large(effects: Iterable[JudgedEffect]) -> list[JudgedEffect]:
    return [effect for effect in effects if effect.size_f0 >= LARGE_F0]


def _family_right(names: Iterable[JudgedName]) -> Iterator[bool]:
    return (name.family_right for name in names)


def as_stated(statements: Iterable[JudgedName]) -> list[Stated]:
    """Probabilities, each of what it says is there: a mechanism by name, a family of several by its family."""
    return [
        Stated(s.probability, s.exact_right if s.single else s.family_right)
        for s in statements
        if s.probability is not None
    ]


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


def by_name(statements: Iterable[JudgedName]) -> list[Stated]:
    """Probabilities of components of one name, each right where the effect itself is there."""
    return [Stated(s.probability, s.exact_right) for s in statements if s.probability is not None and s.single]


def _found_among(judged: Iterable[JudgedComposite], count: int) -> list[bool]:
    return [e.family_found for j in judged if len(j.effects) == count for e in _large(j.effects)]


def _complete(judged: Iterable[JudgedComposite]) -> list[bool]:
    return [
        all(effect.family_found for effect in _large(j.effects)) and all(name.family_right for name in j.named)
        for j in judged
    ]


def _outside_silent(j: JudgedComposite) -> bool:
    """No name but of a family that is there; none at all where the outside effect is alone."""
    return all(name.family_right for name in j.named)


def _quiet(j: JudgedComposite) -> bool:
    return j.verdict in (Verdict.NONE.value, Verdict.PARAMETERS.value)


def _artefacts_found(judged: Iterable[JudgedComposite]) -> list[bool]:
    """For every artefact, whether one of its family is named."""
    return [FAMILY[Name(label)] in {name.family for name in j.artefacts_named} for j in judged for label in j.artefacts]
