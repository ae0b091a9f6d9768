"""One diagnosis held against the key."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from xb_muscle_ros.diagnose.names import FAMILY, Name
from xb_muscle_ros.diagnose.result import Verdict
from xb_muscle_ros.prove.stated import NAMES, family_of, first_names, named, probability_of

# A global change of rates is what parameters are for: to call it so is right as well.
_AS_GOOD_AS_PARAMETERS = {Name.TEMPERATURE.value, Name.PHOSPHATE.value}
NO_DIAGNOSIS = "error"


class Judged(NamedTuple):
    """What became of a case.

    Attributes:
        case: its name.
        kind: ``null``, ``fault``, ``single``, ``pair`` or ``outside``.
        labels: what is concealed.
        size_f0: RMS that it leaves after a refit.
        size_class_f0: the highest of 0.5, 1, 2 and 4 % F0 that this reaches, else 0; None for nulls and faults.
        verdict: of the tool, or ``error``.
        answer: first name it gives, else its verdict.
        physics: verdict ``physics``, or ``ambiguous`` with a mechanism among the names.
        exact: the first name is right; for a pair either, for temperature and phosphate also ``parameters``, ``none``.
        family: the first name is of a right family.
        located: the first mismatch is where what a refit leaves is at least half as large as anywhere; None without.
        located_beside_nuisances: the same with what a refit of constants and usual faults leaves.
        gain: held-out gain over that of the true model; None unless before and after are known.
        confidence: as the tool states it; in format 2 the inclusion probability of its first name.
        seconds: that the tool took.
    """

    case: str
    kind: str
    labels: tuple[str, ...]
    size_f0: float
    size_class_f0: float | None
    verdict: str
    answer: str
    physics: bool
    exact: bool
    family: bool
    located: bool | None
    located_beside_nuisances: bool | None
    gain: float | None
    confidence: float | None
    seconds: float | None


def judge(truth: Mapping[str, Any], found: Mapping[str, Any]) -> Judged:
    """Hold a diagnosis against the truth.

    Args:
        truth: a case of the key.
        found: what `prove.run.needed` keeps of its diagnosis, or its error.
    """
    labels = tuple(truth["labels"])
    verdict = NO_DIAGNOSIS if "error" in found else str(found["verdict"])
    names = first_names(found, verdict)
    speaks = verdict in (Verdict.PHYSICS.value, Verdict.MEASUREMENT.value, Verdict.AMBIGUOUS.value)
    first = names[0] if names and speaks else None
    exact = first in labels
    families = {FAMILY[Name(label)] for label in labels if label in NAMES}
    family = first is not None and family_of(first, found) in families
    if speaks and first is None:
        family = found.get("family") in families
    if set(labels) & _AS_GOOD_AS_PARAMETERS and verdict in (Verdict.PARAMETERS.value, Verdict.NONE.value):
        exact = family = True
    return Judged(
        case=str(truth["case"]),
        kind=str(truth["kind"]),
        labels=labels,
        size_f0=float(truth["size_f0"]),
        size_class_f0=truth["size_class_f0"],
        verdict=verdict,
        answer=first or verdict,
        physics=verdict == Verdict.PHYSICS.value
        or (verdict == Verdict.AMBIGUOUS.value and bool(named(found, mechanisms=True))),
        exact=exact,
        family=family,
        located=_located(truth, found, "rms_f0"),
        located_beside_nuisances=_located(truth, found, "beside_nuisances_f0"),
        gain=heldout_gain(truth, found),
        confidence=found.get("confidence") if "components" not in found else probability_of(first or "", found),
        seconds=found.get("seconds"),
    )


def _located(truth: Mapping[str, Any], found: Mapping[str, Any], size: str) -> bool | None:
    first = found.get("first_mismatch")
    largest = max((cell[size] for cell in truth["cells"]), default=0.0)
    if not first or largest <= 0.0:
        return None
    here = [c[size] for c in truth["cells"] if c["trial"] == first["trial"] and c["phase"] == first["phase"]]
    return bool(here) and max(here) >= 0.5 * largest


def heldout_gain(truth: Mapping[str, Any], found: Mapping[str, Any]) -> float | None:
    """Held-out gain over that of the true model; None unless before and after are known."""
    before, after, noise = found.get("before_heldout_f0"), found.get("after_heldout_f0"), truth["noise_rms_f0"]
    if before is None or after is None or noise is None or before <= noise:
        return None
    return float((before - after) / (before - noise))
