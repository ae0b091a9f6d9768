"""A node that is measured, by what it says of itself."""

# mypy: allow-untyped-calls

from __future__ import annotations

import time
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.node.client.link import Link
from xb_muscle_ros.node.client.process import NodeProcess
from xb_muscle_ros.node.diagnostics import status_name

START_S = 60.0
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


class Measured:
    """A node and what it says of itself."""

    def __init__(self, link: Link, child: NodeProcess) -> None:
        self.link = link
        self.child = child
        self.reports: list[dict[str, str]] = []
        self.stamped_s: list[float] = []
        self.begun_s = 0.0
        self._diagnostics = link.node.create_subscription(DiagnosticArray, "/diagnostics", self._on_diagnostics, 10)

    def find(self) -> None:
        """Wait for the node.

        Raises:
            UserError: it does not come.
        """
        try:
            self.link.find(START_S, "see the log")
        except UserError as error:
            raise UserError(f"the node to be measured did not start: {self.child.log() or error}") from error

    def begin(self) -> None:
        """Reset the node; its figures count from here."""
        self.link.reset()
        self.begun_s = time.time()
        self.reports.clear()
        self.stamped_s.clear()

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for report in _reports(message, self.link.peer):
            self.reports.append(report)
            # When it was made: it may wait for a while until it is looked at here.
            self.stamped_s.append(message.header.stamp.sec + message.header.stamp.nanosec * 1e-9)

    def stepping(self) -> bool:
        """Whether it has reported steps."""
        return bool(self.reports) and float(self.reports[-1]["rate (Hz)"]) > 0.0

    def close(self) -> None:
        """Listen no more."""
        self.link.node.destroy_subscription(self._diagnostics)

    def figures(self) -> dict[str, float]:
        """Of the time since reports were cleared.

        Raises:
            UserError: too few reports came.
        """
        if len(self.reports) < 2:
            raise UserError(
                f"only {len(self.reports)} reports came from the node to be measured; measure for 3 s at least"
            )
        measured = {key: float(self.reports[-1][name]) for name, key in _KEYS.items()}
        # The first report reaches back before the reset.
        later = self.reports[1:]
        measured["seconds"] = self.stamped_s[-1] - self.begun_s
        measured["rate_hz"] = sum(float(report["rate (Hz)"]) for report in later) / len(later)
        measured["cpu_share"] = sum(float(report["CPU (share of one core)"]) for report in later) / len(later)
        return measured


def _reports(message: Any, node: str) -> list[dict[str, str]]:
    own = [status for status in message.status if status.name == status_name(node)]
    return [{pair.key: pair.value for pair in status.values} for status in own]
