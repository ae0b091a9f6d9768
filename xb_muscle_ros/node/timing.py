"""How well a realtime node keeps time on this machine."""

from __future__ import annotations

import math
import threading
import time
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from sensor_msgs.msg import JointState

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.node.link import Link
from xb_muscle_ros.node.outputs import room
from xb_muscle_ros.node.process import NodeProcess, private_domain
from xb_muscle_ros.node.waiting import make_waiter

_INPUT_HZ = 500.0
_START_S = 60.0
_KEYS = {
    "ticks since reset": "ticks",
    "lateness p50 (µs)": "lateness_p50_us",
    "lateness p99 (µs)": "lateness_p99_us",
    "lateness p99.9 (µs)": "lateness_p99.9_us",
    "lateness max (µs)": "lateness_max_us",
    "overruns": "overruns",
    "dropped ticks": "dropped_ticks",
    "state violations": "state_violations",
    "refused": "refused",
}


def run_timing(duration_s: float, rate_hz: float, fibre: str = "18Dec2017a") -> dict[str, float]:
    """Measure a realtime node in its own process, fed with length at 500 Hz and with calcium.

    Args:
        duration_s: time measured, s; statistics start anew once the node is stepping.
        rate_hz: of the node.
        fibre: packaged fibre or file.

    Returns:
        ``lateness_p50_us``, ``_p99_us``, ``_p99.9_us``, ``_max_us``, ``overruns``, ``dropped_ticks``, ``ticks``,
        ``rate_hz`` (ticks per second reached), ``cpu_share`` (of one core, mean), ``state_violations``, ``refused``.

    Raises:
        UserError: the node did not start or did not answer.
    """
    domain = private_domain()
    parameters = {"fiber_file": fibre, "mode": "realtime", "rate_hz": float(rate_hz)}
    with NodeProcess(domain, parameters) as child, Link("timing", domain_id=domain) as link:
        reports: list[dict[str, str]] = []
        diagnostics = link.node.create_subscription(
            DiagnosticArray, "/diagnostics", lambda message: reports.extend(_reports(message, link.peer)), 10
        )
        try:
            link.find(_START_S, "see the log")
        except UserError as error:
            raise UserError(f"the node to be measured did not start: {child.log() or error}") from error
        feeder = _Feeder(link.node)
        try:
            feeder.start()
            if not link.wait_for(lambda: bool(reports) and float(reports[-1]["rate (Hz)"]) > 0.0, _START_S):
                raise UserError(f"the node to be measured does not step: {child.log()}")
            link.reset()
            reports.clear()
            begin = time.monotonic()
            link.wait_for(lambda: time.monotonic() - begin >= duration_s + 1.0, duration_s + 10.0)
        finally:
            feeder.stop()
            link.node.destroy_subscription(diagnostics)
    if len(reports) < 2:
        raise UserError(f"only {len(reports)} reports came from the node to be measured; measure for 3 s at least")
    measured = {key: float(reports[-1][name]) for name, key in _KEYS.items()}
    # The first report reaches back before the reset.
    later = reports[1:]
    measured["rate_hz"] = sum(float(report["rate (Hz)"]) for report in later) / len(later)
    measured["cpu_share"] = sum(float(report["CPU (share of one core)"]) for report in later) / len(later)
    return measured


def _reports(message: Any, node: str) -> list[dict[str, str]]:
    own = [status for status in message.status if f"/{status.name}" == node]
    return [{pair.key: pair.value for pair in status.values} for status in own]


class _Feeder:
    """Publishes a length sine of 1 % of L0 at 1 Hz, and a calcium that moves up and down."""

    def __init__(self, node: Any) -> None:
        self._length = node.create_publisher(JointState, "muscle/length", 10)
        self._calcium = node.create_publisher(JointState, "muscle/calcium", 10)
        self._clock = node.get_clock()
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="feeder", daemon=True)

    def start(self) -> None:
        """Start to publish."""
        self._thread.start()

    def stop(self) -> None:
        """End, and wait for it."""
        self._stop.set()
        self._thread.join()

    def _run(self) -> None:
        wait = make_waiter()
        period = round(1e9 / _INPUT_HZ)
        message = JointState()
        position = room(message, "position", 1)
        begin = deadline = time.monotonic_ns()
        count = 0
        while not self._stop.is_set():
            seconds = (deadline - begin) * 1e-9
            message.header.stamp = self._clock.now().to_msg()
            if count % 50 == 0:
                position[0] = 3.0 + 2.5 * math.sin(2.0 * math.pi * 0.3 * seconds)
                self._calcium.publish(message)
            position[0] = 1.0 + 0.01 * math.sin(2.0 * math.pi * seconds)
            self._length.publish(message)
            count += 1
            deadline += period
            wait(deadline)
