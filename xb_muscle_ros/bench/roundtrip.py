"""The way from length to force and back through a node in lockstep, and whether its forces are right to the bit."""

# mypy: allow-untyped-calls

from __future__ import annotations

import os
import time
from dataclasses import replace

import numpy as np

from xb_muscle_ros.bench.measured import START_S, Measured
from xb_muscle_ros.bench.timing import names, parameters_of
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.batch import MuscleBatch
from xb_muscle_ros.models.fibre_file import Fibre, load_fibre
from xb_muscle_ros.models.muscle import Array
from xb_muscle_ros.node.client.link import Link
from xb_muscle_ros.node.client.process import NodeProcess, private_domain
from xb_muscle_ros.node.client.wires import Sender, reliable
from xb_muscle_ros.node.joint_state import Joints
from xb_muscle_ros.node.ticker import make_waiter
from xb_muscle_ros.node.traffic import subscribe

# Of stamps, where messages follow each other as fast as answers come.
_TICK_S = 1e-3


def run_roundtrip(
    duration_s: float,
    rate_hz: float | None,
    fibre: str = "18Dec2017a",
    fibres: int = 1,
    calcium_every: int = 50,
) -> dict[str, float]:
    """Measure the way from a length message to its force and back, with a node in lockstep and one message at a time.

    Args:
        duration_s: time measured, s.
        rate_hz: length messages per second, at absolute deadlines; one whose predecessor is not answered yet waits.
            None: each is sent when its predecessor is answered, with a stamp 1 ms after that one's.
        fibre: packaged fibre or file.
        fibres: how many the node has, all in each message, each with lengths and calcium of its own.
        calcium_every: length messages from one message of calcium to the next.

    Returns:
        ``p50_us``, ``p99_us``, ``p99.9_us``, ``max_us``; ``first_us``, ``last_us``: medians of first and last quarter;
        ``behind``: messages sent after the deadline of the next; ``rate_hz`` reached; ``unequal``: forces of ``forces``
        that are not those of `MuscleBatch` for the same lengths in m, bit for bit; ``cpu_share`` of the node; ``load``
        as in `bench.timing.run_timing`.

    Raises:
        UserError: the node did not start, or left a message unanswered for 10 s.
    """
    domain = private_domain()
    with (
        NodeProcess(domain, parameters_of(fibre, fibres, "lockstep", rate_hz or 1.0 / _TICK_S)) as child,
        Link("timing", domain_id=domain) as link,
    ):
        measured = Measured(link, child)
        pinger = _Pinger(link, load_fibre(fibre), fibres, calcium_every)
        measured.find()
        pinger.meet()
        loads = [os.getloadavg()[0]]
        measured.reports.clear()
        result = pinger.run(duration_s, rate_hz)
        loads.append(os.getloadavg()[0])
        shares = [float(report["CPU (share of one core)"]) for report in measured.reports[1:]]
        measured.close()
    right = pinger.without_ros()
    differ = {"forces": float(right.size), "unequal": float(np.count_nonzero(pinger.forces_n != right))}
    return {**result, **differ, "cpu_share": float(np.mean(shares)), "load": float(np.mean(loads))}


