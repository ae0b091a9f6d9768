"""The next experiment: the one that separates what is least sure."""

from __future__ import annotations

from collections.abc import Sequence

from xb_muscle_ros.diagnose.component import Component, Kind
from xb_muscle_ros.diagnose.names import MEASUREMENT, Name
from xb_muscle_ros.diagnose.next_experiment import Proposal, propose
from xb_muscle_ros.diagnose.search.system import Names
from xb_muscle_ros.diagnose.searching import Searched

# Surer than this there is nothing to separate.
_SURE = 0.98


def plan(study: Searched, found: Sequence[Component]) -> Proposal | None:
    """The protocol on which the two most probable sets differ most that do not agree on the least sure mechanism."""
    sets = {s: study.explorer.evidence(s) for s in study.explorer.fits}
    for names, separates in _pairs(sets, found):
        one, other = (study.fibre_with(s, 0) for s in names)
        pcas = sorted({t.facts.pca for t in study.studies[0].trials if t.facts.pca is not None})
        chosen = sorted({pcas[0], pcas[len(pcas) // 2], pcas[-1]}) if pcas else [6.2]
        proposal = propose(one, other, separates, chosen)
        if proposal is not None:
            return proposal
    return None


def _pairs(sets: dict[Names, float], found: Sequence[Component]) -> list[tuple[tuple[Names, Names], tuple[str, ...]]]:
    """Pairs of sets to tell apart, the least sure component first."""
    unsure = sorted(
        (c for c in found if c.kind is Kind.MECHANISM and c.inclusion_probability > 1.0 - _SURE),
        key=lambda c: abs(c.inclusion_probability - 0.5),
    )
    pairs = []
    for c in unsure[:3]:
        members = [Name(m) for m in c.members]
        if len(members) > 1:
            first, second = ([s for s in sets if m in s] for m in members[:2])
            names = (members[0].value, members[1].value)
        else:
            first = [s for s in sets if members[0] in s]
            second = [s for s in sets if members[0] not in s]
            names = (members[0].value, "")
        if not first or not second:
            continue
        best = max(first, key=lambda s: sets[s]), max(second, key=lambda s: sets[s])
        others = [n.value for n in best[1] if n not in best[0] and n not in MEASUREMENT]
        label = names[1] or (others[0] if others else "")
        if {n for n in best[0] if n not in MEASUREMENT} != {n for n in best[1] if n not in MEASUREMENT}:
            pairs.append((best, tuple(n for n in (names[0], label) if n)))
    return pairs
