"""What a body tells the graph of itself: its joints, and how its episodes go."""

# mypy: allow-untyped-calls

from __future__ import annotations

import time
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from sensor_msgs.msg import JointState

from xb_muscle_ros.node.traffic import set_stamp
from xb_muscle_ros.plant.body import MovedBody
from xb_muscle_ros.plant.display import Display

_EVERY_S = 1.0


class Outlets:
    """Publishes ``plant/joint``, for viewers what `Display` has, and in ``/diagnostics`` a status ``<node>: episode``.

    The status is at level OK while an episode is played or was played to its end, at WARN while the body waits, at
    ERROR where an episode ended before its time; ``message`` says why, and ``state`` is the body's last one. What the
    last early end was is in ``last early end`` from then on, for who looks once a second.
    """

    def __init__(self, node: Any, body: MovedBody, display_hz: float) -> None:
        """Join the topics.

        Args:
            node: of rclpy.
            body: that is told of.
            display_hz: how often viewers are served, by the stamps; 0: not at all.
        """
        self._body = body
        self._clock = node.get_clock()
        self._display = Display(node, body.model, body.data) if display_hz else None
        self._shown_every = round(1e9 / display_hz) if display_hz else 0
        self._shown = -1
        self._name = f"{node.get_fully_qualified_name().lstrip('/')}: episode"
        self._to_joint = node.create_publisher(JointState, "plant/joint", 100)
        self._joint = JointState(name=list(body.joints.names))
        self._to_diagnostics = node.create_publisher(DiagnosticArray, "/diagnostics", 10)
        self._said_s = -_EVERY_S
        self._last = ("", "")
        self.early = 0
        self._why = ""

    def show(self, stamp: int) -> None:
        """Publish the joints; stamp in ns."""
        joint, joints = self._joint, self._body.joints
        set_stamp(joint, stamp)
        joint.position, joint.velocity = joints.angle_rad, joints.velocity_rad_per_s
        joint.effort = joints.torque_nm
        self._to_joint.publish(joint)
        if self._display is not None and stamp // self._shown_every != self._shown:
            self._shown = stamp // self._shown_every
            self._display.show(stamp)

    def playing(self, episode: int) -> None:
        """Say, once a second, that an episode goes on."""
        self._say(DiagnosticStatus.OK, "playing", episode)

    def waiting(self, episode: int, why: str) -> None:
        """Say, once a second and where the reason changes, what is waited for."""
        self._say(DiagnosticStatus.WARN, f"waiting: {why}", episode)

    def ended(self, episode: int, why: str = "") -> None:
        """Say that an episode ended; `why` if before its time."""
        self.early += bool(why)
        self._why = why or self._why
        self._said_s = -_EVERY_S
        self._say(DiagnosticStatus.ERROR if why else DiagnosticStatus.OK, why or "played to its end", episode)

    def _say(self, level: bytes, message: str, episode: int) -> None:
        now = time.monotonic()
        if self._last == (message, str(episode)) and now - self._said_s < _EVERY_S:
            return
        self._said_s, self._last = now, (message, str(episode))
        values = {
            "episode": episode,
            "ended before their time": self.early,
            "last early end": self._why,
            "state": self._body.state,
        }
        status = DiagnosticStatus(
            level=level,
            name=self._name,
            message=message,
            values=[KeyValue(key=key, value=str(value)) for key, value in values.items()],
        )
        array = DiagnosticArray(status=[status])
        set_stamp(array, int(self._clock.now().nanoseconds))
        self._to_diagnostics.publish(array)
