"""Muscles of which everything is known, in place of another package's."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from xb_muscle_ros.bench.peers.conditions import Path
from xb_muscle_ros.bench.peers.muscle import Cost, Free, Peer
from xb_muscle_ros.trials.trial import Array


class Spring:
    """Force in proportion to activation, and a spring that is as stiff as activation says; it keeps what it was sent.

    Attributes:
        least_activation: that it takes.
        stiffness: F0/L0 at full activation.
        sent: activation and path of every trial.
    """

    least_activation = 0.01

    def __init__(self, values: Mapping[str, float]) -> None:
        self.stiffness = values.get("stiffness", 10.0)
        self.sent: list[tuple[float, Path]] = []

    def isometric_f0(self, activation: float) -> float:
        """0.98 F0 at most."""
        return 0.98 * activation

    def force_f0(self, activation: float, path: Path) -> Array:
        """Of the length at the samples, no matter what went before."""
        self.sent.append((activation, path))
        force: Array = activation * (0.98 + self.stiffness * path.length_l0())
        return force

    def cost(self, activation: float, path: Path, repeats: int) -> list[Cost]:
        """Nothing."""
        return [Cost("none", [1e-3] * repeats, 0.0, True), Cost("none", [2e-3] * repeats, 0.0, False)]


class Forgetful(Spring):
    """A spring of which a conditioning stretch of any size leaves half for 0.5 s."""

    def force_f0(self, activation: float, path: Path) -> Array:
        """Half the slope where a stretch went before."""
        force = super().force_f0(activation, path)
        onset = path.corner_s.size - 2
        conditioned = np.ptp(path.corner_l0[: onset + 1]) > 0.0
        rested = path.corner_s[onset] - path.corner_s[onset - 1] > 0.5
        base = 0.98 * activation
        return base + (force - base) * (0.5 if conditioned and not rested else 1.0)


def peer(kind: type[Spring] = Spring, free: tuple[Free, ...] = ()) -> Peer:
    """A row with one of these muscles."""
    return Peer("made", "made", kind, {"stiffness": 10.0}, free, "elastic")
