"""Trials by the clock, to whoever listens: a muscle node in realtime, or an apparatus that takes length from ROS."""

# mypy: allow-untyped-calls

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np
from rclpy.qos import QoSDurabilityPolicy, QoSProfile, QoSReliabilityPolicy

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.node.audience import Audience
from xb_muscle_ros.node.client.link import Link
from xb_muscle_ros.node.client.wires import LoadSender, Sender
from xb_muscle_ros.node.lateness import Lateness, LatenessSummary
from xb_muscle_ros.node.ticker import make_waiter
from xb_muscle_ros.trials.stamps import to_ns
from xb_muscle_ros.trials.trial import Array, Trial

# A sample that is held is sent this often, s.
_HELD_EVERY_S = 0.01
# On the way from one trial to the next a sample is sent this often, s.
_ON_THE_WAY_EVERY_S = 1e-3
# Where samples are far apart, what comes back is heard in between.
_SERVED_EVERY_S = 0.1
# For so long what became of a trial is waited for, s: a muscle node tells of itself once a second.
_TOLD_S = 1.5
# Who listens to length is found together with who listens to calcium, or soon before.
_CALCIUM_S = 1.0
# Faster lengths are sent without velocity: a node refuses those beyond 1000 L0/s.
_FAST_L0_PER_S = 500.0
_SECOND_NS = 1_000_000_000


class Sent(NamedTuple):
    """One trial as it is sent.

    Attributes:
        name: of the trial.
        joint: name of the fibre in the messages.
        time_s: of what drives the fibre, ascending, shape (n,), s.
        value: length (m) or load (N), shape (n,).
        unit: one L0 (m) or one F0 (N) in it.
        calcium_time_s, calcium_um: shape (m,), s and µM.
    """

    name: str
    joint: str
    time_s: Array
    value: Array
    unit: float
    calcium_time_s: Array
    calcium_um: Array

    @classmethod
    def of(cls, trial: Trial, topic: str, joint: str = "", unit: float | None = None) -> Sent:
        """What is sent of a trial.

        Args:
            topic: ``length``, or ``load`` for the trial's force.
            joint: name of the fibre in the messages; empty for the trial's.
            unit: what stands for one L0 (m) or one F0 (N) in what is sent; None for that of the trial.

        Raises:
            UserError: the trial has no force to send as load, fewer than two samples, or times that do not ascend.
        """
        facts = trial.facts
        if topic == "load":
            times, values, one = trial.force_time_s, trial.force_n, facts.f0_n
        else:
            times, values, one = trial.time_s, trial.length_m, facts.reference_length_m
        what = "force to send as load" if topic == "load" else "length"
        if times.size < 2:
            raise UserError(f"trial {facts.trial} has {times.size} samples of {what}; needed are two at least")
        if np.any(np.diff(times) <= 0.0):
            k = int(np.flatnonzero(np.diff(times) <= 0.0)[0]) + 1
            raise UserError(f"trial {facts.trial}: samples of {what} do not ascend at {times[k]:.9f} s; mend the trial")
        sent = one if unit is None else unit
        calcium = trial.calcium_time_s, trial.calcium_um
        return cls(facts.trial, joint or facts.fibre, times, sent / one * values, sent, *calcium)


@dataclass(frozen=True)
class Played:
    """What became of a trial.

    Attributes:
        trial, joint: names of the trial and of the fibre in the messages.
        sent: samples of what drives the fibre.
        whole: whether that is all of them.
        lateness: of the samples against their time.
        overdue: samples that were sent after the next one was due.
        answered_by: whose force was heard after the last sample.
        refused: samples that the muscle node refused meanwhile, by its words.
        fault: why the muscle node stopped; empty where it did not.
    """

    trial: str
    joint: str
    sent: int
    whole: bool
    lateness: LatenessSummary
    overdue: int
    answered_by: frozenset[str]
    refused: Mapping[str, int]
    fault: str

    @property
    def is_well(self) -> bool:
        """Whether all was sent, taken and answered."""
        return self.whole and self.joint in self.answered_by and not self.refused and not self.fault


