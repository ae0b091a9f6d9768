"""How well a node keeps time on this machine: lateness of ticks, and the way from length to force and back."""

# mypy: allow-untyped-calls

from __future__ import annotations

import math
import os
import threading
import time
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from xb_muscle_ros.bench.measured import START_S, Measured
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.node.client.link import Link
from xb_muscle_ros.node.client.process import NodeProcess, private_domain
from xb_muscle_ros.node.client.wires import Sender, reliable
from xb_muscle_ros.node.joint_state import Joints
from xb_muscle_ros.node.ticker import make_waiter
from xb_muscle_ros.node.traffic import subscribe

_INPUT_HZ = 500.0
PLAIN = "xb_muscle_ros.bench.plain_timer"
"""Module of the node with an executor's timer that ours is held against."""


def run_timing(
    duration_s: float, rate_hz: float, fibre: str = "18Dec2017a", fibres: int = 1, settings: Mapping[str, object] = {}
) -> dict[str, float]:
    """Measure a realtime node in its own process, fed with length at 500 Hz and with calcium.

    Args:
        duration_s: time measured, s; statistics start anew once the node is stepping.
        rate_hz: of the node.
        fibre: packaged fibre or file.
        fibres: how many the node has, all of the same file.
        settings: further parameters of the node.

    Returns:
        ``lateness_p50_us``, ``_p99_us``, ``_p99.9_us``, ``_max_us``, ``overruns``, ``dropped_ticks``, ``ticks``,
        ``rate_hz`` (ticks per second reached), ``cpu_share`` (of one core, mean), ``state_violations``, ``refused``,
        ``load`` (processes that ran or waited to, mean of the system's one-minute average).

    Raises:
        UserError: the node did not start or did not answer.
    """
    domain = private_domain()
    parameters = {**_parameters(fibre, fibres, "realtime", rate_hz), **settings}
    with NodeProcess(domain, parameters) as child, Link("timing", domain_id=domain) as link:
        return _measure([Measured(link, child)], duration_s, names(fibres))[0]


def run_beside_plain_timer(
    duration_s: float, rate_hz: float, fibre: str = "18Dec2017a", settings: Mapping[str, object] = {}
) -> tuple[dict[str, float], dict[str, float]]:
    """As `run_timing`, with a node at the same time that steps the same fibre in a timer of rclpy's default executor.

    Returns figures of ours and of that node; both hear the same messages.
    """
    domain = private_domain()
    parameters = {**_parameters(fibre, 1, "realtime", rate_hz), **settings}
    plain = {"fiber_file": fibre, "rate_hz": float(rate_hz)}
    with (
        NodeProcess(domain, parameters) as ours,
        NodeProcess(domain, plain, ["-r", "__ns:=/plain"], module=PLAIN) as theirs,
        Link("timing", domain_id=domain) as near,
        Link("timing", "/plain", domain) as far,
    ):
        first, second = _measure([Measured(near, ours), Measured(far, theirs)], duration_s, names(1))
    return first, second


def run_roundtrip(duration_s: float, rate_hz: float, fibre: str = "18Dec2017a", fibres: int = 1) -> dict[str, float]:
    """Measure the way from a length message to its force and back, with a node in lockstep and one message at a time.

    Args:
        duration_s: time measured, s.
        rate_hz: length messages per second, at absolute deadlines; one whose predecessor is not answered yet waits.
        fibre: packaged fibre or file.
        fibres: how many the node has, all in each message.

    Returns:
        ``p50_us``, ``p99_us``, ``p99.9_us``, ``max_us``; ``first_us``, ``last_us``: medians of first and last quarter;
        ``behind``: messages sent after the deadline of the next; ``rate_hz`` reached; ``cpu_share`` of the
        node; ``load`` as in `run_timing`.

    Raises:
        UserError: the node did not start, or left a message unanswered for 10 s.
    """
    domain = private_domain()
    with (
        NodeProcess(domain, _parameters(fibre, fibres, "lockstep", rate_hz)) as child,
        Link("timing", domain_id=domain) as link,
    ):
        measured = Measured(link, child)
        pinger = _Pinger(link, names(fibres))
        measured.find()
        pinger.meet()
        loads = [os.getloadavg()[0]]
        measured.reports.clear()
        result = pinger.run(duration_s, rate_hz)
        loads.append(os.getloadavg()[0])
        shares = [float(report["CPU (share of one core)"]) for report in measured.reports[1:]]
        measured.close()
    return {**result, "cpu_share": float(np.mean(shares)), "load": float(np.mean(loads))}


def names(fibres: int) -> list[str]:
    """Names of measured fibres; one alone goes without."""
    return [] if fibres == 1 else [f"fibre_{i}" for i in range(fibres)]


