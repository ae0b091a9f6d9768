"""What a muscle of another package has to be able to do here, and how its rows of the comparison are distinguished."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from xb_muscle_ros.bench.peers.conditions import Path
from xb_muscle_ros.trials.trial import Array

L0_M, F0_N = 0.05, 1000.0
"""Size of every peer's muscle. Forces in F0 over lengths in L0 do not depend on it; what an absolute accuracy of an
integrator means does: it is that of a muscle of a human leg, as in most models for these packages."""


CONVERGED_F0 = 1e-3
"""Error of force that a trial may have to count as accurate, F0."""


class PeerMuscle(Protocol):
    """One muscle with its parameters.

    Attributes:
        least_activation: that it takes.
    """

    least_activation: float

    def isometric_f0(self, activation: float) -> float:
        """Force in equilibrium at length 0, F0."""

    def force_f0(self, activation: float, path: Path) -> Array:
        """Force at the samples of a path that begins in equilibrium, F0; activation is held."""

    def cost(self, activation: float, path: Path, repeats: int) -> list[Cost]:
        """What a trial costs at the accuracies of interest, the package's own default first."""


class Cost(NamedTuple):
    """What one trial costs.

    Attributes:
        integrator: method and accuracy, in words.
        seconds: of each repeat.
        error_f0: largest error of force at 1 kHz, F0.
        default: whether this is what the package does unless told otherwise.
    """

    integrator: str
    seconds: list[float]
    error_f0: float
    default: bool


def loosest(errors_f0: Mapping[float, float]) -> float:
    """The largest accuracy from which on force errs by at most 0.1 % F0.

    Args:
        errors_f0: by accuracy.

    Returns:
        the finest where no error is small enough.
    """
    found = min(errors_f0)
    for accuracy in sorted(errors_f0):
        if errors_f0[accuracy] > CONVERGED_F0:
            break
        found = accuracy
    return found


class Free(NamedTuple):
    """A parameter that is fitted.

    Attributes:
        name: in the muscle, with its unit.
        words: what tables call it.
        lower, upper: bounds.
    """

    name: str
    words: str
    lower: float
    upper: float


@dataclass(frozen=True)
class Peer:
    """A row of the comparison.

    Attributes:
        key: short name.
        title: of the muscle, for tables and figures.
        take: makes the muscle with parameters by name; the package's defaults stand for those left out.
        defaults: values of the parameters that could be fitted.
        free: those that are.
        tendon: ``rigid``, ``elastic`` or ``none``.
    """

    key: str
    title: str
    take: Callable[[Mapping[str, float]], PeerMuscle]
    defaults: Mapping[str, float]
    free: tuple[Free, ...]
    tendon: str

    @property
    def fitted(self) -> str:
        """What was fitted, in words."""
        return " and ".join(free.words for free in self.free) or "nothing"
