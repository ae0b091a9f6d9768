"""Realtime: one step per period of the steady clock, whatever messages come and when."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.errors import StateViolation, UserError
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.node.inputs import (
    LENGTH_CHANGE_L0,
    VELOCITY_L0_PER_S,
    Counts,
    Scale,
    after,
    checked,
    length_change_l0,
    went_back,
)
from xb_muscle_ros.node.lockstep import Emit
from xb_muscle_ros.node.status import Account, Log, Snapshot, Status, time_went_back
from xb_muscle_ros.node.ticker import Ticker
from xb_muscle_ros.node.watchdog import Watchdog, unfed


class Settings(NamedTuple):
    """How the clock drives the fibre; all but rate, priority and threads may change between ticks."""

    rate_hz: float
    extrapolate: bool
    extrapolation_limit_s: float
    max_catch_up: int
    timeout_s: float
    on_timeout: str
    decay_s: float
    realtime_priority: int = 0
    threads: int = 1


class _Length(NamedTuple):
    change_l0: float
    velocity_l0_per_s: float | None
    arrival_ns: int


class Realtime:
    """Steps at absolute deadlines; between samples the length is held, or carried on by its velocity.

    Callbacks put the newest input in place, the thread takes it from there; each is one reference, so neither waits for
    the other. Where length stays away for longer than the settings allow, the watchdog takes its place.

    Attributes:
        muscle: what is stepped; may be exchanged between ticks for one of the same model.
        settings: may be exchanged between ticks; the rate counts at the next start.
        next_scale: becomes the scale in use at the next reset.
        counts: what was odd about the input that was taken nevertheless.
    """

    def __init__(
        self,
        muscle: Muscle,
        scale: Scale,
        settings: Settings,
        emit: Emit,
        clock_ns: Callable[[], int],
        log: Log,
        simulated_time: Callable[[], bool],
    ) -> None:
        """Keep what is needed; `start` starts.

        Args:
            muscle, scale, settings: see above.
            emit: called in the thread with stamp, outputs and scale.
            clock_ns: time of the output's stamps, ns.
            log: told when stepping stops, when length stays away and comes back (both in the thread), and when time
                went back.
            simulated_time: whether the time of stamps may go back.
        """
        self.muscle = muscle
        self.settings = settings
        self.next_scale = scale
        self.counts = Counts()
        self._emit = emit
        self._clock_ns = clock_ns
        self._log = log
        self._simulated_time = simulated_time
        self._ticker = Ticker(self._ready, self._tick, self._done)
        self._ticks = 0
        self._violations = 0
        self._calcium: float | None = None
        self._state: npt.NDArray[np.float64] | None = None
        self._account = Account()
        self.reset()

    def start(self) -> None:
        """Start the thread."""
        settings = self.settings
        period = round(1e9 / settings.rate_hz)
        self._dt = period * 1e-9
        self._ticker.start(
            period, lambda: self.settings.max_catch_up, settings.realtime_priority, self._log, lambda: None
        )

    def stop(self) -> None:
        """End the thread at its next tick, and wait for that."""
        self._ticker.stop()

    def reset(self) -> Account:
        """Forget state and stamps and start the statistics anew; the next length sample settles anew.

        The newest calcium is kept: it holds whatever the clock of the samples says. Returns what was taken until now.
        """
        account, self._account = self._account, Account()
        self._length: _Length | None = None
        self._length_stamp: int | None = None
        self._calcium_stamp: int | None = None
        self._scale = self.next_scale
        # The thread takes the rest up at its next tick.
        self._reset = True
        if not self._ticker.running:
            self._begin_anew()
        return account

    def save(self) -> Snapshot:
        """The state of the newest tick, and what drives it.

        Raises:
            UserError: there is no state yet, or integration failed.
        """
        # Each is read once: the thread steps on meanwhile.
        fault, state, calcium = self._fault, None if self._reset else self._state, self._calcium
        if fault:
            raise UserError(f"there is no state to save, stepping has stopped: {fault}; call ~/reset first")
        if state is None or calcium is None:
            raise UserError("there is no state to save yet: the fibre settles with the first length and calcium")
        return Snapshot(state, self._scale_out, ((0, calcium),), None, None, self._account)

    def load(self, snapshot: Snapshot) -> None:
        """Go on from a snapshot, isometrically at the length that the fibre had until the next length sample comes.

        Stamps begin anew, whatever they were; the thread pauses for this.
        """
        running = self._ticker.running
        self.stop()
        self.reset()
        self._account = snapshot.account
        self._scale = self._scale_out = snapshot.scale
        self._calcium = snapshot.calcium[-1][1]
        self._length = _Length(float(snapshot.state[-3]), None, time.monotonic_ns())
        self._state = snapshot.state
        if running:
            self.start()

    def take_calcium(self, stamp: int, calcium_um: float) -> None:
        """Use a calcium sample (µM) from the next tick on; a stamp of 0 stands for an unstamped message.

        Raises:
            Refusal: the stamp is not after the last one.
        """
        if stamp != 0:
            if went_back(stamp, self._calcium_stamp) and self._simulated_time():
                self._calcium_stamp = None
            self._calcium_stamp = after(stamp, self._calcium_stamp, "calcium")
        self._calcium = calcium_um
        self._account = self._account._replace(calcium=self._account.calcium + 1)

    def take_length(self, stamp: int, position_m: float, velocity_m_per_s: float | None) -> None:
        """Use a length sample (m, m/s or None) from the next tick on; a stamp of 0 stands for an unstamped message.

        Raises:
            Refusal: the sample cannot be integrated.
        """
        back = stamp != 0 and went_back(stamp, self._length_stamp) and self._simulated_time()
        scale = self.next_scale if back else self._scale
        change = length_change_l0(position_m, scale)
        velocity = None
        if velocity_m_per_s is not None:
            velocity = checked(velocity_m_per_s / scale.reference_length_m, VELOCITY_L0_PER_S, "velocity", "L0/s")
        if back:
            self._begin_again(stamp)
        if stamp != 0:
            self._length_stamp = after(stamp, self._length_stamp, "length")
        self._length = _Length(change, velocity, time.monotonic_ns())
        self._account = self._account._replace(length=self._account.length + 1)

    def status(self) -> Status:
        """How it goes."""
        waiting = ""
        if self._state is None:
            missing = [n for n, v in (("length", self._length), ("calcium", self._calcium)) if v is None]
            waiting = f"waiting for {' and '.join(missing)}" if missing else "settling"
        return Status(
            self._ticks,
            self._violations,
            self._fault,
            waiting,
            self._ticker.lateness.summary(),
            self._ticker.overruns,
            self._ticker.dropped,
            self.settings.on_timeout if self._watchdog.barking and self._state is not None else "",
            self._watchdog.timeouts,
        )

    def _begin_again(self, stamp: int) -> None:
        last = self._length_stamp
        assert last is not None
        self.counts["time went back"] += 1
        self._log.warning(time_went_back(last, stamp, self.reset()))

    def _begin_anew(self) -> None:
        self._reset = False
        self._scale_out = self._scale
        self._state = None
        self._fault = ""
        self._ticker.forget()
        self._watchdog = Watchdog(self._log)

    def _ready(self) -> bool:
        if self._reset:
            self._begin_anew()
        if self._state is None or self._fault:
            self._settle()
            return False
        return True

    def _done(self) -> None:
        if self._state is not None and not self._fault and not self._reset:
            # Of ticks made up for only the newest is worth sending.
            self._emit(self._clock_ns(), self.muscle.outputs(self._state), self._scale_out)

    def _settle(self) -> None:
        length, calcium = self._length, self._calcium
        if self._fault or length is None or calcium is None:
            return
        try:
            self._state = self.muscle.settle(length.change_l0, calcium)
        except UserError as error:
            self._fail(error)

    def _tick(self, deadline_ns: int) -> None:
        length, calcium = self._length, self._calcium
        # A reset is taken up at the next tick; asked after the length is read, no new length meets the old state.
        if self._reset or self._fault or self._state is None or length is None or calcium is None:
            return
        settings = self.settings
        fed_ns = max(length.arrival_ns, self._ticker.begun_ns)
        overdue_s = self._watchdog.overdue_s(fed_ns, deadline_ns, settings.timeout_s, settings.on_timeout)
        if overdue_s > 0.0:
            model = float(self._state[-3])
            change, calcium = unfed(settings.on_timeout, overdue_s, settings.decay_s, length.change_l0, model, calcium)
        else:
            change = self._change_at(length, deadline_ns, settings)
        try:
            self._state = self.muscle.step(self._state, change, calcium, self._dt)
        except UserError as error:
            self._fail(error)
        self._ticks += 1

    def _change_at(self, length: _Length, time_ns: int, settings: Settings) -> float:
        if not settings.extrapolate or length.velocity_l0_per_s is None:
            return length.change_l0
        ahead = min(max((time_ns - length.arrival_ns) * 1e-9, 0.0), settings.extrapolation_limit_s)
        change = length.change_l0 + length.velocity_l0_per_s * ahead
        # Where the velocity would lead out of what is allowed, the sample itself is the better guess.
        return change if LENGTH_CHANGE_L0[0] <= change <= LENGTH_CHANGE_L0[1] else length.change_l0

    def _fail(self, error: UserError) -> None:
        if isinstance(error, StateViolation):
            self._violations += 1
        self._fault = f"{error} (after {self._ticks * self._dt:.3f} s of stepping)"
        self._log.error(f"stopped: {self._fault}; call ~/reset to start again")
