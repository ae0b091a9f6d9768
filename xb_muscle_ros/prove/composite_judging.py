"""One diagnosis of a composite held against the key: every name and every probability for itself.

Families: a name is of a right family if any effect of the case is of that family. A component with several members
counts as one name and as one statement, by its family; it is never exactly right.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from xb_muscle_ros.diagnose.names import FAMILY, Name
from xb_muscle_ros.diagnose.result import Verdict
from xb_muscle_ros.prove.judging import NO_DIAGNOSIS, heldout_gain
from xb_muscle_ros.prove.stated import Statement, components, named


class JudgedEffect(NamedTuple):
    """What became of a mechanism that is concealed.

    Attributes:
        label: its name.
        family: its family.
        size_f0: what it leaves beside the rest, F0.
        family_found: a name of its family is in the answer.
        exact_found: its name is.
    """

    label: str
    family: str
    size_f0: float
    family_found: bool
    exact_found: bool


class JudgedName(NamedTuple):
    """A name that was given, or a component with its probability.

    Attributes:
        name, family: as stated.
        single: whether it is one name, and not a family of several.
        probability: None where none is stated.
        family_right: an effect of this family is there.
        exact_right: the effect itself is.
    """

    name: str
    family: str
    single: bool
    probability: float | None
    family_right: bool
    exact_right: bool


class JudgedComposite(NamedTuple):
    """What became of a case.

    Attributes:
        case, kind: see the key.
        trials: of its study.
        effects: mechanisms that are concealed.
        outside: effects without a name that are.
        artefacts: of the measurement.
        verdict: of the tool, or ``error``.
        named: mechanisms of the answer.
        artefacts_named: artefacts that the tool names.
        statements: all mechanisms that it gives a probability.
        artefact_statements: all such artefacts.
        physics: verdict ``physics``, or a mechanism in the answer.
        gain: held-out gain over that of the true model; None unless before and after are known.
        seconds: that the tool took.
    """

    case: str
    kind: str
    trials: int
    effects: tuple[JudgedEffect, ...]
    outside: tuple[str, ...]
    artefacts: tuple[str, ...]
    verdict: str
    named: tuple[JudgedName, ...]
    artefacts_named: tuple[JudgedName, ...]
    statements: tuple[JudgedName, ...]
    artefact_statements: tuple[JudgedName, ...]
    physics: bool
    gain: float | None
    seconds: float | None

    def as_json(self) -> dict[str, Any]:
        """The same as JSON can hold it."""
        rows = ("effects", "named", "artefacts_named", "statements", "artefact_statements")
        return {**self._asdict(), **{name: [row._asdict() for row in getattr(self, name)] for name in rows}}


def judge_composite(truth: Mapping[str, Any], found: Mapping[str, Any]) -> JudgedComposite:
    """Hold a diagnosis against the truth.

    Args:
        truth: a case of the key.
        found: what `prove.run.needed` keeps of its diagnosis, or its error: such a case says nothing.
    """
    effects = [effect for effect in truth["effects"] if effect["family"] is not None]
    mechanisms = {str(effect["label"]): str(effect["family"]) for effect in effects}
    artefacts = {str(name): FAMILY[Name(name)] for name in truth["artefacts"]}
    verdict = NO_DIAGNOSIS if "error" in found else str(found["verdict"])
    answer = [_judged(s, mechanisms) for s in named(found, mechanisms=True)]
    families, names = {name.family for name in answer}, {name.name for name in answer if name.exact_right}
    return JudgedComposite(
        case=str(truth["case"]),
        kind=str(truth["kind"]),
        trials=int(truth["trials"]),
        effects=tuple(
            JudgedEffect(
                label, family, float(effect["beside_rest_f0"]), family_found=family in families,
                exact_found=label in names,
            )
            for effect, (label, family) in zip(effects, mechanisms.items(), strict=True)
        ),
        outside=tuple(str(effect["label"]) for effect in truth["effects"] if effect["family"] is None),
        artefacts=tuple(artefacts),
        verdict=verdict,
        named=tuple(answer),
        artefacts_named=tuple(_judged(s, artefacts) for s in named(found, mechanisms=False)),
        statements=tuple(_judged(s, mechanisms) for s in components(found, mechanisms=True)),
        artefact_statements=tuple(_judged(s, artefacts) for s in components(found, mechanisms=False)),
        physics=verdict == Verdict.PHYSICS.value or bool(answer),
        gain=heldout_gain(truth, found),
        seconds=found.get("seconds"),
    )  # fmt: skip


def _judged(statement: Statement, truth: Mapping[str, str]) -> JudgedName:
    """A statement against what is there, by name and family."""
    return JudgedName(
        *statement, family_right=statement.family in truth.values(),
        exact_right=statement.single and statement.name in truth,
    )  # fmt: skip
