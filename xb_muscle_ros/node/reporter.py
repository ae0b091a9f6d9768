"""Gathers the node's account and publishes it."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray

from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.node.arrivals import Arrivals
from xb_muscle_ros.node.diagnostics import Report, diagnostics
from xb_muscle_ros.node.inlet import Inlet
from xb_muscle_ros.node.names import enumerated
from xb_muscle_ros.node.outputs import OutputMessages
from xb_muscle_ros.node.stepping import Stepping


class Reporter:
    """Publishes ``/diagnostics``; rates are those since the last report."""

    def __init__(self, node: Any, mode: str) -> None:
        self._node = node
        self._publisher = node.create_publisher(DiagnosticArray, "/diagnostics", 10)
        self._mode = mode
        self._report = Report(node.get_fully_qualified_name(), mode, "unconfigured")
        self._stepping: Stepping | None = None
        self._inlet: Inlet | None = None
        self._outlet: OutputMessages | None = None
        self._arrivals: Mapping[str, Arrivals] = {}
        self._lost: dict[str, int] = {}
        self._last = (time.monotonic(), time.process_time(), 0, 0, 0)

    def watch(
        self,
        fibres: Sequence[Fibre],
        stepping: Stepping,
        inlet: Inlet,
        outlet: OutputMessages,
        arrivals: Mapping[str, Arrivals] = {},
    ) -> None:
        """Report on these from now on; `arrivals` by topic."""
        self._arrivals = arrivals
        self._report.fibre = enumerated([fibre.name for fibre in fibres])
        self._report.fibres, self._report.model = len(fibres), fibres[0].model
        self._stepping, self._inlet, self._outlet = stepping, inlet, outlet
        self._report.refused, self._report.odd = inlet.refused, stepping.counts

    def forget(self) -> None:
        """There is nothing to report on but the node itself."""
        self._stepping = self._inlet = self._outlet = None
        self._arrivals = {}
        self._report = Report(self._report.node, self._mode, "unconfigured")

    def report(self, state: str, now_s: float, timeout_s: float) -> None:
        """Publish once; `now_s` is steady time, `timeout_s` the allowed age of the newest length sample, 0 for any."""
        report = self._report
        report.state = state
        report.status = self._stepping.status() if self._stepping is not None else None
        ticks = report.status.ticks if report.status else 0
        overruns = report.status.overruns if report.status else 0
        timeouts = report.status.timeouts if report.status else 0
        then, cpu_then, ticks_then, overruns_then, timeouts_then = self._last
        cpu = time.process_time()
        self._last = (now_s, cpu, ticks, overruns, timeouts)
        elapsed = max(now_s - then, 1e-6)
        report.rate_hz = max(ticks - ticks_then, 0) / elapsed
        report.cpu_share = (cpu - cpu_then) / elapsed
        report.overruns_new = max(overruns - overruns_then, 0)
        report.timeouts_new = max(timeouts - timeouts_then, 0)
        report.timeout_s = timeout_s
        if self._inlet is not None:
            report.ignored_names = self._inlet.ignored_names
            last = self._inlet.last_length_s
            report.input_age_s = None if last is None else now_s - last
            report.refusing = self._inlet.refusing
        if self._outlet is not None:
            report.pushed, self._outlet.pushed = self._outlet.pushed, None
        report.now_s = now_s
        report.lost = {topic: arrivals.told() for topic, arrivals in self._arrivals.items()}
        lost = {topic: arrivals.lost for topic, arrivals in self._arrivals.items()}
        report.lost_new = {topic: max(count - self._lost.get(topic, 0), 0) for topic, count in lost.items()}
        self._lost = lost
        message = diagnostics(report)
        message.header.stamp = self._node.get_clock().now().to_msg()
        self._publisher.publish(message)
