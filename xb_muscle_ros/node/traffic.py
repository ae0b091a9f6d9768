"""JointStates on their way in and out, without a message being made of every one where the middleware allows that.

To make a JointState of bytes takes a string for each name, and to make bytes of it takes as many. A sender's names are
the same in every message; only the numbers need to be read, and written.
"""

# mypy: allow-untyped-calls

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from rclpy.serialization import deserialize_message, serialize_message
from rclpy.utilities import get_rmw_implementation_identifier
from sensor_msgs.msg import JointState

from xb_muscle_ros.node.joint_state import Alike, Joints
from xb_muscle_ros.node.names import KINDS_KEPT
from xb_muscle_ros.node.rules import Refusal
from xb_muscle_ros.node.stepping import Floats
from xb_muscle_ros.trials.joint_layout import FIELDS, Layout

# Those for which bytes were tried.
_MIDDLEWARE = ("rmw_fastrtps_cpp",)


class Reader:
    """Reads serialized JointStates: of those that look like one of the last only the numbers, others whole."""

    def __init__(self) -> None:
        # The newest first: mostly there is one sender, and its messages look all the same.
        self._known: list[tuple[Layout, Alike]] = []

    def __call__(self, data: bytes) -> Joints:
        """What a message says.

        Raises:
            Refusal: the bytes are no JointState.
        """
        known = self._known
        for k, (layout, alike) in enumerate(known):
            if alike(data):
                if k:
                    known.insert(0, known.pop(k))
                return _read(layout, data)
        try:
            message = deserialize_message(data, JointState)
        except RuntimeError:
            told = f"{len(data)} bytes are no sensor_msgs/JointState; look for another type's publisher on this topic"
            raise Refusal("not readable", told) from None
        joints = Joints.of(message)
        found = Layout.of(data)
        # Only a layout that leads to what ROS has read is followed from now on.
        if found is not None and _same(_read(found, data), joints):
            known.insert(0, (found, Alike(found, data)))
            del known[KINDS_KEPT:]
        return joints


class Outlet:
    """A publisher of JointStates of the same joints, whose numbers are put in place.

    Attributes:
        publisher: of rclpy.
        names: of the joints.
        position, velocity, effort: what is put in is in the next message; shape (size,), empty where not asked for.
    """

    def __init__(self, publisher: Any, names: Sequence[str], size: int, fields: Sequence[str], bytes_: bool) -> None:
        """Publish `size` numbers in each of `fields`; as bytes where that is possible and asked for."""
        self.publisher = publisher
        self.names = list(names)
        self._message = JointState(name=self.names, **{field: [0.0] * size for field in fields})
        self._data: Any = None
        self._layout = None
        numbers = {field: _own(self._message, field) for field in FIELDS}
        data = serialize_message(self._message) if bytes_ else b""
        layout = Layout.of(data)
        if layout is not None and layout.end < len(data):
            data = layout.trimmed(data)
            layout = Layout.of(data)
        if layout is not None and layout.names == tuple(names) and _counts(layout) == [len(numbers[f]) for f in FIELDS]:
            # With these bytes before it all numbers are aligned.
            self._data = np.zeros(4 + len(data), dtype=np.uint8)[4:]
            self._data[:] = np.frombuffer(data, np.uint8)
            self._layout = layout
            numbers = {field: getattr(layout, field).of(self._data) for field in FIELDS}
        self.position, self.velocity, self.effort = (numbers[field] for field in FIELDS)

    def publish(self, stamp_ns: int) -> None:
        """Send what is in place, with a stamp in ns."""
        if self._layout is None:
            set_stamp(self._message, stamp_ns)
            self.publisher.publish(self._message)
            return
        self._layout.set_stamp(self._data, stamp_ns)
        self.publisher.publish(self._data.tobytes())


def as_bytes(log: Any = None) -> bool:
    """Whether messages are read and written as bytes; if not, `log` is told."""
    found = get_rmw_implementation_identifier()
    if found in _MIDDLEWARE:
        return True
    if log is not None:
        log.info(f"{found}: messages are read and written whole; bytes, faster, were tried with Fast DDS only")
    return False


def hearing(
    take: Callable[[Joints], Any], bytes_: bool, refuse: Callable[[Refusal], Any] = lambda _: None
) -> Callable[[Any], None]:
    """A callback for a subscription, `raw` where `bytes_`, that hands on what its messages say.

    Args:
        take: is given what a message says.
        bytes_: whether messages come as bytes.
        refuse: is told of bytes that are no message; the middleware drops them unsaid where messages come whole.
    """
    read: Callable[[Any], Joints] = Reader() if bytes_ else Joints.of

    def heard(message: Any) -> None:
        try:
            joints = read(message)
        except Refusal as refusal:
            refuse(refusal)
            return
        take(joints)

    return heard


def subscribe(node: Any, topic: str, take: Callable[[Joints], Any], qos: Any) -> Any:
    """A subscription of JointStates; `take` is given what they say."""
    bytes_ = as_bytes()
    log = node.get_logger()
    heard = hearing(take, bytes_, lambda refusal: log.warning(f"{topic} refused: {refusal}", throttle_duration_sec=5.0))
    return node.create_subscription(JointState, topic, heard, qos, raw=bytes_)


def set_stamp(message: JointState, stamp_ns: int) -> None:
    """Put a time in ns into a message."""
    stamp = message.header.stamp
    stamp.sec, stamp.nanosec = divmod(stamp_ns, 1_000_000_000)


def _read(layout: Layout, data: bytes) -> Joints:
    position, velocity, effort = layout.position, layout.velocity, layout.effort
    numbers = position.copied(data), velocity.copied(data), effort.copied(data)
    return Joints(layout.stamp_ns(data), layout.names, *numbers)


def _same(one: Joints, other: Joints) -> bool:
    # Bit for bit: not-a-number as well.
    return one[:2] == other[:2] and all(a.tobytes() == b.tobytes() for a, b in zip(one[2:], other[2:], strict=True))


def _counts(layout: Layout) -> list[int]:
    return [getattr(layout, field).size for field in FIELDS]


def _own(message: JointState, field: str) -> Floats:
    """A field of a message as an array: what is put into it is in the message."""
    # The message keeps a copy of what it is given; only its own memory is worth holding on to.
    memory = getattr(message, field)
    return np.frombuffer(memory, dtype=np.float64) if memory else np.empty(0)
