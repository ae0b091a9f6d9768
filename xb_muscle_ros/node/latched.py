"""Calcium that was published before the node listened, from publishers that keep it: transient local, reliable ones."""

# mypy: allow-untyped-calls

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.qos import QoSDurabilityPolicy, QoSProfile, QoSReliabilityPolicy
from sensor_msgs.msg import JointState

# What is kept comes within milliseconds of discovery; a machine that is busy takes longer.
_STAY_S = 5.0
_DEPTH = 100


class Latched:
    """A second subscription of a topic that lives as long as it takes to hear what publishers keep.

    A transient-local subscription hears no volatile publisher, and each of those would complain of it. So the node's
    own is volatile, and this one is there only where, and when, a publisher has something kept to give.
    """

    def __init__(self, node: Any, topic: str, take: Callable[[Any], None]) -> None:
        """Know the node, the topic and the callback; `look` does the rest."""
        self._node = node
        self._topic = topic
        self._take = take
        self._heard: set[bytes] = set()
        self._subscription: Any = None
        self._until_s = 0.0

    def look(self) -> None:
        """Listen to publishers that keep messages and were not heard yet; leave the others alone."""
        now = time.monotonic()
        new = self._keepers() - self._heard
        if new:
            self._heard |= new
            self._until_s = now + _STAY_S
            if self._subscription is None:
                self._subscription = self._subscribe()
        elif self._subscription is not None and now >= self._until_s:
            self._leave()

    def forget(self) -> None:
        """Listen to nobody, and to everybody anew at the next look."""
        self._leave()
        self._heard.clear()

    def skip(self) -> None:
        """Take nothing more from those that are there now."""
        self._heard |= self._keepers()
        self._leave()

    def _keepers(self) -> set[bytes]:
        ends = self._node.get_publishers_info_by_topic(self._node.resolve_topic_name(self._topic))
        return {
            bytes(end.endpoint_gid)
            for end in ends
            if end.qos_profile.durability == QoSDurabilityPolicy.TRANSIENT_LOCAL
            and end.qos_profile.reliability == QoSReliabilityPolicy.RELIABLE
        }

    def _subscribe(self) -> Any:
        qos = QoSProfile(
            depth=_DEPTH, reliability=QoSReliabilityPolicy.RELIABLE, durability=QoSDurabilityPolicy.TRANSIENT_LOCAL
        )
        # Volatile publishers do not match it, and that is no news: the node's own subscription hears them.
        quiet = SubscriptionEventCallbacks(use_default_callbacks=False)
        return self._node.create_subscription(JointState, self._topic, self._take, qos, event_callbacks=quiet)

    def _leave(self) -> None:
        if self._subscription is not None:
            self._node.destroy_subscription(self._subscription)
            self._subscription = None