def play(
    trials: Sequence[Sent],
    topic: str = "length",
    *,
    speed: float = 1.0,
    rest_s: float = 1.0,
    travel_per_s: float = 0.5,
    wait_s: float = 10.0,
    stop: Callable[[], bool] = lambda: False,
    say: Callable[[str], None] = lambda line: None,
    namespace: str = "",
    domain_id: int | None = None,
) -> Iterator[Played]:
    """Send trials one after the other, each sample at its time after the first, stamped with the time it is due at.

    Nothing is reset on the other side: before each trial its first sample is held, while the muscle comes to rest, and
    after each its last one, until it is known what became of it. From there the fibre is brought to the first sample of
    its next trial at a steady rate, under the calcium that it had, so that nothing is torn.

    Args:
        trials: what is sent.
        topic: ``length`` or ``load``, below ``muscle/``.
        speed: how many times faster than the trials' own time.
        rest_s: for how long the first sample and its calcium are held, s.
        travel_per_s: rate from one trial to the next, L0/s or F0/s.
        wait_s: how long a listener is waited for, s.
        stop: whether to end; asked before every sample.
        say: hears one line on each trial before it is played, and on what the listener has otherwise.
        namespace, domain_id: of ROS.

    Yields:
        what became of each trial of which something was sent, once it has ended.

    Raises:
        UserError: ROS cannot be used, or nobody listens in time.
    """
    with Link("muscle_protocol_player", namespace, domain_id) as link:
        link.stop = stop
        audience = Audience(link, topic)
        senders: dict[str, _Senders] = {}
        for trial in trials:
            if trial.joint not in senders:
                made = senders[trial.joint] = _Senders(link, trial.joint, topic)
                audience.meet(made.driver.publisher, wait_s)
                if not stop():
                    made.look_for_calcium(say)
                    audience.ask_node(trial.unit, say)
            if stop():
                return
            ends = senders[trial.joint]
            ends.travel(float(trial.value[0]), trial.unit, travel_per_s, say)
            duration_s = float(trial.time_s[-1] - trial.time_s[0]) / speed
            say(f"plays {trial.name} as {trial.joint} on {ends.driver.publisher.topic_name}: {duration_s:.3g} s")
            before = dict(audience.refused or {})
            _rest(ends, trial, rest_s)
            if stop():
                return
            sent, lateness, overdue = _sent(ends, trial, speed, stop)
            # What came before counts no more, also what was not heard yet.
            ends.serve(_HELD_EVERY_S)
            audience.forget()
            # Whoever listens goes on to be given the last sample, also where the trial was broken off.
            ends.hold(_TOLD_S, partial(audience.has_answered, trial.joint))
            now = audience.refused or {}
            refused = {why: n - before.get(why, 0) for why, n in now.items() if n > before.get(why, 0)}
            yield Played(
                trial.name, trial.joint, sent, sent == trial.value.size, lateness, overdue, frozenset(audience.names),
                refused, audience.fault,
            )  # fmt: skip


class _Senders:
    """Publishers of one fibre's calcium and of what drives it, whose stamps ascend."""

    def __init__(self, link: Link, joint: str, topic: str) -> None:
        # Who comes later gets the calcium that holds.
        kept = QoSProfile(
            depth=1, reliability=QoSReliabilityPolicy.RELIABLE, durability=QoSDurabilityPolicy.TRANSIENT_LOCAL
        )
        self._link = link
        self._calcium = Sender(link.node, "muscle/calcium", [joint], kept)
        self.driver = (LoadSender if topic == "load" else Sender)(link.node, f"muscle/{topic}", [joint])
        self._joint, self._last_ns, self._value, self._calcium_um = joint, 0, 0.0, 0.0

    def look_for_calcium(self, say: Callable[[str], None]) -> None:
        """Say so where nobody listens to calcium."""
        publisher = self._calcium.publisher
        if not self._link.wait_for(lambda: bool(publisher.get_subscription_count()), _CALCIUM_S):
            say(f"nobody listens to {publisher.topic_name}")

    def now_ns(self) -> int:
        """Time of the system, ns, later than all stamps."""
        return max(time.time_ns(), self._last_ns + 1)

    def calcium(self, stamp_ns: int, calcium_um: float) -> None:
        """Send calcium, µM."""
        self._calcium_um = calcium_um
        self._calcium.send(stamp_ns, calcium_um)

    def drive(self, stamp_ns: int, value: float, velocity: float | None = None) -> None:
        """Send a length (m), with its velocity (m/s) where that is known, or a load (N)."""
        self._last_ns, self._value = stamp_ns, value
        if isinstance(self.driver, LoadSender) or velocity is None:
            self.driver.send(stamp_ns, value)
        else:
            self.driver.send(stamp_ns, value, np.full(1, velocity))

    def travel(self, value: float, unit: float, per_s: float, say: Callable[[str], None]) -> None:
        """Go from what was sent last, if anything was, to the first sample of a trial, and say so.

        Args:
            value: where to, m or N.
            unit: one L0 (m) or one F0 (N) in it.
            per_s: rate, L0/s or F0/s.
            say: hears of it.
        """
        begin, way = self._value, value - self._value
        if self._last_ns == 0 or way == 0.0:
            return
        duration_s = abs(way) / (unit * per_s)
        name = "F0" if isinstance(self.driver, LoadSender) else "L0"
        say(f"brings {self._joint} from {begin / unit:.4g} to {value / unit:.4g} {name} within {duration_s:.3g} s")
        wait, begin_ns, steps = make_waiter(), time.monotonic_ns(), int(duration_s / _ON_THE_WAY_EVERY_S)
        for k in range(1, steps + 1):
            wait(begin_ns + int(k * _ON_THE_WAY_EVERY_S * _SECOND_NS))
            if self._link.stop():
                return
            self.drive(self.now_ns(), begin + way * k * _ON_THE_WAY_EVERY_S / duration_s, way / duration_s)

    def serve(self, duration_s: float) -> None:
        """Hear what comes back for some time."""
        self._link.wait_for(lambda: False, duration_s)

    def hold(self, duration_s: float, until: Callable[[], bool] = lambda: False) -> None:
        """Send the last sample and its calcium again, once at least and for some time, until something is so."""
        end = time.monotonic() + duration_s
        while True:
            # Again and again: a best-effort listener may miss one, and a watchdog may take it for lost.
            now_ns = self.now_ns()
            self._calcium.send(now_ns, self._calcium_um)
            self.drive(now_ns, self._value, 0.0)
            if until() or time.monotonic() >= end or self._link.stop():
                return
            self._link.wait_for(until, _HELD_EVERY_S)


