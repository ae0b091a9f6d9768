"""Who hears what is played, and what comes back: listeners, a muscle node among them, and the forces they send."""

# mypy: allow-untyped-calls

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.qos import QoSProfile, QoSReliabilityPolicy

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.node.client.link import Link
from xb_muscle_ros.node.diagnostics import fault_in, status_name
from xb_muscle_ros.node.joint_state import Joints
from xb_muscle_ros.node.traffic import subscribe

# They only keep what they hear.
_RECORDERS = ("muscle_recorder", "rosbag2_recorder")
_FORCES = ("muscle/force", "muscle/measured_force")
_OTHER = {"length": "load", "load": "length"}
_CONTROL = {"length": "length", "load": "force"}
# A muscle node is looked for this long once there is a listener, s.
_NODE_S = 1.0
# It tells of itself once a second.
_REPORT_S = 1.5
_SAME = 1e-6


class Audience:
    """What listens to a topic below ``muscle/``.

    Attributes:
        names: whose forces were heard since they were last forgotten.
        refused: samples that the muscle node has refused in all, with its words; None where it tells nothing.
        fault: why the muscle node stopped; empty where it did not.
    """

    def __init__(self, link: Link, topic: str) -> None:
        """Hear forces and diagnostics; `topic` is ``length`` or ``load``."""
        self._link, self._topic = link, topic
        self.names: set[str] = set()
        self.refused: dict[str, int] | None = None
        self.fault, self._has_reported = "", False
        newest = QoSProfile(depth=1, reliability=QoSReliabilityPolicy.BEST_EFFORT)
        self._kept = [subscribe(link.node, name, self._hear, newest) for name in _FORCES]
        self._kept.append(link.node.create_subscription(DiagnosticArray, "/diagnostics", self._on_diagnostics, 10))

    def forget(self) -> None:
        """Forget whose forces were heard, and that the muscle node has told of itself."""
        self.names.clear()
        self._has_reported = False

    def has_answered(self, joint: str) -> bool:
        """Whether a fibre's force was heard since, and the muscle node, if there is one, has told of itself."""
        return joint in self.names and (self._has_reported or not self._link.peer)

    def meet(self, publisher: Any, wait_s: float) -> None:
        """Wait until somebody other than a recorder hears a publisher.

        Raises:
            UserError: nobody does in time, or a muscle node that is driven otherwise.
        """
        link, topic = self._link, publisher.topic_name

        def heard() -> bool:
            known = self._listeners(topic)
            recorders = sum(name in _RECORDERS for name in known)
            return len(known) > recorders and publisher.get_subscription_count() > recorders

        if link.wait_for(heard, wait_s) or link.stop():
            return
        other = link.node.resolve_topic_name(f"muscle/{_OTHER[self._topic]}")
        if any(name not in _RECORDERS for name in self._listeners(other)):
            remedy = f"{other} is listened to: take --drive {_OTHER[self._topic]}, or start the node with control:="
            remedy += _CONTROL[self._topic]
        else:
            remedy = "start what is to hear it, or look at names, ROS_DOMAIN_ID and ROS_AUTOMATIC_DISCOVERY_RANGE"
        raise UserError(f"nobody but recorders listens to {topic} (looked for {wait_s:g} s); {remedy}")

    def ask_node(self, unit: float, say: Callable[[str], None]) -> None:
        """Find a muscle node that listens, and say what it has otherwise than what is sent.

        Args:
            unit: one L0 (m) or one F0 (N) in what is sent.
            say: hears a line on each.

        Raises:
            UserError: several nodes send forces.
        """
        link = self._link
        forces = link.node.resolve_topic_name("muscle/force")
        if not link.wait_for(lambda: bool(link.node.count_publishers(forces)), _NODE_S):
            return
        link.find(_NODE_S, "")
        constant = "constants.reference_length_m" if self._topic == "length" else "constants.f0_n"
        try:
            found = link.parameters(["mode", "control", constant])
        except UserError:
            found = {}
        if "mode" not in found:
            link.peer = ""  # something else that sends forces
            return
        if found["mode"] == "lockstep":
            say(f"node {link.peer} is in lockstep: it steps by the stamps and not by the clock")
        one = found.get(constant)
        if one is not None and abs(unit / one - 1.0) > _SAME:
            what = ("L0", "m") if self._topic == "length" else ("F0", "N")
            say(
                f"one {what[0]} is {unit:g} {what[1]} in what is sent and {one:g} {what[1]} for node {link.peer}; "
                f"--as-{what[0].lower()} '{one:g} {what[1]}' sends its own"
            )
        # What it refused before is not of what is sent now.
        link.wait_for(lambda: self.refused is not None, _REPORT_S)

    def _listeners(self, topic: str) -> list[str]:
        """Names of the nodes that listen; those not known yet are left out."""
        found = [end.node_name for end in self._link.node.get_subscriptions_info_by_topic(topic)]
        return [name for name in found if "_NODE_NAME_UNKNOWN_" not in name]

    def _hear(self, message: Joints) -> None:
        self.names.update(message.names or ("without a name",))

    def _on_diagnostics(self, message: Any) -> None:
        for status in message.status:
            if self._link.peer and status.name == status_name(self._link.peer):
                counts = {pair.key: pair.value for pair in status.values if pair.key.startswith("refused: ")}
                self.refused = {key.removeprefix("refused: "): int(value) for key, value in counts.items()}
                self.fault = fault_in(status)
                self._has_reported = True
