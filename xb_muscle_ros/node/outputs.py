"""Force and moments as messages, filled in place: nothing is allocated per tick."""

from __future__ import annotations

from collections.abc import MutableSequence
from typing import Any, Protocol

from sensor_msgs.msg import JointState

from xb_muscle_ros.models.muscle import Outputs
from xb_muscle_ros.node.inputs import Scale
from xb_muscle_ros.trials.simulated import MOMENTS


class Publisher(Protocol):
    """What is used of an rclpy publisher."""

    def publish(self, msg: Any) -> None:
        """Send a message."""

    def get_subscription_count(self) -> int:
        """How many listen."""


def room(message: JointState, field: str, size: int) -> MutableSequence[float]:
    """Array of a message's field with room for `size` values: what is put into it is in the message."""
    setattr(message, field, [0.0] * size)
    # The message keeps a copy of what it is given; only its own array is worth holding on to.
    values: MutableSequence[float] = getattr(message, field)
    return values


class OutputMessages:
    """Publishes one fibre's force (``muscle/force``) and moments (``muscle/moments``).

    Force: effort, N; position and velocity of the contractile element, m and m/s. Moments: dimensionless, in position.
    """

    def __init__(self, fibre: str, force: Publisher, moments: Publisher) -> None:
        self._to_force = force
        self._to_moments = moments
        self._force = JointState()
        self._force.name = [fibre]
        self._position = room(self._force, "position", 1)
        self._velocity = room(self._force, "velocity", 1)
        self._effort = room(self._force, "effort", 1)
        self._moments = JointState()
        self._moments.name = [f"{fibre}/{name}" for name in MOMENTS]
        self._values = room(self._moments, "position", len(MOMENTS))
        self._first = Outputs._fields.index(MOMENTS[0])
        assert Outputs._fields[self._first : self._first + len(MOMENTS)] == MOMENTS

    def publish(self, stamp_ns: int, outputs: Outputs, scale: Scale) -> None:
        """Send the outputs of one moment, stamped in ns."""
        sec, nanosec = divmod(stamp_ns, 1_000_000_000)
        for message in (self._force, self._moments):
            stamp = message.header.stamp
            stamp.sec, stamp.nanosec = sec, nanosec
        reference = scale.reference_length_m
        self._effort[0] = outputs.force_f0 * scale.f0_n
        self._position[0] = reference * (1.0 + outputs.ce_length_change_l0)
        self._velocity[0] = reference * outputs.ce_velocity_l0_per_s
        self._to_force.publish(self._force)
        # Publishing is the dearest part of a tick; nobody misses what nobody listens to.
        if self._to_moments.get_subscription_count():
            first = self._first
            for i in range(len(MOMENTS)):
                self._values[i] = outputs[first + i]
            self._to_moments.publish(self._moments)
