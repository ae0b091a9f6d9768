"""How hard a diagnosis looks."""

from __future__ import annotations

from dataclasses import dataclass, field

from xb_muscle_ros.diagnose.search import explore


@dataclass(frozen=True)
class Effort:
    """How hard to look.

    Attributes:
        search: of the search for sets.
        folds: groups of trials left out in turn, at most.
        draws: of the bootstrap.
    """

    search: explore.Effort = field(default_factory=explore.Effort)
    folds: int = 8
    draws: int = 500


QUICK = Effort(explore.QUICK, folds=5, draws=200)
