"""How hard a diagnosis looks."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Effort:
    """How hard to look.

    Attributes:
        steps: names in a set at most.
        candidates: fitted at each step, the most promising first.
        rivals: fitted in the place of each name of the best set.
        most: Jacobians of a fit.
        tolerance: fall of the cost at which a fit stops.
        folds: groups of trials left out in turn, at most.
    """

    steps: int = 6
    candidates: int = 6
    rivals: int = 4
    most: int = 10
    tolerance: float = 0.02
    folds: int = 8
    draws: int = 500


QUICK = Effort(steps=5, candidates=4, rivals=2, most=5, tolerance=0.1, folds=5, draws=200)
