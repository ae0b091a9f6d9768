"""Millions of lockstep ticks with random stretches and calcium: whether force stays balanced, and memory flat."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.bench.balance import Balance
from xb_muscle_ros.bench.measure import Figure, Setting
from xb_muscle_ros.bench.random_stretches import Stretches, random_stretches
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.batch import MuscleBatch
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.node.client.live import play_live
from xb_muscle_ros.node.client.process import NodeProcess, private_domain
from xb_muscle_ros.node.inlet import Inlet
from xb_muscle_ros.node.joint_state import Joints
from xb_muscle_ros.node.lockstep import Lockstep
from xb_muscle_ros.node.outputs import OutputMessages
from xb_muscle_ros.progress import Progress
from xb_muscle_ros.trials.trial import Trial, TrialFacts

Array = npt.NDArray[np.float64]


class Soak(NamedTuple):
    """What a soak showed.

    Attributes:
        ticks: answered.
        worst_balance_f0: largest difference between the heads' force and the series spring's, F0.
        least_force_f0, most_force_f0: of the fibre.
        rss_begin_mb, rss_end_mb: resident memory after a tenth of the ticks and at the end; NaN where nobody knows.
    """

    ticks: int
    worst_balance_f0: float
    least_force_f0: float
    most_force_f0: float
    rss_begin_mb: float
    rss_end_mb: float


def soak(fibre: Fibre, ticks: int, seed: int = 1) -> Soak:
    """Drive a node's lockstep through its message callbacks, in this process and without DDS.

    Every tick is a JointState read by the inlet, stepped, and answered with two more.

    Args:
        fibre: with its parameters.
        ticks: how many.
        seed: of the random input.

    Raises:
        UserError: a sample was refused or integration failed.
    """
    forces: list[tuple[float, float]] = []
    moments: list[tuple[float, ...]] = []
    outlet = OutputMessages(
        [fibre.name],
        _publisher(lambda message: forces.append((message.effort[0], message.position[0]))),
        _publisher(lambda message: moments.append(tuple(message.position))),
    )
    said: list[str] = []
    log = SimpleNamespace(error=said.append, warning=said.append, info=said.append)
    inlet = Inlet([fibre.name], Lockstep(MuscleBatch([fibre]), outlet.publish, log, lambda: False), log)
    inlet.open = True
    balance = Balance(fibre)
    message = _Message(fibre.name)
    worst, least, most, done, last = 0.0, np.inf, -np.inf, 0, 0
    rss: list[float] = []
    with Progress(ticks, "soak") as progress:
        for part in random_stretches(ticks, seed):
            forces.clear()
            moments.clear()
            calcium = dict(zip(part.calcium_before.tolist(), part.calcium_um.tolist(), strict=True))
            metres = (1.0 + part.length_l0) * fibre.reference_length_m
            for k, (stamp, metre) in enumerate(zip(part.stamps_ns.tolist(), metres.tolist(), strict=True)):
                if k in calcium:
                    inlet.take_calcium(message.filled(last, calcium[k]))
                inlet.take_length(message.filled(stamp, metre))
                last = stamp
            count = len(part.stamps_ns)
            done += count
            if said or len(forces) != count:
                raise UserError(f"soak: {count - len(forces)} samples unanswered: {said[:1]}")
            effort, ce_m = np.array(forces).T
            q0, q1 = np.array(moments)[:, :2].T
            worst = max(worst, _imbalance_f0(balance, fibre, q0, q1, metres, ce_m))
            if not np.isfinite(worst):
                raise UserError(f"soak: force balance is not a number within the ticks up to {done}")
            least, most = min(least, float(effort.min())), max(most, float(effort.max()))
            rss.append(_rss_mb())
            progress.update(count)
    return Soak(done, worst, least / fibre.f0_n, most / fibre.f0_n, rss[len(rss) // 10], rss[-1])


def _imbalance_f0(balance: Balance, fibre: Fibre, q0: Array, q1: Array, length_m: Array, ce_length_m: Array) -> float:
    """Largest difference between the heads' force and the spring's, F0."""
    length, ce_length = (metres / fibre.reference_length_m - 1.0 for metres in (length_m, ce_length_m))
    return float(np.max(np.abs(balance.error_f0(q0, q1, length, ce_length))))


def soak_over_dds(fibre: Fibre, ticks: int, seed: int = 2) -> tuple[float, float]:
    """The same against a node in a process of its own; largest imbalance (F0) and ticks per second.

    Args:
        fibre: with a file of its own.
        ticks: how many.
        seed: of the random input.

    Raises:
        UserError: the node does not start or answer.
    """
    worst, seconds = 0.0, 0.0
    balance = Balance(fibre)
    domain = private_domain()
    settings = {"fiber_file": fibre.path, "model": fibre.model, "mode": "lockstep"}
    with NodeProcess(domain, settings), Progress(ticks, "soak over DDS") as progress:
        for part in random_stretches(ticks, seed):
            trial = _trial(part, fibre)
            begin = time.monotonic()
            (answer,) = play_live([trial], fibre, find_s=60.0, domain_id=domain)
            seconds += time.monotonic() - begin
            q0, q1 = answer.moments["q0"], answer.moments["q1"]
            worst = max(worst, _imbalance_f0(balance, fibre, q0, q1, trial.length_m, answer.ce_length_m))
            progress.update(trial.time_s.size)
    return worst, ticks / seconds


def study(setting: Setting) -> list[Figure]:
    """All figures of a soak; a hundredth of the ticks goes over DDS."""
    found = soak(setting.fibre, setting.ticks)
    over_dds = max(setting.ticks // 100, 1000)
    worst, rate = soak_over_dds(setting.fibre, over_dds)
    name, of_dds = f"soak, {found.ticks} lockstep ticks", f"soak over DDS, {over_dds} ticks"
    begin_mb, grown_mb = found.rss_begin_mb, found.rss_end_mb - found.rss_begin_mb
    rows = [
        (f"{name}, force balance", found.worst_balance_f0, "F0", "largest error; bar 1e-9"),
        (f"{name}, force from", found.least_force_f0, "F0", f"to {found.most_force_f0:.3g} F0"),
        (f"{name}, memory", grown_mb, "MB", f"more than {begin_mb:.0f} MB after a tenth"),
        (f"{of_dds}, force balance", worst, "F0", "largest error; bar 1e-9"),
        (f"{of_dds}, rate", rate, "Hz", "20 messages under way at once"),
    ]
    # Memory is not known everywhere.
    return [Figure(*row) for row in rows if np.isfinite(row[1])]


def _trial(part: Stretches, fibre: Fibre) -> Trial:
    stamps = part.stamps_ns
    at = np.where(part.calcium_before > 0, stamps[part.calcium_before - 1], stamps[0] - 1)
    return Trial(
        TrialFacts(fibre.name, "soak", reference_length_m=fibre.reference_length_m, f0_n=fibre.f0_n),
        stamps * 1e-9,
        (1.0 + part.length_l0) * fibre.reference_length_m,
        at * 1e-9,
        part.calcium_um,
    )


def _rss_mb() -> float:
    """Resident memory of this process."""
    try:
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    except OSError:
        return float("nan")
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def _publisher(keep: Callable[[Any], None]) -> Any:
    """In the place of a publisher to which someone listens: keeps what messages say, for they are used again."""
    return SimpleNamespace(publish=keep, get_subscription_count=lambda: 1)


class _Message:
    """What messages as they come out of DDS say."""

    def __init__(self, fibre: str) -> None:
        self._names = (fibre,)
        self._none = np.empty(0)

    def filled(self, stamp_ns: int, value: float) -> Joints:
        """With a stamp (ns), and calcium (µM) or length (m)."""
        return Joints(stamp_ns, self._names, np.array([value]), self._none, self._none)
