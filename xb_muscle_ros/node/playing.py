"""Trials by the clock, to whoever listens: a muscle node in realtime, or an apparatus that takes length from ROS."""

# mypy: allow-untyped-calls

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from rclpy.qos import QoSDurabilityPolicy, QoSProfile, QoSReliabilityPolicy

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.node.client.link import Link
from xb_muscle_ros.node.client.wires import LoadSender, Sender
from xb_muscle_ros.node.joint_state import Joints
from xb_muscle_ros.node.lateness import Lateness, LatenessSummary
from xb_muscle_ros.node.ticker import make_waiter
from xb_muscle_ros.node.traffic import subscribe
from xb_muscle_ros.trials.stamps import to_ns
from xb_muscle_ros.trials.trial import Array, Trial

# While a first sample is held it is sent this often, s, so that no watchdog takes it for lost.
_HELD_EVERY_S = 0.01
# Between trials: what came as an answer is served, and a wish to stop is heard.
_SERVED_EVERY_S = 0.1
_SETTLED_S = 0.3
# Who listens to length is found together with who listens to calcium, or soon before.
_CALCIUM_S = 1.0
_SECOND_NS = 1_000_000_000
_ANSWERS = ("muscle/force", "muscle/measured_force")


class Sent(NamedTuple):
    """One trial as it is sent.

    Attributes:
        name: of the trial.
        joint: name of the fibre in the messages.
        time_s: of what drives the fibre, ascending, shape (n,), s.
        value: length (m) or load (N), shape (n,).
        calcium_time_s, calcium_um: shape (m,), s and µM.
    """

    name: str
    joint: str
    time_s: Array
    value: Array
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
        scale = 1.0 if unit is None else unit / one
        return cls(facts.trial, joint or facts.fibre, times, scale * values, trial.calcium_time_s, trial.calcium_um)


@dataclass(frozen=True)
class Played:
    """What became of a trial.

    Attributes:
        trial, joint: names of the trial and of the fibre in the messages.
        sent: samples of what drives the fibre.
        whole: whether that is all of them.
        lateness: of the samples against their time.
        overdue: samples that came later than the next one was due.
        answered_by: whose force was heard meanwhile.
    """

    trial: str
    joint: str
    sent: int
    whole: bool
    lateness: LatenessSummary
    overdue: int
    answered_by: frozenset[str]


def play(
    trials: Sequence[Sent],
    topic: str = "length",
    *,
    speed: float = 1.0,
    rest_s: float = 1.0,
    wait_s: float = 10.0,
    stop: Callable[[], bool] = lambda: False,
    say: Callable[[str], None] = lambda line: None,
    namespace: str = "",
    domain_id: int | None = None,
) -> Iterator[Played]:
    """Send trials one after the other, each sample at its time after the first; stamps are those times of the system.

    Nothing is asked of the other side and nothing reset: before each trial its first sample is held, while the muscle
    comes to rest.

    Args:
        trials: what is sent.
        topic: ``length`` or ``load``, below ``muscle/``.
        speed: how many times faster than the trials' own time.
        rest_s: for how long the first sample and its calcium are held, s.
        wait_s: how long a listener is waited for, s.
        stop: whether to end; asked before every sample.
        say: hears one line on each trial before it is played.
        namespace, domain_id: of ROS.

    Yields:
        what became of each trial that was begun, once it has ended.

    Raises:
        UserError: ROS cannot be used, or nobody listens in time.
    """
    with Link("muscle_protocol_player", namespace, domain_id) as link:
        link.stop = stop
        heard: set[str] = set()

        def hear(message: Joints) -> None:
            heard.update(message.names)

        for name in _ANSWERS:
            subscribe(link.node, name, hear, QoSProfile(depth=1, reliability=QoSReliabilityPolicy.BEST_EFFORT))
        senders: dict[str, _Senders] = {}
        for trial in trials:
            if stop():
                break
            if trial.joint not in senders:
                senders[trial.joint] = _Senders(link, trial.joint, topic)
            ends = senders[trial.joint]
            ends.meet(link, wait_s, say)
            if stop():
                break
            say(f"plays {trial.name} as {trial.joint} on {ends.topic_name}: {_duration_s(trial) / speed:.3g} s")
            heard.clear()
            _rest(link, ends, trial, rest_s, stop)
            yield _played(link, ends, trial, speed, heard, stop)


