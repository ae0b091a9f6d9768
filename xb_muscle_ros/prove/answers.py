"""What the scoring needs of a diagnosis: a row of ``results.json``, written of a record and read in every format."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from xb_muscle_ros.diagnose.component import NAMED, Kind
from xb_muscle_ros.diagnose.names import FAMILY, MECHANISMS
from xb_muscle_ros.diagnose.result import Diagnosis, Verdict
from xb_muscle_ros.work import JsonValue

NO_DIAGNOSIS = "error"
"""Verdict of a case that the tool could not do."""
FAMILIES_OF_PHYSICS = tuple(dict.fromkeys(FAMILY[name] for name in MECHANISMS))
_PHYSICS = {*MECHANISMS, *FAMILIES_OF_PHYSICS}


class Statement(NamedTuple):
    """A component with its probability.

    Attributes:
        name: of a mechanism or artefact, or of a family whose members are not separable.
        single: whether it is one name, and not a family of several.
        probability: that it is part of the truth; None in format 1, which has none for it.
    """

    name: str
    family: str
    single: bool
    probability: float | None


@dataclass(frozen=True)
class Answer:
    """What a diagnosis says of a case.

    Attributes:
        verdict: a `Verdict` or `NO_DIAGNOSIS`.
        names: of its answer, in order.
        mechanisms, artefacts: all that have a probability; None in format 1, which has no components.
        family: of format 1: of an answer without a name.
        confidence: of format 1.
        first_mismatch: trial and phase; None without mismatch.
        before_heldout_f0, after_heldout_f0: held-out RMSD of base and answer, F0; None where nothing was held out.
    """

    verdict: str
    names: tuple[str, ...] = ()
    mechanisms: tuple[Statement, ...] | None = None
    artefacts: tuple[Statement, ...] | None = None
    family: str | None = None
    confidence: float | None = None
    first_mismatch: tuple[str, str] | None = None
    before_heldout_f0: float | None = None
    after_heldout_f0: float | None = None
    seconds: float | None = None

    @classmethod
    def read(cls, row: Mapping[str, Any]) -> Answer:
        """From a row of ``results.json``."""
        if "error" in row:
            return cls(NO_DIAGNOSIS, seconds=row.get("seconds"))
        stated = row.get("components")
        mechanisms, artefacts = (
            None if stated is None else tuple(_statement(c) for c in stated if c["kind"] == kind.value) for kind in Kind
        )
        first = row.get("first_mismatch")
        known = ("family", "confidence", "before_heldout_f0", "after_heldout_f0", "seconds")
        return cls(
            str(row["verdict"]),
            tuple(str(name) for name in row.get("answer") or ()),
            mechanisms,
            artefacts,
            first_mismatch=(first["trial"], first["phase"]) if first else None,
            **{name: row.get(name) for name in known},
        )

    @property
    def named_mechanisms(self) -> list[Statement]:
        """Mechanisms of the answer."""
        by_name = {s.name: s for s in self.mechanisms or ()}
        return [by_name.get(name) or _bare(name) for name in self.names if name in by_name or name in _PHYSICS]

    @property
    def named_artefacts(self) -> list[Statement]:
        """Artefacts of probability `NAMED` and more, the most probable first; in format 1 those of the answer."""
        if self.artefacts is None:
            return [_bare(name) for name in self.names if name not in _PHYSICS]
        named = [s for s in self.artefacts if (s.probability or 0.0) >= NAMED]
        return sorted(named, key=lambda s: -(s.probability or 0.0))

    @property
    def first(self) -> Statement | None:
        """What it names first: an artefact where the verdict is on the measurement; None where it names nothing."""
        if self.verdict not in (Verdict.PHYSICS.value, Verdict.MEASUREMENT.value, Verdict.AMBIGUOUS.value):
            return None
        if self.artefacts is not None and self.verdict == Verdict.MEASUREMENT.value:
            return next(iter(self.named_artefacts), None)
        known = {s.name: s for s in (*(self.mechanisms or ()), *(self.artefacts or ()))}
        return next((known.get(name) or _bare(name) for name in self.names), None)


def row_of(d: Diagnosis) -> dict[str, JsonValue]:
    """What the scoring needs of a diagnosis, as JSON can hold it."""
    first = d.mismatch[0] if d.mismatch else None
    return {
        "verdict": d.verdict.value,
        "answer": list(d.answer),
        "p_value": d.p_value,
        "components": [
            {
                "name": c.name, "kind": c.kind.value, "family": c.family, "members": list(c.members),
                "inclusion_probability": c.inclusion_probability, "log_odds": c.log_odds,
                "contribution_f0": c.contribution_f0,
            }
            for c in d.components
        ],
        "first_mismatch": (
            None if first is None else {"trial": first.trial, "phase": first.phase, "size_f0": first.size_f0}
        ),
        "before_heldout_f0": d.before.heldout_rmsd_f0,
        "after_heldout_f0": d.after.heldout_rmsd_f0,
    }  # fmt: skip


def _statement(row: Mapping[str, Any]) -> Statement:
    members = row.get("members") or (row["name"],)
    return Statement(str(row["name"]), str(row["family"]), len(members) == 1, float(row["inclusion_probability"]))


def _bare(name: str) -> Statement:
    """A name that stands alone; one that is neither mechanism nor artefact is taken for a family's."""
    return Statement(name, FAMILY.get(name, name), name in FAMILY, None)