def _rest(ends: _Senders, trial: Sent, rest_s: float) -> None:
    """Hold the first sample of a trial, and the calcium of that time, or the first where that comes later."""
    before = int(np.searchsorted(trial.calcium_time_s, trial.time_s[0], side="right")) - 1
    ends.calcium(ends.now_ns(), float(trial.calcium_um[max(before, 0)]))
    ends.drive(ends.now_ns(), float(trial.value[0]), 0.0)
    ends.hold(rest_s)


def _sent(ends: _Senders, trial: Sent, speed: float, stop: Callable[[], bool]) -> tuple[int, LatenessSummary, int]:
    """Send one trial; returns how many samples, how late, and how many after the next was due."""
    due, is_calcium, at = _schedule(trial, speed)
    next_due = np.append(due[~is_calcium][1:], due[-1] + _SECOND_NS)
    # Towards the next sample, at the end still: whoever extrapolates is where that one will be.
    velocity = np.append(np.diff(trial.value) / np.diff(trial.time_s), 0.0) * speed
    fast = np.abs(velocity) > _FAST_L0_PER_S * trial.unit
    wait, lateness, overdue, sent = make_waiter(), Lateness(), 0, 0
    stamp_ns, begin_ns = ends.now_ns(), time.monotonic_ns()
    for k in range(due.size):
        deadline = begin_ns + int(due[k])
        while (rest := deadline - time.monotonic_ns()) > _SERVED_EVERY_S * _SECOND_NS and not stop():
            ends.serve(min(0.5 * rest / _SECOND_NS, _SERVED_EVERY_S))
        if stop():
            break
        wait(deadline)
        i = int(at[k])
        if is_calcium[k]:
            ends.calcium(stamp_ns + int(due[k]), float(trial.calcium_um[i]))
            continue
        late = time.monotonic_ns() - deadline
        lateness.note(late)
        overdue += late > next_due[i] - due[k]
        ends.drive(stamp_ns + int(due[k]), float(trial.value[i]), None if fast[i] else float(velocity[i]))
        sent += 1
    return sent, lateness.summary(), overdue


def _schedule(trial: Sent, speed: float) -> tuple[Array, Array, Array]:
    """When each sample is due after the first of what drives the fibre (ns), whether it is calcium, and its index.

    Calcium goes before a length of the same time; what came before the first length is held from the rest on.
    """
    origin = trial.time_s[0]
    later = np.flatnonzero((trial.calcium_time_s > origin) & (trial.calcium_time_s <= trial.time_s[-1]))
    due = np.concatenate([trial.calcium_time_s[later], trial.time_s]) - origin
    is_calcium = np.arange(due.size) < later.size
    order = np.lexsort((~is_calcium, due))
    at = np.concatenate([later, np.arange(trial.time_s.size)])
    return to_ns(due / speed)[order], is_calcium[order], at[order]
