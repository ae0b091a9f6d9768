"""Episodes of a body in MuJoCo, moved by a muscle node, in lockstep or in real time."""

# mypy: allow-untyped-calls

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.node.client.link import Link
from xb_muscle_ros.node.ticker import Ticker
from xb_muscle_ros.plant.body import MovedBody
from xb_muscle_ros.plant.muscle_end import MuscleEnd
from xb_muscle_ros.plant.outlets import Outlets

_SETTLE_S = 0.3
_FIND_S = 2.0
_PAUSE_S = 0.5
_CALCIUM_EVERY = 50


class _EpisodeOver(UserError):
    """An episode that cannot go on, whoever is waited for."""


class _GivenUp(UserError):
    """The muscles were waited for as long as was allowed."""


class Episodes:
    """Plays episodes until it is told to stop, whatever becomes of the muscle node meanwhile."""

    def __init__(self, node: Any, body: MovedBody, given: dict[str, Any], stop: Callable[[], bool]) -> None:
        """Join the topics.

        Args:
            node: of rclpy.
            body: at its start.
            given: parameters, see `plant_parameters`.
            stop: whether to end.
        """
        self._mode: str = given["mode"]
        self._episodes: int = given["episodes"]
        self._timeout_s: float = given["timeout_s"]
        self._give_up_s: float = given["give_up_s"]
        self._stop = stop
        self._log = node.get_logger()
        self._clock = node.get_clock()
        self._body = body
        self._ticks = round(given["duration_s"] / body.tick_s)
        self._link = Link(node=node)
        self._link.stop = stop
        self._end = MuscleEnd(self._link, body.muscles, body.fibres, self._mode)
        self._outlets = Outlets(node, body, given["display_hz"])
        self._said = ""
        self._played = 0
        # Of the realtime thread: ticks until the muscles have settled, whether the body waits for force, what failed.
        self._settling = 0
        self._waiting_since: float | None = None
        self._broken: Exception | None = None

    def run(self) -> None:
        """Play.

        Raises:
            UserError: all were played, and one at least came to an end before its time; or muscles stayed away for
                longer than allowed.
        """
        last = ""
        while not self._stop() and (self._episodes == 0 or self._played < self._episodes):
            self._body.restart()
            why = ""
            try:
                self._play_lockstep() if self._mode == "lockstep" else self._play_realtime()
            except _EpisodeOver as over:
                why = last = f"episode {self._played + 1} ended before its time: {over}; last state: {self._body.state}"
                self._log.warning(why)
            except _GivenUp as error:
                self._outlets.ended(self._played + 1, str(error))
                raise
            if self._stop():
                break
            self._played += 1
            self._outlets.ended(self._played, why)
        if last:
            said = f"{self._outlets.early} of {self._played} episodes ended before their time; the last: {last}"
            if not self._stop():
                raise UserError(last if self._played == 1 else said)
            self._log.info(said)

    def close(self) -> None:
        """Leave the graph."""
        self._link.close()

    def _advance(self, force: Any) -> None:
        """Go on by one tick."""
        try:
            self._body.advance(force)
        except UserError as error:
            raise _EpisodeOver(str(error)) from error
        if said := self._body.over:
            raise _EpisodeOver(said)

    def _insist(self, act: Callable[[], Any]) -> Any:
        """Result of something that a muscle node must be there for, tried until it is; None where told to stop.

        Raises:
            UserError: it was tried for as long as is allowed.
        """
        since = time.monotonic()
        while not self._stop():
            try:
                result = act()
            except _EpisodeOver:
                raise
            except UserError as error:
                waited = time.monotonic() - since
                if self._give_up_s and waited > self._give_up_s:
                    raise _GivenUp(
                        f"gave up after {waited:.0f} s (give_up_s is {self._give_up_s:g}): {error}"
                    ) from error
                if str(error) != self._said:
                    self._said = str(error)
                    self._log.warning(f"waiting: {error}")
                self._outlets.waiting(self._played + 1, str(error))
                # What is wrong may be told at once; nobody is asked without a pause.
                self._link.wait_for(self._stop, _PAUSE_S)
                continue
            if self._said:
                self._said = ""
                self._log.info(f"going on with node {self._link.peer}")
            return result
        return None

    def _stamp(self, tick: int) -> int:
        return round(tick * self._body.tick_s * 1e9)

    def _play_lockstep(self) -> None:
        body, end = self._body, self._end

        def settled() -> Any:
            end.find(_FIND_S)
            return end.settle(body.length_l0, body.calcium[0][1], _FIND_S)

        force = self._insist(settled)
        while force is not None and not self._stop():
            self._outlets.show(self._stamp(body.tick))
            self._outlets.playing(self._played + 1)
            self._advance(force)
            if body.reflexive:
                tick, calcium_um = body.calcium[-1]
                end.send_calcium(self._stamp(tick), calcium_um)
            if body.tick >= self._ticks:
                break
            force = self._answer(self._stamp(body.tick))
        if body.reflexive and not self._stop():
            try:
                end.check_calcium(len(body.calcium), "forces of this episode are not exactly those of the reflex")
            except UserError as error:
                self._log.warning(str(error))

    def _answer(self, stamp: int) -> Any:
        """Forces of a stamp, asked for until they come; None where told to stop."""
        end, body = self._end, self._body
        end.send_length(stamp, body.length_l0, body.velocity_l0_per_s)
        force = end.force(stamp, self._timeout_s)
        if force is not None or self._stop():
            return force
        self._log.warning(f"no force within {self._timeout_s:g} s of the length at {stamp * 1e-9:g} s: asking again")

        def again() -> Any:
            # Another node may have taken its place: it knows neither parameters nor calcium.
            if end.find(_FIND_S):
                self._link.reset()
                end.stuck = False
            for tick, calcium_um in body.calcium:
                end.send_calcium(self._stamp(tick), calcium_um)
            end.send_length(stamp, body.length_l0, body.velocity_l0_per_s)
            found = end.force(stamp, 1.0)
            if found is None and end.stuck:
                raise _EpisodeOver(f"node {self._link.peer} takes no more lengths ({end.trouble})")
            if found is None:
                raise UserError(f"node {self._link.peer} does not answer")
            return found

        force = self._insist(again)
        if force is not None:
            self._log.info(f"force is back at {stamp * 1e-9:g} s; the fibres have settled anew if their node has")
        return force

    def _play_realtime(self) -> None:
        def met() -> bool:
            self._end.find(_FIND_S)
            self._link.reset()
            self._end.newest, self._end.stuck = None, False
            return True

        if self._insist(met) is None:
            return
        self._settling = round(_SETTLE_S / self._body.tick_s)
        self._waiting_since, self._broken = None, None
        ticker = Ticker(lambda: self._broken is None, self._guarded_tick, self._guarded_publish)
        period = round(self._body.tick_s * 1e9)
        ticker.start(period, lambda: 10, 0, self._log, lambda: None)
        try:
            while not self._stop() and self._body.tick < self._ticks and self._broken is None:
                self._link.wait_for(lambda: self._body.tick >= self._ticks or self._broken is not None, 0.1)
                since = self._waiting_since
                if since is None:
                    self._outlets.playing(self._played + 1)
                elif time.monotonic() - since > _FIND_S:
                    self._insist(self._look_again)
        finally:
            ticker.stop()
        late = ticker.lateness.summary()
        self._log.info(
            f"episode of {self._body.tick} ticks: lateness p50 {late.p50_us:.0f}, p99 {late.p99_us:.0f} µs, "
            f"{ticker.overruns} overruns"
        )
        if self._broken is not None:
            raise self._broken

    def _look_again(self) -> bool:
        """Whether the forces are back, or the episode is over for another reason.

        Raises:
            UserError: they are not; why.
        """
        if self._waiting_since is None or self._broken is not None:
            return True
        if self._end.find(_FIND_S):
            self._link.reset()
            self._end.stuck = False
        self._link.wait_for(lambda: self._waiting_since is None, 2.0 * _PAUSE_S)
        if self._waiting_since is None:
            return True
        why = f" ({self._end.trouble})" if self._end.trouble else ""
        if self._end.stuck:
            raise _EpisodeOver(f"node {self._link.peer} takes no more lengths{why}")
        raise UserError(f"node {self._link.peer} sends no force{why}")

    def _guarded_tick(self, deadline_ns: int) -> None:
        del deadline_ns
        # Nobody would hear of an exception in the thread, and the main one would wait for ever.
        try:
            if self._broken is None:
                self._tick()
        except Exception as error:
            self._broken = error

    def _guarded_publish(self) -> None:
        try:
            self._publish()
        except Exception as error:
            self._broken = self._broken or error

    def _tick(self) -> None:
        newest, now = self._end.newest, time.monotonic()
        if newest is None or now - newest[1] > self._timeout_s:
            if self._waiting_since is None:
                self._waiting_since = now
                if newest is not None:
                    self._log.warning(f"no force for {now - newest[1]:.3f} s: the body waits for it")
            return
        if self._waiting_since is not None:
            self._waiting_since = None
            self._log.info("force is there: the body moves on")
        if self._settling:
            self._settling -= 1
        elif self._body.tick < self._ticks:
            self._advance(newest[0])

    def _publish(self) -> None:
        body, stamp = self._body, int(self._clock.now().nanoseconds)
        rarely = stamp // 1_000_000 % _CALCIUM_EVERY == 0
        if rarely or body.reflexive or self._settling or self._waiting_since is not None:
            # Best effort on the other side: what is sent once may be lost, or come before a node that starts later.
            self._end.send_calcium(stamp, body.calcium[0][1])
        self._end.send_length(stamp, body.length_l0, body.velocity_l0_per_s)
        self._outlets.show(stamp)
