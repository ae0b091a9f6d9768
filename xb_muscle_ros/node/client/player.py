"""Plays trials through a running muscle node over DDS and keeps what it answers."""

# mypy: allow-untyped-calls

from __future__ import annotations

import time
import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.duration import Duration

from xb_muscle_ros.errors import DataWarning, UserError
from xb_muscle_ros.node.client.link import Link
from xb_muscle_ros.node.client.travelling import Plan
from xb_muscle_ros.node.client.wires import LoadSender, Sender, reliable
from xb_muscle_ros.node.diagnostics import fault_in, status_name
from xb_muscle_ros.node.joint_state import Joints
from xb_muscle_ros.node.traffic import subscribe
from xb_muscle_ros.trials.simulated import MOMENTS, Simulated
from xb_muscle_ros.trials.trial import Trial

# Samples under way at once. Well below the depth of the queues, so that nothing is ever lost.
_WINDOW = 20
_HANDSHAKE_S = 1.0
_LOOK_EVERY_S = 0.2
_LEAVE_S = 2.0
# What the node tells of itself counts where it is so much younger than its last answer, s; it tells it once a second.
_NEWER_S = 0.3


class Stopped(UserError):
    """The node's fibre stopped at a trial; after a reset it may play others."""


class Player:
    """Topics on one side, arrays on the other.

    Attributes:
        length_m: lengths that were answered to the last trial, shape (n,), m; where loads are sent.
    """

    def __init__(self, link: Link, fibre: str, timeout_s: float, topic: str = "length") -> None:
        self._link = link
        self._timeout_s = timeout_s
        node = link.node
        self._shares, self._loads = np.empty(0), topic == "load"
        self._calcium = Sender(node, "muscle/calcium", [fibre])
        self._driver = (LoadSender if self._loads else Sender)(node, f"muscle/{topic}", [fibre])
        self._ends = (self._driver, self._calcium)
        self._inlets = [
            subscribe(node, "muscle/force", self._on_force, reliable()),
            subscribe(node, "muscle/moments", self._on_moments, reliable()),
        ]
        if self._loads:
            self._inlets.append(subscribe(node, "muscle/length", self._on_length, reliable()))
        self._inlets.append(node.create_subscription(DiagnosticArray, "/diagnostics", self._on_diagnostics, 10))
        # Why the node's fibre stopped, and when it said so (steady clock, s).
        self._fault, self._fault_at_s = "", 0.0
        self._met = False
        self._begin({}, 0)

    def meet(self, timeout_s: float) -> None:
        """Wait until both sides' topics know each other.

        Raises:
            UserError: they do not in time.
        """
        ends = [end.publisher for end in self._ends]
        if not self._link.wait_for(lambda: all(end.get_subscription_count() for end in ends), timeout_s):
            raise UserError(f"node {self._link.peer} does not listen to {ends[0].topic_name}; check its remappings")

    def _check_alone(self) -> None:
        topics = [end.publisher.topic_name for end in self._ends]

        def others() -> int:
            return sum(self._link.node.count_publishers(topic) - 1 for topic in topics)

        # One that has just ended stays on the graph for a moment.
        if not self._link.wait_for(lambda: others() == 0, _LEAVE_S):
            raise UserError(
                f"{' and '.join(topics)} have more publishers ({others()}); end them, or lockstep has two masters"
            )

    def play(self, trial: Trial, shares: npt.NDArray[np.float64] | None = None) -> Simulated:
        """Play one trial.

        Calcium travels apart from length. Waiting until every calcium sample is acknowledged takes DDS seconds each, so
        the trial is played without, the node then tells whether all of it came in time, and only if not the trial is
        played again with waiting.

        Args:
            trial: of the node's fibre.
            shares: under force control, where lengths of the trial are not sent: the load at every sample, over the
                isometric force with which the node answers the first, shape (n,).

        Raises:
            Stopped: the node's fibre stopped; with its reason.
            UserError: see `live.play_live`.
        """
        if shares is not None:
            self._shares = shares
        plan = Plan.of(trial)
        facts = trial.facts
        self._check_alone()
        self._link.set_parameters(
            {"constants.reference_length_m": facts.reference_length_m, "constants.f0_n": facts.f0_n}
        )
        stopped: Stopped | None = None
        for wait in (False, True):
            listeners = self._listeners()
            try:
                self._play(trial, plan, wait)
                stopped = None
            except Stopped as problem:
                stopped = problem
            self._tell_of_latecomers(facts.trial, listeners)
            account = self._link.reset()
            if account.calcium == self._sent_calcium and account.late == 0:
                break
        else:
            if stopped is None:
                raise UserError(
                    f"trial {facts.trial}: node {self._link.peer} took {account}; {self._sent_calcium} calcium samples "
                    "were sent; leave the machine more time, or end what else publishes calcium"
                )
        if stopped is not None:
            raise stopped
        return Simulated(
            time_s=trial.time_s,
            force_n=self._force[:, 0],
            ce_length_m=self._force[:, 1],
            ce_velocity_m_per_s=self._force[:, 2],
            moments={name: self._moments[:, i] for i, name in enumerate(MOMENTS)},
        )

    def _listeners(self) -> dict[str, int]:
        """How many listen to each topic; a recorder hears calcium, and length, but loads perhaps not."""
        return {end.publisher.topic_name: end.publisher.get_subscription_count() for end in self._ends}

    def _tell_of_latecomers(self, trial: str, before: dict[str, int]) -> None:
        now = self._listeners()
        came = {topic: count - before[topic] for topic, count in now.items() if count > before[topic]}
        if came:
            told = " and ".join(f"{count} of {topic}" for topic, count in came.items())
            warnings.warn(
                f"trial {trial}: more subscriptions came while the trial was played and did not hear its beginning "
                f"({told}); start recorders first and play the trial again",
                DataWarning,
                stacklevel=3,
            )

    def _play(self, trial: Trial, plan: Plan, wait: bool) -> None:
        stamps = plan.stamps
        self._begin({int(stamp): k for k, stamp in enumerate(stamps)}, stamps.size)
        if wait:
            # Nothing of an earlier attempt may arrive in the middle of this one.
            self._wait_for_calcium(trial)
        self._start(trial, plan, wait)
        # A load is a share of the force with which the first sample was answered.
        values = self._force[0, 0] * self._shares if self._loads else trial.length_m
        for first in range(1, stamps.size, _WINDOW):
            window = range(first, min(first + _WINDOW, stamps.size))
            self._send_calcium(trial, plan, sorted({int(i) for i in plan.held[first : window.stop]}), wait)
            for k in window:
                self._driver.send(int(stamps[k]), values[k])
            self._await(window, trial, plan)

    def _start(self, trial: Trial, plan: Plan, wait: bool) -> None:
        """Send the first sample, and again after a reset while the node's answers may not find their way yet."""
        sent_s = time.monotonic()

        def send() -> None:
            nonlocal sent_s
            sent_s = time.monotonic()
            self._sent_calcium, self._newest_calcium = 0, -1
            self._send_calcium(trial, plan, [int(plan.held[0])], wait)
            self._driver.send(int(plan.stamps[0]), 0.0 if self._loads else trial.length_m[0])

        def answered() -> bool:
            self._look_for_fault(sent_s, trial)
            return bool(self._missing[0] == 0)

        patience = self._timeout_s if self._met else _HANDSHAKE_S
        self._met = self._link.begin(send, answered, self._timeout_s, patience)
        if not self._met:
            self._give_up(0, trial, plan)

    def _begin(self, index: dict[int, int], samples: int) -> None:
        self._index = index
        self._force = np.full((samples, 3), np.nan)
        self._moments = np.full((samples, len(MOMENTS)), np.nan)
        self.length_m = np.full(samples, np.nan)
        # Per sample: 1 for the force, 2 for the moments, 4 for the length still to come.
        self._missing = np.full(samples, 7 if self._loads else 3, dtype=np.int64)
        # How many were sent since the last reset, and the index of the newest of them.
        self._sent_calcium, self._newest_calcium = 0, -1

    def _send_calcium(self, trial: Trial, plan: Plan, needed: Sequence[int], wait: bool) -> None:
        """Send calcium that was not sent yet, if wanted until the node has it."""
        new = [i for i in needed if i > self._newest_calcium]
        for i in new:
            self._calcium.send(int(plan.calcium_stamps[i]), trial.calcium_um[i])
            self._newest_calcium = i
        self._sent_calcium += len(new)
        if new and wait:
            self._wait_for_calcium(trial)

    def _wait_for_calcium(self, trial: Trial) -> None:
        if not self._calcium.publisher.wait_for_all_acked(Duration(seconds=self._timeout_s)):
            raise UserError(f"trial {trial.facts.trial}: node {self._link.peer} does not take calcium; is it running?")

    def _await(self, window: range, trial: Trial, plan: Plan) -> None:
        missing = self._missing[window.start : window.stop]
        answered_s = time.monotonic()
        before = int(missing.sum())
        while before:
            self._link.wait_for(lambda: not missing.any(), _LOOK_EVERY_S)
            now = int(missing.sum())
            if now < before:
                answered_s = time.monotonic()
            self._look_for_fault(answered_s, trial)
            if now == before and time.monotonic() >= answered_s + self._timeout_s:
                self._give_up(window.start + int(np.flatnonzero(missing)[0]), trial, plan)
            before = now

    def _look_for_fault(self, since_s: float, trial: Trial) -> None:
        """Raise what the node tells of a stop some time after its last answer, or after what it was asked (steady, s).

        Raises:
            Stopped: it tells of one.
        """
        if self._fault and self._fault_at_s > since_s + _NEWER_S:
            raise Stopped(f"trial {trial.facts.trial}: node {self._link.peer} stopped: {self._fault}")

    def _give_up(self, k: int, trial: Trial, plan: Plan) -> None:
        missing = int(self._missing[k])
        what = "force" if missing & 1 else "moments" if missing & 2 else "length"
        raise UserError(
            f"trial {trial.facts.trial}: node {self._link.peer} sent no {what} for the sample stamped "
            f"{plan.stamps[k] * 1e-9:.9f} s within {self._timeout_s:g} s; its log says whether it "
            "refused the sample, stopped or ended"
        )

    def _on_force(self, message: Joints) -> None:
        k = self._index.get(message.stamp_ns)
        if k is not None:
            self._force[k] = message.effort[0], message.position[0], message.velocity[0]
            self._missing[k] &= ~1

    def _on_moments(self, message: Joints) -> None:
        k = self._index.get(message.stamp_ns)
        if k is not None:
            self._moments[k] = message.position
            self._missing[k] &= ~2

    def _on_length(self, message: Joints) -> None:
        k = self._index.get(message.stamp_ns)
        if k is not None:
            self.length_m[k] = message.position[0]
            self._missing[k] &= ~4

    def _on_diagnostics(self, message: Any) -> None:
        for status in message.status:
            if status.name == status_name(self._link.peer):
                self._fault, self._fault_at_s = fault_in(status), time.monotonic()
