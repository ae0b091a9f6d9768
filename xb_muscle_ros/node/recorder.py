"""Hears topics and hands their messages on as bytes, whatever quality of service their publishers offer."""

# mypy: allow-untyped-calls

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Sequence
from functools import partial
from importlib import import_module
from typing import Any, NamedTuple

from rclpy.qos import QoSDurabilityPolicy, QoSProfile, QoSReliabilityPolicy
from rosbags.interfaces import Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.ros_types import JOINT_STATE

_DEPTH = 1000
# So many of the last messages are remembered: a subscription that is made anew gets those again that a publisher keeps.
_REMEMBERED = 64
_FOREVER = QosTime(9223372036, 854775807)

Take = Callable[[str, str, int, bytes], None]
"""Topic, type, time in ns and bytes of a message."""


class Recorder:
    """Subscriptions of topics, those that are not there yet among them.

    Attributes:
        unknown: topics whose type cannot be had here, with the reason.
    """

    def __init__(self, node: Any, topics: Sequence[str], take: Take) -> None:
        """Subscribe the topics of a muscle, and look for the others.

        Args:
            node: of rclpy.
            topics: full names.
            take: hears every message.
        """
        self._node, self._take = node, take
        self.unknown: dict[str, str] = {}
        self._heard = {topic: _Topic(topic) for topic in topics}
        for topic in self._heard.values():
            if topic.name.startswith("/muscle/"):
                # Most publishers are reliable; what differs is found once they are there. So nothing is missed of them.
                self._subscribe(topic, JOINT_STATE, _Offer(True, False))

    def look(self) -> None:
        """Look at who publishes, and subscribe as their quality of service asks for."""
        for topic in self._heard.values():
            publishers = self._node.get_publishers_info_by_topic(topic.name)
            if not publishers or topic.name in self.unknown:
                continue
            kinds = sorted({info.topic_type for info in publishers})
            if len(kinds) > 1:
                self.unknown[topic.name] = f"it has publishers of several types: {', '.join(kinds)}"
                continue
            profiles = [info.qos_profile for info in publishers]
            offer = _Offer(
                all(p.reliability == QoSReliabilityPolicy.RELIABLE for p in profiles),
                all(p.durability == QoSDurabilityPolicy.TRANSIENT_LOCAL for p in profiles),
            )
            if topic.subscription is None or topic.offer != offer or topic.kind != kinds[0]:
                self._subscribe(topic, kinds[0], offer)

    def qos(self, name: str) -> list[Qos]:
        """What a topic's publishers offer, as bags tell it."""
        offer = self._heard[name].offer
        return [
            Qos(
                history=QosHistory.KEEP_LAST,
                depth=_DEPTH,
                reliability=QosReliability.RELIABLE if offer.reliable else QosReliability.BEST_EFFORT,
                durability=QosDurability.TRANSIENT_LOCAL if offer.kept else QosDurability.VOLATILE,
                deadline=_FOREVER,
                lifespan=_FOREVER,
                liveliness=QosLiveliness.AUTOMATIC,
                liveliness_lease_duration=_FOREVER,
                avoid_ros_namespace_conventions=False,
            )
        ]

    def close(self) -> None:
        """Leave the topics."""
        for topic in self._heard.values():
            if topic.subscription is not None:
                self._node.destroy_subscription(topic.subscription)
                topic.subscription = None

    def _subscribe(self, topic: _Topic, kind: str, offer: _Offer) -> None:
        try:
            message = message_class(kind)
        except UserError as why:
            self.unknown[topic.name] = str(why)
            return
        old, topic.kind, topic.offer = topic.subscription, kind, offer
        topic.again = set(topic.last) if old is not None and offer.kept else set()
        topic.subscription = self._node.create_subscription(
            message,
            topic.name,
            partial(self._message, topic),
            QoSProfile(
                depth=_DEPTH,
                reliability=QoSReliabilityPolicy.RELIABLE if offer.reliable else QoSReliabilityPolicy.BEST_EFFORT,
                durability=QoSDurabilityPolicy.TRANSIENT_LOCAL if offer.kept else QoSDurabilityPolicy.VOLATILE,
            ),
            raw=True,
        )
        if old is not None:
            self._node.destroy_subscription(old)

    def _message(self, topic: _Topic, data: bytes) -> None:
        if data in topic.again:
            topic.again.discard(data)
            return
        topic.last.append(data)
        self._take(topic.name, topic.kind, time.time_ns(), data)


class _Offer(NamedTuple):
    """What all publishers of a topic offer: reliable, and kept for who comes later."""

    reliable: bool
    kept: bool


class _Topic:
    """One topic: its subscription, and the last messages."""

    def __init__(self, name: str) -> None:
        self.name, self.kind, self.offer = name, "", _Offer(True, False)
        self.subscription: Any = None
        self.last: deque[bytes] = deque(maxlen=_REMEMBERED)
        self.again: set[bytes] = set()


def message_class(kind: str) -> Any:
    """The Python class of a message type such as ``sensor_msgs/msg/JointState``.

    Raises:
        UserError: it is not installed.
    """
    package, _, name = kind.partition("/msg/")
    try:
        return getattr(import_module(f"{package}.msg"), name)
    except (ImportError, AttributeError):
        raise UserError(f"its type {kind} is not installed here") from None
