"""Force and moments as messages, filled in place: nothing is allocated per tick."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from sensor_msgs.msg import JointState

from xb_muscle_ros.models.muscle import Outputs
from xb_muscle_ros.models.registry import PUSHES_F0
from xb_muscle_ros.node.names import Indices
from xb_muscle_ros.node.stepping import Floats
from xb_muscle_ros.trials.simulated import MOMENTS

_FORCE, _CE_LENGTH, _CE_VELOCITY, _FIRST = (
    Outputs._fields.index(name) for name in ("force_f0", "ce_length_change_l0", "ce_velocity_l0_per_s", MOMENTS[0])
)
_MOMENTS = slice(_FIRST, _FIRST + len(MOMENTS))
assert tuple(Outputs._fields[_MOMENTS]) == MOMENTS


class OutputMessages:
    """Publishes forces (``muscle/force``) and moments (``muscle/moments``), of all fibres in one message each.

    Force: effort, N; position and velocity of the contractile element, m and m/s. Moments: dimensionless, in position.

    Attributes:
        pushed: fibre and force (F0) of the strongest push since it was last cleared; None where all pulled.
    """

    def __init__(self, fibres: Sequence[str], force: Any, moments: Any) -> None:
        """Fill messages of these fibres; `force` and `moments` are publishers of rclpy."""
        self.pushed: tuple[str, float] | None = None
        self._names = list(fibres)
        self._to_force = force
        self._to_moments = moments
        self._all = _Pair(self._names)

    def publish(self, stamp_ns: int, which: Indices | None, outputs: Floats, scales: Floats) -> None:
        """Send the outputs of one moment.

        Args:
            stamp_ns: of the messages.
            which: fibres; None: all, in order.
            outputs: shape (fibres, 11), a column for each name of `Outputs`.
            scales: shape (fibres, 2), one L0 (m) and one F0 (N).
        """
        pair = self._all if which is None else _Pair([self._names[i] for i in which.tolist()])
        pair.fill(stamp_ns, outputs, scales)
        forces = outputs[:, _FORCE].tolist()
        least = min(forces)
        if least < PUSHES_F0 and (self.pushed is None or least < self.pushed[1]):
            self.pushed = pair.force.name[forces.index(least)], least
        self._to_force.publish(pair.force)
        # Publishing is the dearest part of a tick; nobody misses what nobody listens to.
        if self._to_moments.get_subscription_count():
            pair.fill_moments(stamp_ns, outputs)
            self._to_moments.publish(pair.moments)


class _Pair:
    """Messages for some fibres, filled in place."""

    def __init__(self, fibres: Sequence[str]) -> None:
        self.force, self.moments = JointState(), JointState()
        self.force.name = list(fibres)
        self.moments.name = [f"{fibre}/{name}" for fibre in fibres for name in MOMENTS]
        self._position, self._velocity, self._effort = (
            array(self.force, field, len(fibres)) for field in ("position", "velocity", "effort")
        )
        self._values = array(self.moments, "position", len(self.moments.name))

    def fill(self, stamp_ns: int, outputs: Floats, scales: Floats) -> None:
        """Put forces in, and the contractile elements' lengths and velocities."""
        set_stamp(self.force, stamp_ns)
        reference, f0 = scales.T
        np.multiply(outputs[:, _FORCE], f0, out=self._effort)
        np.multiply(reference, 1.0 + outputs[:, _CE_LENGTH], out=self._position)
        np.multiply(reference, outputs[:, _CE_VELOCITY], out=self._velocity)

    def fill_moments(self, stamp_ns: int, outputs: Floats) -> None:
        """Put the moments in."""
        set_stamp(self.moments, stamp_ns)
        self._values[:] = outputs[:, _MOMENTS].ravel()


def set_stamp(message: JointState, stamp_ns: int) -> None:
    """Put a time in ns into a message."""
    stamp = message.header.stamp
    stamp.sec, stamp.nanosec = divmod(stamp_ns, 1_000_000_000)


def array(message: JointState, field: str, size: int) -> Floats:
    """Array of a message's field with room for `size` values: what is put into it is in the message."""
    setattr(message, field, [0.0] * size)
    # The message keeps a copy of what it is given; only its own memory is worth holding on to.
    return np.frombuffer(getattr(message, field), dtype=np.float64)  # type: ignore[no-any-return, unused-ignore]
