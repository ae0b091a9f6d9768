"""What a diagnosis states, read from ``diagnosis.json`` of either format."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from xb_muscle_ros.diagnose.names import FAMILY, MEASUREMENT, MECHANISMS, Name
from xb_muscle_ros.diagnose.result import Verdict

PHYSICS = frozenset(name.value for name in MECHANISMS)
FAMILIES_OF_PHYSICS = tuple(dict.fromkeys(FAMILY[name] for name in MECHANISMS))
NAMES = frozenset(name.value for name in (*MECHANISMS, *MEASUREMENT))
NAMED = 0.5
"""Inclusion probability from which a component is named."""
_MECHANISM, _ARTEFACT = "mechanism", "artefact"


class Statement(NamedTuple):
    """A component with its probability.

    Attributes:
        name: of a mechanism or artefact, or of a family whose members are not separable.
        family: whose it is.
        single: whether it is one name, and not a family of several.
        probability: that it is part of the truth; None in format 1, which has none for it.
    """

    name: str
    family: str
    single: bool
    probability: float | None


def components(found: Mapping[str, Any], mechanisms: bool) -> list[Statement]:
    """All components of one kind that a diagnosis lists; empty in format 1."""
    kind = _MECHANISM if mechanisms else _ARTEFACT
    return [_statement(row) for row in found.get("components") or () if row["kind"] == kind]


def named(found: Mapping[str, Any], mechanisms: bool) -> list[Statement]:
    """Mechanisms (or artefacts) that a diagnosis names: those of ``answer``, and artefacts by their probability."""
    listed = components(found, mechanisms)
    if not mechanisms and "components" in found:
        return [s for s in listed if s.probability is not None and s.probability >= NAMED]
    by_name = {s.name: s for s in listed}
    names = [str(name) for name in found.get("answer") or ()]
    return [by_name.get(name, _bare(name)) for name in names if _is_physics(name, found) == mechanisms]


def first_names(found: Mapping[str, Any], verdict: str) -> list[str]:
    """Names in the order of a diagnosis: artefacts where its verdict is on the measurement, else its answer."""
    if "components" in found and verdict == Verdict.MEASUREMENT.value:
        artefacts = sorted(named(found, mechanisms=False), key=lambda s: -(s.probability or 0.0))
        return [s.name for s in artefacts]
    return [str(name) for name in found.get("answer") or ()]


def family_of(name: str, found: Mapping[str, Any]) -> str:
    """Family of a name, or of a component that is a family itself."""
    row = _row(name, found)
    return str(row["family"]) if row is not None else _bare(name).family


def probability_of(name: str, found: Mapping[str, Any]) -> float | None:
    """Inclusion probability of a component; None where it has none."""
    row = _row(name, found)
    return None if row is None else float(row["inclusion_probability"])


def _row(name: str, found: Mapping[str, Any]) -> Mapping[str, Any] | None:
    return next((row for row in found.get("components") or () if row["name"] == name), None)


def _statement(row: Mapping[str, Any]) -> Statement:
    members = row.get("members") or (row["name"],)
    return Statement(str(row["name"]), str(row["family"]), len(members) == 1, float(row["inclusion_probability"]))


def _bare(name: str) -> Statement:
    """A name that stands alone; one that is no mechanism is taken for a family's."""
    known = name in NAMES
    return Statement(name, FAMILY[Name(name)] if known else name, known, None)


def _is_physics(name: str, found: Mapping[str, Any]) -> bool:
    row = _row(name, found)
    return row["kind"] == _MECHANISM if row is not None else name in PHYSICS or name in FAMILIES_OF_PHYSICS