class _Senders:
    """Publishers of one fibre's calcium and of what drives it."""

    def __init__(self, link: Link, joint: str, topic: str) -> None:
        # Who comes later gets the calcium that holds.
        kept = QoSProfile(
            depth=1, reliability=QoSReliabilityPolicy.RELIABLE, durability=QoSDurabilityPolicy.TRANSIENT_LOCAL
        )
        self.calcium = Sender(link.node, "muscle/calcium", [joint], kept)
        self._by_load = topic == "load"
        self._driver = (LoadSender if self._by_load else Sender)(link.node, f"muscle/{topic}", [joint])
        self.topic_name = self._driver.publisher.topic_name

    def meet(self, link: Link, wait_s: float, say: Callable[[str], None]) -> None:
        """Wait for a listener; one of calcium there need not be.

        Raises:
            UserError: there is none in time.
        """
        publisher = self._driver.publisher
        if not link.wait_for(lambda: bool(publisher.get_subscription_count()), wait_s) and not link.stop():
            raise UserError(
                f"nobody listens to {self.topic_name} (looked for {wait_s:g} s); start what is to hear it, or look at "
                "names, ROS_DOMAIN_ID and ROS_AUTOMATIC_DISCOVERY_RANGE"
            )
        calcium = self.calcium.publisher
        if not link.wait_for(lambda: bool(calcium.get_subscription_count()), min(wait_s, _CALCIUM_S)):
            say(f"nobody listens to {calcium.topic_name}")

    def drive(self, stamp_ns: int, value: float, velocity: float) -> None:
        """Send a length (m) with its velocity (m/s), or a load (N)."""
        if isinstance(self._driver, LoadSender):
            self._driver.send(stamp_ns, value)
        else:
            self._driver.send(stamp_ns, value, np.full(1, velocity))


def _rest(link: Link, ends: _Senders, trial: Sent, rest_s: float, stop: Callable[[], bool]) -> None:
    """Hold the first sample of a trial, and the calcium of that time; once at least."""
    before = int(np.searchsorted(trial.calcium_time_s, trial.time_s[0], side="right")) - 1
    end = time.monotonic() + rest_s
    while not stop():
        # Again and again: a best-effort listener may miss one.
        ends.calcium.send(time.time_ns(), float(trial.calcium_um[max(before, 0)]))
        if time.monotonic() >= end:
            return
        ends.drive(time.time_ns(), float(trial.value[0]), 0.0)
        link.wait_for(lambda: False, min(_HELD_EVERY_S, rest_s))


def _played(link: Link, ends: _Senders, trial: Sent, speed: float, heard: set[str], stop: Callable[[], bool]) -> Played:
    """Send one trial; names that are heard meanwhile come into `heard`."""
    due, is_calcium, at = _schedule(trial, speed)
    # Towards the next sample, at the end still: whoever extrapolates is where that one will be.
    velocity = np.append(np.diff(trial.value) / np.diff(trial.time_s), 0.0) * speed
    wait, lateness, overdue, sent = make_waiter(), Lateness(), 0, 0
    begin_ns, stamp_ns = time.monotonic_ns(), time.time_ns()
    for k in range(due.size):
        deadline = begin_ns + int(due[k])
        while (rest := deadline - time.monotonic_ns()) > _SERVED_EVERY_S * _SECOND_NS and not stop():
            link.wait_for(lambda: False, min(0.5 * rest / _SECOND_NS, _SERVED_EVERY_S))
        if stop():
            break
        wait(deadline)
        i = int(at[k])
        if is_calcium[k]:
            ends.calcium.send(stamp_ns + int(due[k]), float(trial.calcium_um[i]))
            continue
        ends.drive(stamp_ns + int(due[k]), float(trial.value[i]), float(velocity[i]))
        late = time.monotonic_ns() - deadline
        lateness.note(late)
        overdue += k + 1 < due.size and late > due[k + 1] - due[k] > 0
        sent += 1
    link.wait_for(lambda: bool(heard), _SETTLED_S)
    whole = sent == trial.value.size
    return Played(trial.name, trial.joint, sent, whole, lateness.summary(), overdue, frozenset(heard))


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


def _duration_s(trial: Sent) -> float:
    return float(trial.time_s[-1] - trial.time_s[0])
