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

    def __init__(self, node: Any, mode: str, driven_by: str = "length") -> None:
        """Report for a node of rclpy in a mode, which is sent lengths or loads."""
        self._driven_by = driven_by
        self._node = node
        self._mode = mode
        self._publisher = node.create_publisher(DiagnosticArray, "/diagnostics", 10)
        self._watched: tuple[Sequence[Fibre], Stepping, Inlet, OutputMessages, Mapping[str, Arrivals]] | None = None
        self._last_s = time.monotonic()
        # What only grows, as it was at the last report.
        self._totals: dict[str, float] = {"cpu_s": time.process_time()}

    def watch(
        self,
        fibres: Sequence[Fibre],
        stepping: Stepping,
        inlet: Inlet,
        outlet: OutputMessages,
        arrivals: Mapping[str, Arrivals] = {},
    ) -> None:
        """Report on these from now on; `arrivals` by topic."""
        self._watched = fibres, stepping, inlet, outlet, arrivals

    def forget(self) -> None:
        """There is nothing to report on but the node itself."""
        self._watched = None

    def report(self, state: str, now_s: float, timeout_s: float) -> None:
        """Publish once; `now_s` is steady time, `timeout_s` the allowed age of the newest length sample, 0 for any."""
        name = self._node.get_fully_qualified_name()
        report = Report(name, self._mode, state, timeout_s=timeout_s, now_s=now_s, driven_by=self._driven_by)
        totals: dict[str, float] = {"cpu_s": time.process_time()}
        if self._watched is not None:
            fibres, stepping, inlet, outlet, arrivals = self._watched
            report.fibre = enumerated([fibre.name for fibre in fibres])
            report.fibres, report.model = len(fibres), fibres[0].model
            status = report.status = stepping.status()
            totals |= {name: getattr(status, name) for name in ("ticks", "overruns", "timeouts")}
            report.refused, report.odd, report.refusing = inlet.refused, stepping.counts, inlet.refusing
            report.ignored_names = inlet.ignored_names
            report.input_age_s = None if inlet.last_length_s is None else now_s - inlet.last_length_s
            report.pushed, outlet.pushed = outlet.pushed, None
            report.lost = {topic: each.told() for topic, each in arrivals.items()}
            totals |= {topic: each.lost for topic, each in arrivals.items()}
        new = {name: max(total - self._totals.get(name, 0), 0) for name, total in totals.items()}
        elapsed = max(now_s - self._last_s, 1e-6)
        self._last_s, self._totals = now_s, totals
        report.rate_hz, report.cpu_share = new.get("ticks", 0) / elapsed, new["cpu_s"] / elapsed
        report.overruns_new, report.timeouts_new = (int(new.get(name, 0)) for name in ("overruns", "timeouts"))
        report.lost_new = {topic: int(new[topic]) for topic in report.lost}
        message = diagnostics(report)
        message.header.stamp = self._node.get_clock().now().to_msg()
        self._publisher.publish(message)
