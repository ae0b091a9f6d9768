"""The node's subscriptions: quality of service, what was published before, and what got lost."""

# mypy: allow-untyped-calls

from __future__ import annotations

from functools import partial
from typing import Any

from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.qos import QoSDurabilityPolicy, QoSProfile, QoSReliabilityPolicy
from rclpy.qos_overriding_options import QoSOverridingOptions
from sensor_msgs.msg import JointState

from xb_muscle_ros.node.arrivals import Arrivals
from xb_muscle_ros.node.inlet import Inlet
from xb_muscle_ros.node.joint_state import Joints
from xb_muscle_ros.node.latched import Latched
from xb_muscle_ros.node.qos_overrides import POLICIES
from xb_muscle_ros.node.traffic import as_bytes, hearing


class Listening:
    """Subscriptions of ``muscle/calcium`` and of ``muscle/length`` or ``muscle/load``, until `close`.

    Attributes:
        arrivals: of each topic, by ``calcium`` and ``length`` or ``load``.
    """

    def __init__(self, node: Any, inlet: Inlet, mode: str, driven_by: str = "length") -> None:
        """Subscribe; messages are taken while the inlet is open; `driven_by` is ``length`` or ``load``."""
        self._node = node
        self._inlet = inlet
        self._mode = mode
        self._bytes = as_bytes(node.get_logger())
        self._latched: Latched | None = Latched(node, "muscle/calcium", self._take_latched)
        take = inlet.take_length if driven_by == "length" else inlet.take_load
        self.arrivals = {
            "calcium": Arrivals(hearing(inlet.take_calcium, self._bytes, partial(inlet.refuse, "calcium")), self.look),
            driven_by: Arrivals(hearing(take, self._bytes, partial(inlet.refuse, driven_by))),
        }
        # Calcium first: where both wait, it is then taken before the length or load that needs it.
        calcium, length = (self._subscribe(topic) for topic in self.arrivals)
        self._subscriptions = (calcium, length)
        if calcium.qos_profile.durability == QoSDurabilityPolicy.TRANSIENT_LOCAL:
            # The user wants it so: it hears what is kept by itself, and volatile publishers not at all.
            self._latched = None

    def open(self, is_open: bool) -> None:
        """Begin to take messages, those that publishers have kept among them, or end."""
        if is_open == self._inlet.open:
            return
        self._inlet.open = is_open
        self._inlet.forget()
        for arrivals in self.arrivals.values():
            arrivals.counting = is_open
        if self._latched is not None:
            self._latched.forget()
        self.look()

    def look(self) -> None:
        """Look for publishers of calcium that keep what they sent."""
        if self._latched is not None and self._inlet.open:
            self._latched.look()

    def reset(self) -> None:
        """Count anew. In lockstep calcium is forgotten, and what publishers sent before is of the time before."""
        for arrivals in self.arrivals.values():
            arrivals.lost = 0
        if self._latched is not None and self._mode == "lockstep":
            self._latched.skip()
        self._inlet.forget()

    def close(self) -> None:
        """Leave the topics."""
        if self._latched is not None:
            self._latched.forget()
        for subscription in self._subscriptions:
            self._node.destroy_subscription(subscription)

    def _take_latched(self, message: Any) -> None:
        self._inlet.take_calcium(Joints.of(message), latched=True)

    def _subscribe(self, topic: str) -> Any:
        arrivals = self.arrivals[topic]
        return self._node.create_subscription(
            JointState,
            f"muscle/{topic}",
            arrivals,
            _qos(self._mode),
            event_callbacks=SubscriptionEventCallbacks(matched=arrivals.matched),
            raw=self._bytes,
            **overridable(),
        )


def _qos(mode: str) -> QoSProfile:
    """A profile of its own for each subscription: rclpy writes a parameter file's overrides into it."""
    if mode == "lockstep":
        return QoSProfile(depth=100, reliability=QoSReliabilityPolicy.RELIABLE)
    # A lost sample breaks lockstep; in realtime an old one is worth less than none.
    return QoSProfile(depth=1, reliability=QoSReliabilityPolicy.BEST_EFFORT)


def overridable() -> dict[str, Any]:
    """What a parameter file may change of a publisher or subscription, as arguments for its making."""
    return {"qos_overriding_options": QoSOverridingOptions(POLICIES)}
