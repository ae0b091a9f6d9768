"""Inclusion probabilities: averages over sets, not the names of the one set that a search ended in."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.diagnose.answers import FAMILY, NAMES
from xb_muscle_ros.diagnose.names import MEASUREMENT, Name
from xb_muscle_ros.diagnose.search.explore import Explorer
from xb_muscle_ros.diagnose.search.system import Names, without
from xb_muscle_ros.trials.trial import Array

# What one more name costs that was not fitted, in the place of its occam factor.
_UNFITTED = 1.5
# A name whose member is this likely within its family stands for itself.
SEPARATE = 0.8
# Rivals: the chance that either is there exceeds that of the likelier one by this much.
_TRADES = 0.1


@dataclass(frozen=True)
class Averaged:
    """Sets with their probabilities.

    Attributes:
        sets: fitted ones and those one name beside them.
        log_evidence: of each, relative to the best, shape (sets,).
        mean_square_f0: of each, fibres averaged, F0², shape (sets,).
        fitted: whether each was fitted, shape (sets,).
    """

    sets: tuple[Names, ...]
    log_evidence: Array
    mean_square_f0: Array
    fitted: npt.NDArray[np.bool_]

    @property
    def probability(self) -> Array:
        """Of each set, shape (sets,)."""
        chances: Array = np.exp(self.log_evidence - np.logaddexp.reduce(self.log_evidence))
        return chances

    @property
    def fitted_alone(self) -> Averaged:
        """Without what was only promised."""
        kept = self.fitted
        sets = tuple(s for s, k in zip(self.sets, kept, strict=True) if k)
        return Averaged(sets, self.log_evidence[kept], self.mean_square_f0[kept], self.fitted[kept])

    def _having(self, names: Collection[Name]) -> npt.NDArray[np.bool_]:
        """Sets that have one of some names, or several, shape (sets,)."""
        wanted = set(names)
        return np.array([bool(wanted & set(s)) for s in self.sets], dtype=np.bool_)

    def including(self, names: Collection[Name]) -> float:
        """That one of some names, or several, are part of the truth."""
        return float(min(1.0, sum(self.probability[self._having(names)])))

    def log_odds(self, names: Collection[Name]) -> float:
        """Of the same; as large as the numbers allow."""
        here = self._having(names)
        if not np.any(here) or np.all(here):
            return -math.inf if not np.any(here) else math.inf
        return float(np.logaddexp.reduce(self.log_evidence[here]) - np.logaddexp.reduce(self.log_evidence[~here]))

    def contribution_f0(self, names: Collection[Name]) -> float:
        """Root of what the best set with some of these names takes off the mean square of the best one without, F0.

        Without them and their families: kin that does as well in their place does not make them idle.
        """
        families = {FAMILY[n] for n in names}
        here, without = self._having(names), ~self._having([n for n in NAMES if FAMILY[n] in families])
        if not np.any(here) or not np.any(without):
            return 0.0
        best = [int(np.argmax(np.where(chosen, self.log_evidence, -np.inf))) for chosen in (here, without)]
        squares = [float(self.mean_square_f0[k]) for k in best]
        return math.sqrt(max(squares[1] - squares[0], 0.0))

    def rivals(self, name: Name, others: Sequence[Name]) -> list[Name]:
        """Names that take its place in other sets."""
        own = self.including([name])
        found = []
        for other in others:
            if other is name:
                continue
            theirs = self.including([other])
            either = self.including([name, other])
            if min(own, theirs) >= 0.02 and either - max(own, theirs) >= _TRADES * min(1.0, own + theirs):
                found.append(other)
        return found


def averaged(explorer: Explorer, fibres: Sequence[int] | None = None) -> Averaged:
    """All sets that were looked at, by the evidence of all fibres or of some."""
    sets, evidence, squares, fitted = [], [], [], []
    chosen = range(len(explorer.systems)) if fibres is None else fibres
    for names, fits in explorer.fits.items():
        sets.append(names)
        evidence.append(explorer.evidence(names, fibres))
        squares.append(float(np.mean([fits[i].mean_square_f0 for i in chosen])))
        fitted.append(True)
    for names, promised in explorer.promised.items():
        if names in explorer.fits or names in explorer.unsolved:
            continue
        parents = [without(names, n) for n in names]
        parent = max((p for p in parents if p in explorer.fits), key=explorer.evidence, default=None)
        if parent is None:
            continue
        gained = -_UNFITTED + explorer.odds(names) - explorer.odds(parent)
        for i in chosen:
            system, floor = explorer.systems[i], explorer.floors_f0[i]
            before = explorer.fits[parent][i].mean_square_f0
            gained += system.log_likelihood(min(promised[i], before), floor) - system.log_likelihood(before, floor)
        # What a line promises and nobody fitted is no evidence beyond that of what was fitted.
        sets.append(names)
        evidence.append(
            min(explorer.evidence(parent, fibres) + gained, explorer.evidence(explorer.best(), fibres) - 1.0)
        )
        squares.append(float(np.mean([promised[i] for i in chosen])))
        fitted.append(False)
    found = np.array(evidence)
    return Averaged(tuple(sets), found - found.max(), np.array(squares), np.array(fitted))


def by_family(names: Sequence[Name]) -> dict[str, list[Name]]:
    """Names by family."""
    found: dict[str, list[Name]] = {}
    for name in names:
        found.setdefault(FAMILY[name], []).append(name)
    return found


def grouped(averages: Averaged, names: Sequence[Name]) -> list[tuple[Name, ...]]:
    """Components: names that stand for themselves, and families whose members the recordings do not tell apart."""
    found: list[tuple[Name, ...]] = []
    for members in by_family(names).values():
        order = sorted(members, key=lambda n: -averages.including([n]))
        together = averages.including(order)
        rest = [n for n in order if averages.including([n]) >= 0.1 * together]
        trading = len(rest) > 1 and averages.including([order[0]]) < SEPARATE * together
        # Members that act together are two components.
        both = sum(averages.including([n]) for n in rest) > 1.2 * together
        if together >= 0.1 and trading and not both and order[0] not in MEASUREMENT:
            found.append(tuple(rest))
            found += [(n,) for n in order if n not in rest]
        else:
            found += [(n,) for n in order]
    return found
