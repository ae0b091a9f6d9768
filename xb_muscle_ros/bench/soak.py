"""Millions of lockstep ticks with random stretches and calcium: whether force stays balanced, and memory flat."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.bench.measure import Figure
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.progress import Progress
from xb_muscle_ros.trials.trial import Trial, TrialFacts

Array = npt.NDArray[np.float64]

CHUNK = 50_000
_LENGTH_L0 = (-0.06, 0.06)
_SPEED_L0_PER_S = (0.01, 20.0)
_PCA = (4.5, 8.0)
_STEP_S = (2e-4, 5e-3)


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


class Stretches(NamedTuple):
    """Input of some ticks: stamps (ns), lengths (L0), and calcium (µM) with the index of the tick it comes before."""

    stamps_ns: npt.NDArray[np.int64]
    length_l0: Array
    calcium_before: npt.NDArray[np.intp]
    calcium_um: Array


def random_stretches(ticks: int, seed: int) -> Iterator[Stretches]:
    """Ramps to random lengths at random speeds, holds, uneven stamps, calcium that jumps every 50 ticks or so.

    Args:
        ticks: in all; they come in chunks of `CHUNK`.
        seed: of the random numbers.
    """
    rng = np.random.default_rng(seed)
    begin_ns, length = 0, 0.0
    for first in range(0, ticks, CHUNK):
        count = min(CHUNK, ticks - first)
        dt_ns = _log_uniform(rng, _STEP_S, count) * 1e9
        stamps = begin_ns + np.cumsum(np.maximum(dt_ns.astype(np.int64), 1))
        lengths = np.empty(count)
        k = 0
        while k < count:
            run = min(int(rng.integers(1, 60)), count - k)
            seconds = (stamps[k : k + run] - (stamps[k - 1] if k else begin_ns)) * 1e-9
            target = rng.uniform(*_LENGTH_L0)
            speed = float(_log_uniform(rng, _SPEED_L0_PER_S, 1)[0])
            lengths[k : k + run] = length + np.clip(target - length, -speed * seconds, speed * seconds)
            length = float(lengths[k + run - 1])
            k += run
        begin_ns = int(stamps[-1])
        before = np.unique(np.concatenate([[0], rng.integers(0, count, count // 50)]))
        yield Stretches(stamps, lengths, before, 10.0 ** (6.0 - rng.uniform(*_PCA, before.size)))


def _log_uniform(rng: np.random.Generator, bounds: tuple[float, float], count: int) -> Array:
    """Numbers as often in one decade as in another."""
    found: Array = np.exp(rng.uniform(math.log(bounds[0]), math.log(bounds[1]), count))
    return found


class Balance:
    """The series spring's law in a table of its own, to hold a model's outputs against.

    The spring bears F = Fscale·F_xb with dF_xb/dl = kse (F_xb + kse0), F_xb smoothed at 0 as the fibre's set says; what
    it is stretched by is the fibre's length less the contractile element's. Both come from the node's messages.
    """

    def __init__(self, fibre: Fibre) -> None:
        """Integrate the law numerically.

        Raises:
            UserError: the model has no cross-bridges on an exponential spring.
        """
        from scipy.special import roots_legendre

        missing = {"kse", "kse0", "gamma", "Fscale", "koop"} - set(fibre.values)
        if missing:
            raise UserError(f"model {fibre.model} has no heads on a series spring to balance; take 3state_coop")
        self._v = fibre.values
        self._force = np.linspace(-1.0, 4.0, 50_001)
        nodes, weights = roots_legendre(8)
        half = 0.5 * (self._force[1] - self._force[0])
        middle = 0.5 * (self._force[1:] + self._force[:-1])
        panels = half * np.sum(weights / self._stiffness(middle[:, None] + half * nodes), axis=1)
        length = np.concatenate([[0.0], np.cumsum(panels)])
        self._length = length - length[np.searchsorted(self._force, 0.0)]

    def _stiffness(self, force: Array) -> Array:
        """Slope of the spring, dF_xb per power stroke."""
        sharp = self._v["smoothing"]
        taut = np.maximum(force, 0.0) if sharp == 0.0 else np.logaddexp(0.0, sharp * force) / sharp
        slope: Array = self._v["kse"] * (taut + self._v["kse0"])
        return slope

    def error_f0(self, q0: Array, q1: Array, length_change_l0: Array, ce_length_change_l0: Array) -> Array:
        """Difference between the heads' force and the spring's, F0; NaN where the force is beyond -1 to 4."""
        from scipy.interpolate import CubicHermiteSpline

        heads = q0 + q1
        spring = CubicHermiteSpline(self._force, self._length, 1.0 / self._stiffness(self._force), extrapolate=False)
        stretch = self._v["gamma"] * (length_change_l0 - ce_length_change_l0)
        error: Array = self._v["Fscale"] * self._stiffness(heads) * (spring(heads) - stretch)
        return error


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
    from xb_muscle_ros.models.batch import MuscleBatch
    from xb_muscle_ros.node.inlet import Inlet
    from xb_muscle_ros.node.lockstep import Lockstep
    from xb_muscle_ros.node.outputs import OutputMessages

    force, moments = _Collector(("effort", "position")), _Collector(("position",))
    log = _Log()
    outlet = OutputMessages([fibre.name], force, moments)
    inlet = Inlet([fibre.name], Lockstep(MuscleBatch([fibre]), outlet.publish, log, lambda: False), log)
    inlet.open = True
    balance = Balance(fibre)
    sender = _Sender(fibre.name, inlet)
    worst, least, most, done = 0.0, np.inf, -np.inf, 0
    rss: list[float] = []
    last = 0
    with Progress(ticks, "soak") as progress:
        for part in random_stretches(ticks, seed):
            force.clear()
            moments.clear()
            calcium = dict(zip(part.calcium_before.tolist(), part.calcium_um.tolist(), strict=True))
            metres = (1.0 + part.length_l0) * fibre.reference_length_m
            for k, (stamp, metre) in enumerate(zip(part.stamps_ns.tolist(), metres.tolist(), strict=True)):
                if k in calcium:
                    sender.calcium(last, calcium[k])
                sender.length(stamp, metre)
                last = stamp
            done += len(part.stamps_ns)
            if log.lines or len(force.rows) != len(part.stamps_ns):
                raise UserError(f"soak: {len(part.stamps_ns) - len(force.rows)} samples unanswered: {log.lines[:1]}")
            effort, ce_m = np.array(force.rows).T
            rows = np.array(moments.rows)
            ce = ce_m / fibre.reference_length_m - 1.0
            error = balance.error_f0(rows[:, 0], rows[:, 1], metres / fibre.reference_length_m - 1.0, ce)
            worst = max(worst, float(np.max(np.abs(error))))
            if not np.isfinite(worst):
                raise UserError(f"soak: force balance is not a number within the ticks up to {done}")
            least, most = min(least, float(effort.min())), max(most, float(effort.max()))
            rss.append(_rss_mb())
            progress.update(len(part.stamps_ns))
    return Soak(done, worst, least / fibre.f0_n, most / fibre.f0_n, rss[len(rss) // 10], rss[-1])


def soak_over_dds(fibre: Fibre, ticks: int, seed: int = 2) -> tuple[float, float]:
    """The same against a node in a process of its own; largest imbalance (F0) and ticks per second.

    Args:
        fibre: with a file of its own.
        ticks: how many.
        seed: of the random input.

    Raises:
        UserError: the node does not start or answer.
    """
    import time

    from xb_muscle_ros.node.client.player import play_live
    from xb_muscle_ros.node.client.process import NodeProcess, private_domain

    worst, seconds = 0.0, 0.0
    balance = Balance(fibre)
    domain = private_domain()
    with NodeProcess(domain, {"fiber_file": fibre.path, "model": fibre.model, "mode": "lockstep"}):
        for part in random_stretches(ticks, seed):
            trial = _trial(part, fibre)
            begin = time.monotonic()
            (answer,) = play_live([trial], fibre, find_s=60.0, domain_id=domain)
            seconds += time.monotonic() - begin
            reference = fibre.reference_length_m
            error = balance.error_f0(
                answer.moments["q0"],
                answer.moments["q1"],
                trial.length_m / reference - 1.0,
                answer.ce_length_m / reference - 1.0,
            )
            worst = max(worst, float(np.max(np.abs(error))))
    return worst, ticks / seconds


def figures(fibre: Fibre, ticks: int) -> list[Figure]:
    """All figures of a soak; a hundredth of the ticks goes over DDS."""
    found = soak(fibre, ticks)
    over_dds = max(ticks // 100, 1000)
    worst, rate = soak_over_dds(fibre, over_dds)
    name = f"soak, {found.ticks} lockstep ticks"
    return [
        Figure(f"{name}, force balance", found.worst_balance_f0, "F0", None, "largest error; bar 1e-9"),
        Figure(f"{name}, force from", found.least_force_f0, "F0", None, f"to {found.most_force_f0:.3g} F0"),
        Figure(
            f"{name}, memory",
            found.rss_end_mb - found.rss_begin_mb,
            "MB",
            None,
            f"more than {found.rss_begin_mb:.0f} MB after a tenth",
        ),
        Figure(f"soak over DDS, {over_dds} ticks, force balance", worst, "F0", None, "largest error; bar 1e-9"),
        Figure(f"soak over DDS, {over_dds} ticks, rate", rate, "Hz", None, "20 messages under way at once"),
    ]


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


class _Collector:
    """In place of a publisher: keeps the first value of some fields, or all of one."""

    def __init__(self, fields: tuple[str, ...]) -> None:
        self.rows: list[tuple[float, ...]] = []
        self._fields = fields

    def clear(self) -> None:
        """Forget."""
        self.rows.clear()

    def publish(self, msg: Any) -> None:
        """Keep what a message says."""
        if len(self._fields) > 1:
            self.rows.append(tuple(getattr(msg, field)[0] for field in self._fields))
        else:
            self.rows.append(tuple(getattr(msg, self._fields[0])))

    def get_subscription_count(self) -> int:
        """Someone listens."""
        return 1


class _Sender:
    """Messages as they would come out of DDS."""

    def __init__(self, fibre: str, inlet: Any) -> None:
        from sensor_msgs.msg import JointState

        self._inlet = inlet
        self._message = JointState(name=[fibre], position=[0.0])

    def _filled(self, stamp: int, value: float) -> Any:
        from xb_muscle_ros.node.outputs import set_stamp

        set_stamp(self._message, stamp)
        self._message.position[0] = value
        return self._message

    def calcium(self, stamp: int, calcium_um: float) -> None:
        """Free calcium, µM."""
        self._inlet.take_calcium(self._filled(stamp, calcium_um))

    def length(self, stamp: int, length_m: float) -> None:
        """Fibre length, m."""
        self._inlet.take_length(self._filled(stamp, length_m))


class _Log:
    """Keeps what the node would have said."""

    def __init__(self) -> None:
        self.lines: list[str] = []

    def error(self, message: str) -> None:
        """Keep it."""
        self.lines.append(message)

    def warning(self, message: str) -> None:
        """Keep it."""
        self.lines.append(message)

    def info(self, message: str) -> None:
        """Keep it."""
        self.lines.append(message)
