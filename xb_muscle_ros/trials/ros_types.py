"""Topics of a trial bag, their message type and their quality of service."""

from __future__ import annotations

import functools

import numpy as np
from rosbags.interfaces import Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime
from rosbags.typesys import Stores, get_typestore
from rosbags.typesys.store import Typestore
from rosbags.typesys.stores.ros2_jazzy import (
    builtin_interfaces__msg__Time,
    sensor_msgs__msg__JointState,
    std_msgs__msg__Header,
)

from xb_muscle_ros.trials.trial import Array

JointState = sensor_msgs__msg__JointState
JOINT_STATE = "sensor_msgs/msg/JointState"

LENGTH = "/muscle/length"
CALCIUM = "/muscle/calcium"
MEASURED_FORCE = "/muscle/measured_force"
FORCE = "/muscle/force"
MOMENTS = "/muscle/moments"
# Order of messages with equal stamps: a node that steps on each length message has to hold the calcium by then.
TOPICS = (CALCIUM, LENGTH, MEASURED_FORCE, FORCE, MOMENTS)

LAST_STAMP_NS = (2**31 - 1) * 10**9 + 999_999_999  # builtin_interfaces/Time counts seconds in an int32
_EMPTY: Array = np.empty(0)
_FOREVER = QosTime(9223372036, 854775807)


def qos(topic: str) -> list[Qos]:
    """Offered quality of service of a topic.

    Reliable, so that it meets subscribers of either kind. Calcium is sparse, therefore transient local: who joins
    late still gets the value that holds.
    """
    durability = QosDurability.TRANSIENT_LOCAL if topic == CALCIUM else QosDurability.VOLATILE
    return [
        Qos(
            history=QosHistory.KEEP_LAST,
            depth=10,
            reliability=QosReliability.RELIABLE,
            durability=durability,
            deadline=_FOREVER,
            lifespan=_FOREVER,
            liveliness=QosLiveliness.AUTOMATIC,
            liveliness_lease_duration=_FOREVER,
            avoid_ros_namespace_conventions=False,
        )
    ]


@functools.cache
def typestore() -> Typestore:
    """Message definitions of ROS 2 Jazzy."""
    return get_typestore(Stores.ROS2_JAZZY)


def joint_state(
    stamp_ns: int, names: list[str], position: Array = _EMPTY, velocity: Array = _EMPTY, effort: Array = _EMPTY
) -> bytes:
    """One serialized JointState without frame; arrays of the length of ``names`` or empty."""
    stamp = builtin_interfaces__msg__Time(sec=stamp_ns // 10**9, nanosec=stamp_ns % 10**9)
    header = std_msgs__msg__Header(stamp=stamp, frame_id="")
    message = JointState(header=header, name=names, position=position, velocity=velocity, effort=effort)
    return bytes(typestore().serialize_cdr(message, JOINT_STATE))