class _Pinger:
    """Sends length and waits for the force of the same stamp.

    Attributes:
        forces_n: of every sample after the first, shape (sample, fibre), N.
    """

    def __init__(self, link: Link, fibre: Fibre, fibres: int, calcium_every: int) -> None:
        self._link = link
        self._fibre = fibre
        self._calcium_every = calcium_every
        self._phases = np.linspace(0.0, 3.0, fibres)
        node, named = link.node, names(fibres)
        self._length, self._calcium = (Sender(node, f"muscle/{topic}", named) for topic in ("length", "calcium"))
        self._inlet = subscribe(node, "muscle/force", self._on_force, reliable())
        self._answered = (-1, 0)
        self._newest = self._phases
        self.forces_n = np.empty((0, fibres))

    def meet(self) -> None:
        """Until an answer finds its way.

        Raises:
            UserError: none does.
        """

        def send() -> None:
            self._calcium.send(0, self._calcium_um(-1))
            self._length.send(0, self._metres(-1, 1.0))

        if not self._link.begin(send, lambda: self._answered[0] == 0, START_S, 1.0):
            raise UserError(f"node {self._link.peer} does not answer length; see its log")

    def run(self, duration_s: float, rate_hz: float | None) -> dict[str, float]:
        """Measure."""
        wait = make_waiter()
        self._period = period = round(1e9 * _TICK_S if rate_hz is None else 1e9 / rate_hz)
        forces: list[Array] = []
        took: list[float] = []
        behind = 0
        begin = deadline = time.monotonic_ns()
        end = begin + round(duration_s * 1e9)
        while deadline < end:
            k = len(took)
            if rate_hz is None:
                deadline = time.monotonic_ns()
            else:
                deadline += period
                wait(deadline)
                behind += time.monotonic_ns() - deadline > period
            stamp = (k + 1) * period
            metres = self._metres(k, 1e-9 * period)
            if k % self._calcium_every == 0:
                self._calcium.send(stamp - period // 2, self._calcium_um(k))
            sent = time.monotonic_ns()
            self._length.send(stamp, metres)
            # mypy takes the default, which binds the stamp of this turn, for an argument of the call.
            if not self._link.wait_for(lambda stamp=stamp: self._answered[0] == stamp, 10.0):  # type: ignore[misc]
                raise UserError(f"node {self._link.peer} left the message at {stamp * 1e-9:g} s unanswered")
            took.append((self._answered[1] - sent) * 1e-3)
            forces.append(self._newest)
        seconds = (time.monotonic_ns() - begin) * 1e-9
        self.forces_n = np.array(forces)
        p50, p99, p999 = np.percentile(took, [50, 99, 99.9]).tolist()
        quarter = max(len(took) // 4, 1)
        return {
            "p50_us": p50,
            "p99_us": p99,
            "p99.9_us": p999,
            "max_us": max(took),
            "first_us": float(np.median(took[:quarter])),
            "last_us": float(np.median(took[-quarter:])),
            "behind": float(behind),
            "rate_hz": len(took) / seconds,
        }

    def without_ros(self) -> Array:
        """Forces (N) of the samples in this process, shape (sample, fibre)."""
        count, fibre = self._phases.size, self._fibre
        batch = MuscleBatch([replace(fibre, name=f"fibre_{i}") for i in range(count)])
        made = np.empty_like(self.forces_n)
        calcium = self._calcium_um(-1)
        states = batch.settle(self._metres(-1, 1.0) / fibre.reference_length_m - 1.0, calcium)
        for k in range(len(made)):
            change = self._metres(k, 1e-9 * self._period) / fibre.reference_length_m - 1.0
            states = batch.step(states, change, calcium, self._period / 1e9)
            made[k] = fibre.f0_n * batch.outputs(states)["force_f0"]
            if k % self._calcium_every == 0:
                # Its stamp lies within this step, so that it acts from the next one on.
                calcium = self._calcium_um(k)
        return made

    def _metres(self, k: int, period_s: float) -> Array:
        """Lengths of the k-th sample after the first, shape (fibre,), m."""
        turns = 2.0 * np.pi * (k + 1) * period_s + self._phases
        lengths: Array = self._fibre.reference_length_m * (1.0 + 0.01 * np.sin(turns if k >= 0 else self._phases))
        return lengths

    def _calcium_um(self, k: int) -> Array:
        """Calcium sent with the k-th sample, shape (fibre,), µM."""
        values: Array = 3.0 + 2.5 * np.sin(k + self._phases)
        return values

    def _on_force(self, message: Joints) -> None:
        if message.effort.size == self._phases.size:
            self._newest = message.effort
            self._answered = (message.stamp_ns, time.monotonic_ns())
