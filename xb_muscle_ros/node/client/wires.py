"""Samples on their way to a muscle node: one value for each of its fibres."""

# mypy: allow-untyped-calls

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rclpy.qos import QoSProfile, QoSReliabilityPolicy
from sensor_msgs.msg import JointState

from xb_muscle_ros.node.stepping import Floats
from xb_muscle_ros.node.traffic import Outlet, as_bytes
from xb_muscle_ros.trials.joint_layout import FIELDS


def reliable() -> QoSProfile:
    """Quality of service with which nothing gets lost, in a queue of 100."""
    return QoSProfile(depth=100, reliability=QoSReliabilityPolicy.RELIABLE)


class Sender:
    """A publisher of ``muscle/length``, ``muscle/load`` or ``muscle/calcium``, whose message is filled in place.

    Attributes:
        publisher: of rclpy.
    """

    def __init__(self, node: Any, topic: str, fibres: Sequence[str], qos: Any = None) -> None:
        """Publish on a topic; without names for a node of one fibre. `qos` as for rclpy; None: reliable."""
        self.publisher = node.create_publisher(JointState, topic, reliable() if qos is None else qos)
        # Without velocities, and with them.
        self._still, self._moving = (
            Outlet(self.publisher, fibres, max(len(fibres), 1), FIELDS[:count], as_bytes()) for count in (1, 2)
        )

    def send(self, stamp_ns: int, values: Floats | float, velocity: Floats | None = None) -> None:
        """Publish values of the fibres, shape (fibres,), or one for all, and velocities where there are any."""
        outlet = self._still
        if velocity is not None:
            outlet = self._moving
            outlet.velocity[:] = velocity
        outlet.position[:] = values
        outlet.publish(stamp_ns)


class LoadSender:
    """A publisher of ``muscle/load``: the same, with values in effort.

    Attributes:
        publisher: of rclpy.
    """

    def __init__(self, node: Any, topic: str, fibres: Sequence[str]) -> None:
        """Publish on a topic, see `Sender`."""
        self.publisher = node.create_publisher(JointState, topic, reliable())
        self._outlet = Outlet(self.publisher, fibres, max(len(fibres), 1), FIELDS, as_bytes())
        self._outlet.position[:] = self._outlet.velocity[:] = 0.0

    def send(self, stamp_ns: int, values: Floats | float) -> None:
        """Publish forces that the fibres are to bear (N), shape (fibres,), or one for all."""
        self._outlet.effort[:] = values
        self._outlet.publish(stamp_ns)
