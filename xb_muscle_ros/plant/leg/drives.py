"""What pulls at the leg's tendons: MuJoCo's own muscles, or this package's fibres in their place."""

from __future__ import annotations

from typing import Protocol

from xb_muscle_ros.plant.leg.body import Body
from xb_muscle_ros.plant.leg.stance import Stance


class Drive(Protocol):
    """Muscles of one body, constantly activated at what holds its stance."""

    model: str
    driven_by: dict[str, dict[str, float]]
    """What holds the stance: of each muscle ``calcium_um``, µM, or ``activation``, 0 to 1."""

    def reset(self) -> None:
        """Settle at the stance, where the body is."""

    def advance(self) -> None:
        """Go on to the muscles' lengths of now; called once a tick, when positions and velocities are known."""


class OwnMuscles:
    """MuJoCo's muscle actuators: no memory, constant activation."""

    model = "mujoco"

    def __init__(self, body: Body, stance: Stance) -> None:
        """Take the stance's activations."""
        self._body, self._activation = body, stance.activation
        names = zip(body.muscles, stance.activation.tolist(), strict=True)
        self.driven_by = {"activation": dict(names)}

    def reset(self) -> None:
        """Activate."""
        self._body.data.act[:] = self._activation
        self._body.data.ctrl[:] = self._activation

    def advance(self) -> None:
        """MuJoCo computes force within its step."""


