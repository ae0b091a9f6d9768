"""A diagnosis held against the key: by its first name where one thing is concealed, else name by name.

Families: a name is of a right family if any effect of the case is of that family. A component with several members
counts as one name and as one statement, by its family; it is never exactly right.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from xb_muscle_ros.diagnose.names import FAMILY, Name
from xb_muscle_ros.diagnose.result import Verdict
from xb_muscle_ros.prove.answers import Answer, Statement

# A global change of rates is what parameters are for: to call it so is right as well.
_AS_GOOD_AS_PARAMETERS = {Name.TEMPERATURE, Name.PHOSPHATE}


@dataclass(frozen=True)
class Judged:
    """What became of a case.

    Attributes:
        case, kind: see the key.
        verdict: of the tool, or ``error``.
        physics: whether the tool says that physics is missing.
        gain: held-out gain over that of the true model; None unless before and after are known.
        worse: whether the answer predicts held-out conditions worse than the base; None where that is unknown.
    """

    case: str
    kind: str
    verdict: str
    physics: bool
    gain: float | None
    worse: bool | None
    seconds: float | None

    def says(self, *verdicts: Verdict) -> bool:
        """Whether the verdict is one of these."""
        return self.verdict in [verdict.value for verdict in verdicts]


@dataclass(frozen=True)
class JudgedSingle(Judged):
    """What became of a case with one effect, a pair or none.

    Attributes:
        size_f0: RMS that it leaves after a refit.
        size_class_f0: the highest of 0.5, 1, 2 and 4 % F0 that this reaches, else 0; None for nulls and artefacts.
        answer: first name that the tool gives, else its verdict.
        exact: the first name is right; for a pair either, for temperature and phosphate also ``parameters``, ``none``.
        located: the first mismatch is where the residual of a refit is at least half as large as anywhere; None
            without mismatch.
        located_beside_nuisances: the same with a refit of constants and nuisance parameters.
        confidence: inclusion probability of the first name; in format 1 as the tool states it.
    """

    labels: tuple[str, ...]
    size_f0: float
    size_class_f0: float | None
    answer: str
    exact: bool
    family: bool
    located: bool | None
    located_beside_nuisances: bool | None
    confidence: float | None


@dataclass(frozen=True)
class JudgedEffect:
    """What became of a mechanism that is concealed: of its unique contribution, F0, and whether the answer has it."""

    label: str
    family: str
    size_f0: float
    family_found: bool
    exact_found: bool


@dataclass(frozen=True)
class JudgedName:
    """A name or a component as stated (see `Statement`), and whether an effect of its family, and itself, is there."""

    name: str
    family: str
    single: bool
    probability: float | None
    family_right: bool
    exact_right: bool


@dataclass(frozen=True)
class JudgedComposite(Judged):
    """What became of a composite.

    Attributes:
        effects, outside, artefacts: what is concealed: mechanisms, effects without a name, errors of the measurement.
        named, artefacts_named: mechanisms of the answer, and artefacts that the tool names.
        statements, artefact_statements: all of either that it gives a probability.
    """

    trials: int
    effects: tuple[JudgedEffect, ...]
    outside: tuple[str, ...]
    artefacts: tuple[str, ...]
    named: tuple[JudgedName, ...]
    artefacts_named: tuple[JudgedName, ...]
    statements: tuple[JudgedName, ...]
    artefact_statements: tuple[JudgedName, ...]


def judge(truth: Mapping[str, Any], found: Answer) -> JudgedSingle:
    """Hold a diagnosis against the truth of a case of singles."""
    labels, first = tuple(truth["labels"]), found.first
    families = {FAMILY[label] for label in labels if label in FAMILY}
    silent = (Verdict.PARAMETERS.value, Verdict.NONE.value)
    as_good = bool(set(labels) & _AS_GOOD_AS_PARAMETERS) and found.verdict in silent
    speaks = found.verdict in (Verdict.PHYSICS.value, Verdict.MEASUREMENT.value, Verdict.AMBIGUOUS.value)
    family = first.family if first is not None else found.family if speaks else None
    ambiguous = found.verdict == Verdict.AMBIGUOUS.value and bool(found.named_mechanisms)
    return JudgedSingle(
        **_common(truth, found, ambiguous),
        labels=labels,
        size_f0=float(truth["size_f0"]),
        size_class_f0=truth["size_class_f0"],
        answer=found.verdict if first is None else first.name,
        exact=as_good or (first is not None and first.name in labels),
        family=as_good or family in families,
        located=_located(truth, found, "rms_f0"),
        located_beside_nuisances=_located(truth, found, "beside_nuisances_f0"),
        confidence=found.confidence if found.mechanisms is None else None if first is None else first.probability,
    )


def judge_composite(truth: Mapping[str, Any], found: Answer) -> JudgedComposite:
    """Hold a diagnosis against the truth of a composite; one that failed says nothing."""
    effects = [effect for effect in truth["effects"] if effect["family"] is not None]
    mechanisms = {str(effect["label"]): str(effect["family"]) for effect in effects}
    artefacts = {str(name): FAMILY[name] for name in truth["artefacts"]}
    named = _judged(found.named_mechanisms, mechanisms)
    families, names = {name.family for name in named}, {name.name for name in named if name.exact_right}
    return JudgedComposite(
        **_common(truth, found, bool(named)),
        trials=int(truth["trials"]),
        effects=tuple(
            JudgedEffect(label, family, float(effect["unique_contribution_f0"]), family in families, label in names)
            for effect, (label, family) in zip(effects, mechanisms.items(), strict=True)
        ),
        outside=tuple(str(effect["label"]) for effect in truth["effects"] if effect["family"] is None),
        artefacts=tuple(artefacts),
        named=named,
        artefacts_named=_judged(found.named_artefacts, artefacts),
        statements=_judged(found.mechanisms or (), mechanisms),
        artefact_statements=_judged(found.artefacts or (), artefacts),
    )


def _common(truth: Mapping[str, Any], found: Answer, names_physics: bool) -> dict[str, Any]:
    """What is judged alike, by the fields of `Judged`."""
    before, after, noise = found.before_heldout_f0, found.after_heldout_f0, truth["noise_rms_f0"]
    gain = worse = None
    if before is not None and after is not None:
        worse = after > before
        gain = (before - after) / (before - noise) if noise is not None and before > noise else None
    return {
        "case": str(truth["case"]),
        "kind": str(truth["kind"]),
        "verdict": found.verdict,
        "physics": found.verdict == Verdict.PHYSICS.value or names_physics,
        "gain": gain,
        "worse": worse,
        "seconds": found.seconds,
    }


def _located(truth: Mapping[str, Any], found: Answer, size: str) -> bool | None:
    largest = max((cell[size] for cell in truth["cells"]), default=0.0)
    if found.first_mismatch is None or largest <= 0.0:
        return None
    here = [c[size] for c in truth["cells"] if (c["trial"], c["phase"]) == found.first_mismatch]
    return bool(here) and max(here) >= 0.5 * largest


def _judged(statements: Iterable[Statement], truth: Mapping[str, str]) -> tuple[JudgedName, ...]:
    """Statements against what is there, by name and family."""
    return tuple(
        JudgedName(*s, family_right=s.family in truth.values(), exact_right=s.single and s.name in truth)
        for s in statements
    )
