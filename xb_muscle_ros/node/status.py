"""What a stepping mode tells of itself, for diagnostics."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import NamedTuple

from xb_muscle_ros.node.lateness import LatenessSummary


@dataclass(frozen=True)
class Status:
    """A moment's account.

    Attributes:
        ticks: steps taken since activation.
        violations: states violated since activation.
        fault: why stepping stopped; empty where it did not.
        waiting: what is waited for; empty where nothing is.
        lateness: of ticks since the last reset; None where no clock drives them.
        overruns: deadlines that had passed before their tick was reached, since the last reset.
        dropped: of those, ticks that were not made up for.
    """

    ticks: int
    violations: int
    fault: str
    waiting: str
    lateness: LatenessSummary | None = None
    overruns: int = 0
    dropped: int = 0


class Account(NamedTuple):
    """How many samples were taken since the last reset.

    Attributes:
        length, calcium: samples of each.
        late: calcium samples that came after the step that should have used them.
    """

    length: int = 0
    calcium: int = 0
    late: int = 0

    def __str__(self) -> str:
        return f"{self.length} length and {self.calcium} calcium samples, {self.late} of them late"

    @classmethod
    def read(cls, text: str) -> Account | None:
        """Find an account in a text; the other way of `str`."""
        found = re.search(r"(\d+) length and (\d+) calcium samples, (\d+) of them late", text)
        return cls(*map(int, found.groups())) if found else None