def _parameters(fibre: str, fibres: int, mode: str, rate_hz: float) -> dict[str, object]:
    given: dict[str, object] = {"fiber_file": fibre, "mode": mode, "rate_hz": float(rate_hz)}
    if fibres > 1:
        given["fibers"] = f"[{', '.join(names(fibres))}]"
    return given


def _measure(nodes: Sequence[Measured], duration_s: float, fibres: Sequence[str]) -> list[dict[str, float]]:
    """Feed nodes and read their figures."""
    for node in nodes:
        node.find()
    feeders = [_Feeder(node.link.node, fibres) for node in nodes]
    loads: list[float] = []
    try:
        for feeder in feeders:
            feeder.start()
        for node in nodes:
            if not node.link.wait_for(node.stepping, START_S):
                raise UserError(f"the node to be measured does not step: {node.child.log()}")
        for node in nodes:
            node.begin()
        end = time.monotonic() + duration_s + 1.0
        while (rest := end - time.monotonic()) > 0.0:
            for node in nodes:
                node.link.wait_for(lambda: False, min(0.25, rest))
            loads.append(os.getloadavg()[0])
    finally:
        for feeder in feeders:
            feeder.stop()
        for node in nodes:
            node.close()
    return [{**node.figures(), "load": float(np.mean(loads))} for node in nodes]


class _Pinger:
    """Sends a length, waits for its force."""

    def __init__(self, link: Link, fibres: Sequence[str]) -> None:
        self._link = link
        node = link.node
        self._length, self._calcium = (Sender(node, f"muscle/{topic}", fibres) for topic in ("length", "calcium"))
        self._inlet = subscribe(node, "muscle/force", self._on_force, reliable())
        self._count = max(len(fibres), 1)
        self._answered = (-1, 0)

    def meet(self) -> None:
        """Until an answer finds its way.

        Raises:
            UserError: none does.
        """

        def send() -> None:
            self._calcium.send(0, 5.0)
            self._length.send(0, 1.0)

        if not self._link.begin(send, lambda: self._answered[0] == 0, START_S, 1.0):
            raise UserError(f"node {self._link.peer} does not answer length; see its log")

    def run(self, duration_s: float, rate_hz: float) -> dict[str, float]:
        """Measure."""
        wait = make_waiter()
        period = round(1e9 / rate_hz)
        count = round(duration_s * rate_hz)
        took = np.zeros(count)
        behind = 0
        begin = deadline = time.monotonic_ns()
        for k in range(count):
            deadline += period
            wait(deadline)
            behind += time.monotonic_ns() - deadline > period
            stamp = (k + 1) * period
            value = 1.0 + 0.01 * math.sin(2.0 * math.pi * k / rate_hz)
            if k % 50 == 0:
                self._calcium.send(stamp - period // 2, 3.0 + 2.5 * math.sin(k))
            sent = time.monotonic_ns()
            self._length.send(stamp, value)
            if not self._link.wait_for(lambda stamp=stamp: self._answered[0] == stamp, 10.0):  # type: ignore[misc]
                raise UserError(f"node {self._link.peer} left the message at {stamp * 1e-9:g} s unanswered")
            took[k] = (self._answered[1] - sent) * 1e-3
        seconds = (time.monotonic_ns() - begin) * 1e-9
        p50, p99, p999 = np.percentile(took, [50, 99, 99.9]).tolist()
        quarter = max(count // 4, 1)
        return {
            "p50_us": p50,
            "p99_us": p99,
            "p99.9_us": p999,
            "max_us": float(took.max()),
            "first_us": float(np.median(took[:quarter])),
            "last_us": float(np.median(took[-quarter:])),
            "behind": float(behind),
            "rate_hz": count / seconds,
        }

    def _on_force(self, message: Joints) -> None:
        if message.effort.size == self._count:
            self._answered = (message.stamp_ns, time.monotonic_ns())


class _Feeder:
    """Publishes a length sine of 1 % of L0 at 1 Hz, and a calcium that moves up and down."""

    def __init__(self, node: Any, fibres: Sequence[str]) -> None:
        self._length, self._calcium = (Sender(node, f"muscle/{topic}", fibres, 10) for topic in ("length", "calcium"))
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
        begin = deadline = time.monotonic_ns()
        count = 0
        while not self._stop.is_set():
            seconds = (deadline - begin) * 1e-9
            stamp = int(self._clock.now().nanoseconds)
            if count % 50 == 0:
                self._calcium.send(stamp, 3.0 + 2.5 * math.sin(2.0 * math.pi * 0.3 * seconds))
            self._length.send(stamp, 1.0 + 0.01 * math.sin(2.0 * math.pi * seconds))
            count += 1
            deadline += period
            wait(deadline)
