"""Conditions of trials: the solution a fibre was in and what was done to its length."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from xb_muscle_ros.scores.conditions import nominal
from xb_muscle_ros.trials.trial import Trial

# Solutions of one pCa differ by less than this.
_SAME_PCA = 0.02
# Protocols other than the paper's are alike where they have the same phases, their largest changes of length within
# this share, and so many L0, of each other.
_SAME_TRAVEL, _LEAST_TRAVEL_L0 = 0.1, 3e-3


class Condition(NamedTuple):
    """What a trial was done at.

    Attributes:
        pca: None where calcium changes.
        amplitude_l0, recovery_s: of the paper's protocol, as stated; None of others, recovery also without
            conditioning stretch.
        travel_l0: largest change of length, L0.
    """

    pca: float | None
    amplitude_l0: float | None
    recovery_s: float | None
    phases: tuple[str, ...]
    travel_l0: float

    def is_like(self, other: Condition) -> bool:
        """Whether two trials are repeats of each other."""
        if (self.pca is None) != (other.pca is None):
            return False
        if self.pca is not None and other.pca is not None and abs(self.pca - other.pca) > _SAME_PCA:
            return False
        if self.amplitude_l0 is not None and other.amplitude_l0 is not None:
            return (self.amplitude_l0, self.recovery_s) == (other.amplitude_l0, other.recovery_s)
        apart = abs(self.travel_l0 - other.travel_l0)
        near = max(_SAME_TRAVEL * max(self.travel_l0, other.travel_l0), _LEAST_TRAVEL_L0)
        return self.phases == other.phases and apart <= near

    @property
    def protocol(self) -> str:
        """What was done to length, in words."""
        if self.amplitude_l0 is None:
            return f"{', '.join(dict.fromkeys(self.phases)) or 'no phases'} by {100.0 * self.travel_l0:.2g} % L0"
        if self.amplitude_l0 == 0.0:
            return "test stretch alone"
        rest = "" if self.recovery_s is None else f" and {self.recovery_s:g} s"
        return f"test stretch after {100.0 * self.amplitude_l0:.3g} % L0{rest}"


def condition_of(trial: Trial) -> Condition:
    """The condition of a trial."""
    facts = trial.facts
    amplitude, recovery = nominal(facts.amplitude_l0, facts.recovery_s)
    phases = tuple(phase.name for phase in facts.phases)
    if "test_stretch" not in phases:
        amplitude = recovery = None
    if amplitude == 0.0:
        recovery = None
    return Condition(facts.pca, amplitude, recovery, phases, float(np.ptp(trial.length_change_l0)))


def shown(conditions: Iterable[Condition]) -> str:
    """Conditions in one line: protocols with their pCa."""
    of: dict[str, list[str]] = {}
    for c in conditions:
        pca = "changing calcium" if c.pca is None else f"pCa {c.pca:g}"
        rows = of.setdefault(c.protocol, [])
        if pca not in rows:
            rows.append(pca)
    return ", ".join(f"{protocol} at {', '.join(sorted(rows))}" for protocol, rows in of.items())
