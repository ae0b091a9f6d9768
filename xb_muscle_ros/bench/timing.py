"""How well a node keeps time on this machine: lateness of its ticks."""

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
from xb_muscle_ros.node.client.wires import Sender
from xb_muscle_ros.node.ticker import make_waiter

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
    parameters = {**parameters_of(fibre, fibres, "realtime", rate_hz), **settings}
    with NodeProcess(domain, parameters) as child, Link("timing", domain_id=domain) as link:
        return _measure([Measured(link, child)], duration_s, names(fibres))[0]


def run_beside_plain_timer(
    duration_s: float, rate_hz: float, fibre: str = "18Dec2017a", settings: Mapping[str, object] = {}
) -> tuple[dict[str, float], dict[str, float]]:
    """As `run_timing`, with a node at the same time that steps the same fibre in a timer of rclpy's default executor.

    Returns figures of ours and of that node; both hear the same messages.
    """
    domain = private_domain()
    parameters = {**parameters_of(fibre, 1, "realtime", rate_hz), **settings}
    plain = {"fiber_file": fibre, "rate_hz": float(rate_hz)}
    with (
        NodeProcess(domain, parameters) as ours,
        NodeProcess(domain, plain, ["-r", "__ns:=/plain"], module=PLAIN) as theirs,
        Link("timing", domain_id=domain) as near,
        Link("timing", "/plain", domain) as far,
    ):
        first, second = _measure([Measured(near, ours), Measured(far, theirs)], duration_s, names(1))
    return first, second


def names(fibres: int) -> list[str]:
    """Names of measured fibres; one alone goes without."""
    return [] if fibres == 1 else [f"fibre_{i}" for i in range(fibres)]


def parameters_of(fibre: str, fibres: int, mode: str, rate_hz: float) -> dict[str, object]:
    """Parameters of a node to be measured."""
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
