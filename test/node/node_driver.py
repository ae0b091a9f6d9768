"""Talks to a muscle node in a second process over DDS."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

FIBRE = "18Dec2017a"
# Discovery takes 0.1 s, at times some seconds; starting Python on a busy machine takes longer.
PATIENCE_S = 30.0


class Driver:
    """Publishes to a muscle node and collects what it says.

    Attributes:
        link: see `xb_muscle_ros.node.client.link`.
        process: the node's; see `xb_muscle_ros.node.client.process`.
        forces, moments, reports: messages so far; reports as dictionaries, level and message among them.
    """

    def __init__(self, process: Any, domain: int, namespace: str) -> None:
        from diagnostic_msgs.msg import DiagnosticArray
        from sensor_msgs.msg import JointState

        from xb_muscle_ros.node.client.link import Link

        self.process = process
        self.domain = domain
        self.namespace = namespace
        self.link = Link("driver", namespace, domain)
        self.link.peer = f"{namespace}/muscle_node"
        self.forces: list[Any] = []
        self.moments: list[Any] = []
        self.reports: list[dict[str, Any]] = []
        node = self.link.node
        self._kind = JointState
        self._publishers: dict[str, Any] = {}
        self._met = False
        node.create_subscription(JointState, "muscle/force", self.forces.append, 100)
        node.create_subscription(JointState, "muscle/moments", self.moments.append, 100)
        node.create_subscription(DiagnosticArray, "/diagnostics", self._on_diagnostics, 10)

    def ready(self) -> None:
        """Wait until the node is on the graph and both sides know each other's topics."""
        node = self.link.node

        def met() -> bool:
            return all(node.count_publishers(f"muscle/{t}") for t in ("force", "moments"))

        assert self.link.wait_for(met, PATIENCE_S), self.process.log()
        # An answer tells that the node's side knows this one too, and sooner than its next report.
        self.link.state()

    def meet(self, fibre: str = FIBRE) -> None:
        """Make sure that a lockstep node hears all that is sent from now on, and is heard.

        A sender knows of a listener some time before the listener knows of the sender.
        """
        end = time.monotonic() + PATIENCE_S
        while not self._met:
            assert time.monotonic() < end, self.process.log()
            self.link.reset()
            self.forces.clear()
            self.moments.clear()
            self.send("calcium", 0.0, 1.0, name=[fibre])
            self.send("length", 0.0, 1.0, name=[fibre])
            self._met = self.link.wait_for(lambda: bool(self.forces) and bool(self.moments), 1.0)
        self.link.reset()
        self.forces.clear()
        self.moments.clear()

    def send(self, topic: str, time_s: float, *position: float, **fields: Any) -> None:
        """Publish a message; `name` defaults to the fibre."""
        stamp = round(time_s * 1e9)
        message = self._kind(**{"name": [FIBRE], **fields})
        message.position = list(position)
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, 1_000_000_000)
        self._publisher(topic).publish(message)

    def calcium(self, time_s: float, calcium_um: float) -> None:
        """Publish calcium. Messages of one process arrive in order here, so that no wait is needed."""
        self.send("calcium", time_s, calcium_um)

    def ask(self, time_s: float, *position: float, **fields: Any) -> Any:
        """Publish a length and return the force that answers it, or None after 5 s."""
        before = len(self.forces)
        self.send("length", time_s, *position, **fields)
        self.link.wait_for(lambda: len(self.forces) > before, 5.0)
        return self.forces[-1] if len(self.forces) > before else None

    def report(self, holds: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
        """The first report from now on for which a condition holds."""
        self.reports.clear()
        assert self.link.wait_for(lambda: any(holds(r) for r in self.reports), PATIENCE_S), (
            f"{self.reports[-1:]}; {self.process.log()}"
        )
        return next(r for r in self.reports if holds(r))

    def _publisher(self, topic: str) -> Any:
        if topic not in self._publishers:
            made = self._publishers[topic] = self.link.node.create_publisher(self._kind, f"muscle/{topic}", 100)
            assert self.link.wait_for(lambda: bool(made.get_subscription_count()), PATIENCE_S), self.process.log()
        return self._publishers[topic]

    def _on_diagnostics(self, message: Any) -> None:
        for status in message.status:
            if status.name == f"{self.link.peer[1:]}: stepping":
                values = {pair.key: pair.value for pair in status.values}
                self.reports.append({**values, "level": status.level, "message": status.message})
