"""The node one would write first: a fibre stepped in a timer of rclpy's default executor, to be measured against."""

# mypy: allow-untyped-calls, allow-subclassing-any

from __future__ import annotations

import signal
import time
from types import FrameType
from typing import Any

import numpy as np
import rclpy
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile, QoSReliabilityPolicy
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import try_shutdown
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger

from xb_muscle_ros.models.fibre_file import load_fibre
from xb_muscle_ros.models.muscle import Array, Muscle
from xb_muscle_ros.node.inlet import Inlet
from xb_muscle_ros.node.joint_state import Joints
from xb_muscle_ros.node.lateness import Lateness, LatenessSummary
from xb_muscle_ros.node.outputs import OutputMessages
from xb_muscle_ros.node.reporter import Reporter
from xb_muscle_ros.node.rules import Counts, Trouble, length_change_l0, scale_of
from xb_muscle_ros.node.status import Account, Status


class Deadlines:
    """What a timer that skips made of its deadlines: each is a call or skipped, and late either way."""

    def __init__(self, period_ns: int) -> None:
        self._lateness = Lateness()
        self._calls = 0
        self._period = period_ns
        self._next: int | None = None
        self._overruns = 0
        self._skipped = 0

    @property
    def missed(self) -> tuple[int, int]:
        """Deadlines that had passed before the timer was called for an earlier one, and those of them it skipped."""
        return self._overruns, self._skipped

    def summary(self) -> LatenessSummary:
        """Lateness of all deadlines; a skipped one is as late as the next call. Ticks are the calls, as in the node."""
        return self._lateness.summary()._replace(ticks=self._calls)

    def met(self, now_ns: int, next_ns: int) -> None:
        """The timer is called now (steady, ns), and will be called next for a deadline `next_ns`.

        Which deadlines are skipped is for the timer to say: a call may be late by more than a period, and the next one
        still be for the deadline in between.
        """
        due = next_ns - self._period if self._next is None else self._next
        skipped = max(round((next_ns - due) / self._period) - 1, 0)
        late = max(now_ns - due, 0)
        for i in range(skipped + 1):
            self._lateness.note(max(late - i * self._period, 0))
        self._overruns += max(late // self._period, skipped)
        self._skipped += skipped
        self._calls += 1
        self._next = next_ns


class PlainTimer(Node):
    """Same fibre, same messages, same account of itself; subscriptions, timer and publishing in one executor."""

    def __init__(self) -> None:
        super().__init__("plain_timer", automatically_declare_parameters_from_overrides=True)
        fibre = load_fibre(str(self.get_parameter("fiber_file").value))
        self._muscle = Muscle(fibre)
        self._scale = np.array([scale_of(fibre)])
        self._period = round(1e9 / float(self.get_parameter("rate_hz").value))
        newest = QoSProfile(depth=1, reliability=QoSReliabilityPolicy.BEST_EFFORT)
        force, moments = (self.create_publisher(JointState, f"muscle/{topic}", 100) for topic in ("force", "moments"))
        outlet = OutputMessages([fibre.name], force, moments)
        self._emit = outlet.publish
        inlet = Inlet([fibre.name], self, self.get_logger())
        inlet.open = True
        self.create_subscription(JointState, "muscle/calcium", lambda m: inlet.take_calcium(Joints.of(m)), newest)
        self.create_subscription(JointState, "muscle/length", lambda m: inlet.take_length(Joints.of(m)), newest)
        self.counts = Counts()
        self._change: float | None = None
        self._calcium: float | None = None
        self._state: Array | None = None
        self._ticks = 0
        self._forget()
        self._reporter = Reporter(self, "plain timer")
        self._reporter.watch([fibre], self, inlet, outlet)
        self.create_service(Trigger, "~/reset", self._on_reset)
        # Steady, so that it is not worse for another reason than the one in question.
        self._steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._timer = self.create_timer(self._period * 1e-9, self._on_timer, clock=self._steady)
        self.create_timer(1.0, lambda: self._reporter.report("active", time.monotonic(), 0.0), clock=self._steady)

    def take_calcium(self, stamp: int, fibres: Any, calcium_um: Array) -> list[Trouble]:
        """Free calcium, µM."""
        del stamp, fibres
        self._calcium = float(calcium_um[0])
        return []

    def take_length(self, stamp: int, fibres: Any, position_m: Array, velocity_m_per_s: Array | None) -> list[Trouble]:
        """Fibre length, m."""
        del stamp, fibres, velocity_m_per_s
        self._change = float(length_change_l0(position_m[0], self._scale[0, 0]))
        return []

    def status(self) -> Status:
        """How late timers were."""
        return Status(self._ticks, 0, "", "", self._deadlines.summary(), *self._deadlines.missed)

    def _forget(self) -> None:
        self._deadlines = Deadlines(self._period)

    def _on_timer(self) -> None:
        now = time.monotonic_ns()
        self._deadlines.met(now, now + int(self._timer.time_until_next_call()))
        if self._change is None or self._calcium is None:
            return
        if self._state is None:
            self._state = self._muscle.settle(self._change, self._calcium)
            # Settling takes as long as it takes; deadlines count from its end.
            self._forget()
            return
        self._state = self._muscle.step(self._state, self._change, self._calcium, self._period * 1e-9)
        self._ticks += 1
        stamp = int(self.get_clock().now().nanoseconds)
        self._emit(stamp, None, np.array([self._muscle.outputs(self._state)]), self._scale)

    def _on_reset(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        self._forget()
        response.success, response.message = True, f"forgotten after {Account()}"
        return response


def main() -> None:
    """Run until told to stop."""
    asked: list[int] = []

    def stop(number: int, frame: FrameType | None) -> None:
        asked.append(number)

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, stop)
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    node = PlainTimer()
    executor: Any = SingleThreadedExecutor()
    executor.add_node(node)
    while not asked:
        executor.spin_once(timeout_sec=0.1)
    executor.shutdown()
    node.destroy_node()
    try_shutdown()


if __name__ == "__main__":
    main()
