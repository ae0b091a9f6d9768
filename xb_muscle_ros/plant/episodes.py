"""Episodes of a body in MuJoCo, moved by a muscle node, in lockstep or in real time."""

# mypy: allow-untyped-calls

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from sensor_msgs.msg import JointState

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.fibre_file import load_fibre
from xb_muscle_ros.node.client.link import Link
from xb_muscle_ros.node.ticker import Ticker
from xb_muscle_ros.node.traffic import set_stamp
from xb_muscle_ros.plant.body import Body
from xb_muscle_ros.plant.muscle_end import MuscleEnd
from xb_muscle_ros.plant.plant_parameters import read
from xb_muscle_ros.plant.translation import RampAndHold

_SETTLE_S = 0.3
_FIND_S = 2.0
_CALCIUM_EVERY = 50


class _EpisodeOver(UserError):
    """An episode that cannot go on, whoever is waited for."""


class Episodes:
    """Plays episodes until it is told to stop, whatever becomes of the muscle node meanwhile."""

    def __init__(self, node: Any, stop: Callable[[], bool]) -> None:
        """Read parameters, build the body and join the topics.

        Args:
            node: of rclpy, which declared its parameters as they came.
            stop: whether to end.

        Raises:
            UserError: a parameter, or what it names, is wrong.
        """
        given = read(node)
        self._mode: str = given["mode"]
        self._episodes: int = given["episodes"]
        self._timeout_s: float = given["timeout_s"]
        self._stop = stop
        self._log = node.get_logger()
        self._clock = node.get_clock()
        platform = RampAndHold(given["displacement_m"], given["speed_m_per_s"], given["acceleration_m_per_s2"])
        fibre = load_fibre(given["fiber_file"], given["model"])
        self._body = Body(given["scene"], fibre, platform, given["elastic_tendon"])
        self._ticks = round(given["duration_s"] / self._body.plant.tick_s)
        self._link = Link(node=node)
        self._link.stop = stop
        self._end = MuscleEnd(self._link, self._body.plant.muscles, self._body.fibre, self._mode)
        self._to_joint = node.create_publisher(JointState, "plant/joint", 100)
        self._joint = JointState(name=[given["scene"]])
        self._said = ""
        # Of the realtime thread: ticks until the muscles have settled, and whether the body waits for force.
        self._settling = 0
        self._played = 0
        self._fallen = False
        self._waiting_since: float | None = None

    def run(self) -> None:
        """Play.

        Raises:
            UserError: an episode came to an end before its time.
        """
        while not self._stop() and (self._episodes == 0 or self._played < self._episodes):
            self._body.restart()
            self._play_lockstep() if self._mode == "lockstep" else self._play_realtime()
            self._played += 1

    def close(self) -> None:
        """Leave the graph."""
        self._link.close()

    def _ended(self, why: str) -> _EpisodeOver:
        """What to say of an episode that cannot go on."""
        return _EpisodeOver(f"episode {self._played + 1} ended before its time: {why}; last state: {self._body.state}")

    def _check_reach(self) -> None:
        if said := self._body.beyond:
            raise self._ended(
                f"{said}, so no muscle can answer; take a shorter duration_s or a gentler movement of the platform"
            )

    def _insist(self, act: Callable[[], Any]) -> Any:
        """Result of something that a muscle node must be there for, tried until it is; None where told to stop."""
        while not self._stop():
            try:
                result = act()
            except _EpisodeOver:
                raise
            except UserError as error:
                if str(error) != self._said:
                    self._said = str(error)
                    self._log.warning(f"waiting: {error}")
                continue
            if self._said:
                self._said = ""
                self._log.info(f"going on with node {self._link.peer}")
            return result
        return None

    def _play_lockstep(self) -> None:
        body, end = self._body, self._end

        def settled() -> Any:
            end.find(_FIND_S)
            return end.settle(body.length_l0, body.calcium_um, _FIND_S)

        force = self._insist(settled)
        while force is not None and not self._stop():
            self._show(round(body.tick * body.plant.tick_s * 1e9))
            body.advance(force)
            if body.tick >= self._ticks:
                return
            self._check_reach()
            force = self._answer(round(body.tick * body.plant.tick_s * 1e9))

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
            end.send_calcium(stamp, body.calcium_um)
            end.send_length(stamp, body.length_l0, body.velocity_l0_per_s)
            found = end.force(stamp, 1.0)
            if found is None and end.stuck:
                raise self._ended(f"node {self._link.peer} takes no more lengths ({end.trouble})")
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
            self._end.newest = None
            return True

        if self._insist(met) is None:
            return
        self._settling = round(_SETTLE_S / self._body.plant.tick_s)
        self._waiting_since = None
        ticker = Ticker(lambda: True, self._tick, self._publish)
        period = round(self._body.plant.tick_s * 1e9)
        ticker.start(period, lambda: 10, 0, self._log, lambda: None)
        try:
            while not self._stop() and self._body.tick < self._ticks:
                self._link.wait_for(lambda: self._body.tick >= self._ticks, 0.1)
                if self._fallen:
                    break
                since = self._waiting_since
                if since is not None and time.monotonic() - since > _FIND_S:
                    self._insist(self._look_again)
                    self._waiting_since = None if self._waiting_since is None else time.monotonic()
        finally:
            ticker.stop()
        self._fallen = False
        self._check_reach()
        late = ticker.lateness.summary()
        self._log.info(
            f"episode of {self._body.tick} ticks: lateness p50 {late.p50_us:.0f}, p99 {late.p99_us:.0f} µs, "
            f"{ticker.overruns} overruns"
        )

    def _look_again(self) -> bool:
        if self._end.find(_FIND_S):
            self._link.reset()
        return True

    def _tick(self, deadline_ns: int) -> None:
        del deadline_ns
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
        elif self._body.tick < self._ticks and not self._fallen:
            self._body.advance(newest[0])
            # The main thread ends the episode; the body stays where it is until then.
            self._fallen = bool(self._body.beyond)

    def _publish(self) -> None:
        body, stamp = self._body, int(self._clock.now().nanoseconds)
        if stamp // 1_000_000 % _CALCIUM_EVERY == 0 or self._settling or self._waiting_since is not None:
            # Best effort on the other side: what is sent once may be lost, or come before a node that starts later.
            self._end.send_calcium(stamp, body.calcium_um)
        self._end.send_length(stamp, body.length_l0, body.velocity_l0_per_s)
        self._show(stamp)

    def _show(self, stamp: int) -> None:
        joint, plant = self._joint, self._body.plant
        set_stamp(joint, stamp)
        joint.position, joint.velocity = [plant.angle_rad], [plant.velocity_rad_per_s]
        joint.effort = [self._body.torque_nm]
        self._to_joint.publish(joint)
