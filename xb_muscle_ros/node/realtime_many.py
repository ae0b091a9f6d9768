"""Realtime for many fibres: all stepped in one call per tick, whichever of them have got new samples."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.errors import StateViolation, UserError
from xb_muscle_ros.models.batch import MuscleBatch
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.node.inputs import (
    BACK_S,
    LENGTH_CHANGE_L0,
    LONGEST_GAP_S,
    VELOCITY_L0_PER_S,
    Counts,
    Refusal,
    Scale,
    after,
    checked,
    length_change_l0,
)
from xb_muscle_ros.node.lockstep_many import scale_of, stopped, use_threads
from xb_muscle_ros.node.realtime import Settings
from xb_muscle_ros.node.several import EmitMany, Floats, Indices, Trouble, enumerated, scale_rows
from xb_muscle_ros.node.status import Account, Log, Snapshot, Status, time_went_back
from xb_muscle_ros.node.ticker import Ticker
from xb_muscle_ros.node.watchdog import DECAY, HOLD

Flags = npt.NDArray[np.bool_]
Stamps = npt.NDArray[np.int64]

_NO_STAMP = -(2**63)
_REST_CALCIUM_UM = 0.1


class _Inputs(NamedTuple):
    """The newest samples, shape (fibres,), never changed but replaced; NaN where there is none.

    Attributes:
        change_l0, velocity_l0_per_s, calcium_um: velocity is NaN also where a sample came without.
        arrival_ns: steady time of the length samples.
        scale: shape (fibres, 2), see `scale_rows`.
    """

    change_l0: Floats
    velocity_l0_per_s: Floats
    calcium_um: Floats
    arrival_ns: Stamps
    scale: Floats


class RealtimeMany:
    """Steps at absolute deadlines; a fibre joins once it has length and calcium, one that fails leaves until a reset.

    See `Realtime`, whose behaviour each fibre has. Fibres that take no part rest in their places in the batch, unseen.

    Attributes:
        batch: what is stepped; fibres may be exchanged between ticks.
        settings: as for `Realtime`.
        counts: what was odd about the input that was taken nevertheless.
    """

    def __init__(
        self,
        batch: MuscleBatch,
        settings: Settings,
        emit: EmitMany,
        clock_ns: Callable[[], int],
        log: Log,
        simulated_time: Callable[[], bool],
    ) -> None:
        """Keep what is needed; `start` starts. Arguments as for `Realtime`."""
        self.batch = batch
        self.settings = settings
        self.counts = Counts()
        self._emit = emit
        self._clock_ns = clock_ns
        self._log = log
        self._simulated_time = simulated_time
        self._ticker = Ticker(self._ready, self._tick, self._done)
        self._names = [muscle.fibre.name for muscle in batch.muscles]
        count = len(batch)
        self._next_scale = scale_rows([scale_of(muscle.fibre) for muscle in batch.muscles])
        none = np.full(count, np.nan)
        # Callbacks replace it, and ask for resets, under the lock; the thread takes both up together.
        self._lock = threading.Lock()
        self._inputs = _Inputs(none, none, none, np.zeros(count, dtype=np.int64), self._next_scale.copy())
        self._pending = np.ones(count, dtype=np.bool_)
        self._length_stamps = np.full(count, _NO_STAMP, dtype=np.int64)
        self._calcium_stamps = self._length_stamps.copy()
        self._taken = np.zeros((count, 2), dtype=np.int64)
        # The thread's own.
        self._rest = np.stack([muscle.rest() for muscle in batch.muscles])
        self._rest[:, -1] = _REST_CALCIUM_UM
        self._states = self._rest.copy()
        self._live = np.zeros(count, dtype=np.bool_)
        self._faults: dict[int, str] = {}
        self._overdue = np.zeros(count, dtype=np.bool_)
        self._timeouts = 0
        self._scale_out = self._inputs.scale
        self._ticks = 0
        self._violations = 0
        self.reset()

    @property
    def muscles(self) -> tuple[Muscle, ...]:
        """One for each fibre, in order."""
        return self.batch.muscles

    def start(self) -> None:
        """Start the thread."""
        settings = self.settings
        period = round(1e9 / settings.rate_hz)
        self._dt = period * 1e-9
        self._ticker.start(
            period,
            lambda: self.settings.max_catch_up,
            settings.realtime_priority,
            self._log,
            lambda: use_threads(settings.threads),
        )

    def stop(self) -> None:
        """End the thread at its next tick, and wait for that."""
        self._ticker.stop()

    def replace(self, index: int, fibre: Fibre) -> None:
        """Go on with other parameters of one fibre; its constants count from its next reset on."""
        # One assignment: a tick sees the old set or the new one, never a mixture.
        self.batch = self.batch.replaced(index, fibre)
        self._next_scale[index] = scale_of(fibre)

    def reset(self) -> Account:
        """Forget all fibres' states and stamps; see `Realtime.reset`. Returns what was taken, over all of them."""
        taken = self._taken.sum(axis=0).tolist()
        self._forget(np.arange(len(self._names)))
        if not self._ticker.running:
            self._take_up()
        self._ticker.forget()
        self._timeouts = 0
        return Account(*taken)

    def save(self) -> tuple[Snapshot, ...]:
        """One snapshot for each fibre, of the newest tick.

        Raises:
            UserError: a fibre has no state yet, or has stopped.
        """
        # Each is read once: the thread steps on meanwhile.
        states, live, inputs, scales = self._states, self._live.copy(), self._inputs, self._scale_out
        for i, name in enumerate(self._names):
            if i in self._faults:
                raise UserError(
                    f"fibre {name}: there is no state to save, stepping has stopped: {self._faults[i]}; "
                    "call ~/reset first"
                )
            if not live[i] or self._pending[i]:
                raise UserError(
                    f"fibre {name}: there is no state to save yet: the fibre settles with the first length and calcium"
                )
        return tuple(
            Snapshot(
                states[i].copy(),
                Scale(*scales[i].tolist()),
                ((0, float(inputs.calcium_um[i])),),
                None,
                None,
                Account(*self._taken[i].tolist()),
            )
            for i in range(len(self._names))
        )

    def load(self, snapshots: Sequence[Snapshot]) -> None:
        """Go on from snapshots, one for each fibre; see `Realtime.load`."""
        running = self._ticker.running
        self.stop()
        self.reset()
        count = len(snapshots)
        states = np.stack([snapshot.state for snapshot in snapshots])
        self._taken = np.array([snapshot.account[:2] for snapshot in snapshots])
        scale = scale_rows([snapshot.scale for snapshot in snapshots])
        self._inputs = _Inputs(
            states[:, -3].copy(),
            np.full(count, np.nan),
            np.array([snapshot.calcium[-1][1] for snapshot in snapshots]),
            np.full(count, time.monotonic_ns(), dtype=np.int64),
            scale,
        )
        self._states, self._scale_out = states, scale
        self._live = np.ones(count, dtype=np.bool_)
        if running:
            self.start()

    def take_calcium(self, stamp: int, fibres: Indices, calcium_um: Floats) -> list[Trouble]:
        """Use calcium (µM) of some fibres from the next tick on; a stamp of 0 stands for an unstamped message."""
        last = self._calcium_stamps[fibres]
        if stamp != 0 and self._simulated_time():
            last = np.where(_went_back(stamp, last), _NO_STAMP, last)
        troubles, good = _in_order(stamp, last, fibres, "calcium")
        if troubles:
            fibres, calcium_um = fibres[good], calcium_um[good]
        if stamp != 0:
            self._calcium_stamps[fibres] = stamp
        values = self._inputs.calcium_um.copy()
        values[fibres] = calcium_um
        self._taken[fibres, 1] += 1
        with self._lock:
            self._inputs = self._inputs._replace(calcium_um=values)
        return troubles

    def take_length(
        self, stamp: int, fibres: Indices, position_m: Floats, velocity_m_per_s: Floats | None
    ) -> list[Trouble]:
        """Use lengths (m, m/s or None) of some fibres from the next tick on; see `take_calcium`."""
        last = self._length_stamps[fibres]
        back = np.zeros(len(fibres), dtype=np.bool_)
        if stamp != 0 and self._simulated_time():
            back = _went_back(stamp, last)
        troubles, good = _in_order(stamp, np.where(back, _NO_STAMP, last), fibres, "length")
        reference = np.where(back, self._next_scale[fibres, 0], self._inputs.scale[fibres, 0])
        change = position_m / reference - 1.0
        rate = np.full(len(fibres), np.nan) if velocity_m_per_s is None else velocity_m_per_s / reference
        fine = (change >= LENGTH_CHANGE_L0[0]) & (change <= LENGTH_CHANGE_L0[1])
        if velocity_m_per_s is not None:
            fine &= (rate >= VELOCITY_L0_PER_S[0]) & (rate <= VELOCITY_L0_PER_S[1])
        for k in np.flatnonzero(good & ~fine).tolist():
            troubles.append(Trouble(int(fibres[k]), _why(position_m, velocity_m_per_s, reference, k)))
        good &= fine
        if not good.all():
            fibres, change, rate, back, last = fibres[good], change[good], rate[good], back[good], last[good]
        if back.any():
            self._begin_again(stamp, fibres[back], int(last[back][0]))
        if stamp != 0:
            self._length_stamps[fibres] = stamp
        self._taken[fibres, 0] += 1
        old = self._inputs
        changes, rates, arrivals = old.change_l0.copy(), old.velocity_l0_per_s.copy(), old.arrival_ns.copy()
        changes[fibres], rates[fibres], arrivals[fibres] = change, rate, time.monotonic_ns()
        with self._lock:
            self._inputs = old._replace(change_l0=changes, velocity_l0_per_s=rates, arrival_ns=arrivals)
        return troubles

    def status(self) -> Status:
        """How it goes, over all fibres."""
        inputs, live = self._inputs, self._live
        waiting = []
        for what, values in (("length", inputs.change_l0), ("calcium", inputs.calcium_um)):
            missing = [self._names[i] for i in np.flatnonzero(np.isnan(values) & ~live)]
            if missing:
                waiting.append(f"{enumerated(missing)}: waiting for {what}")
        if not waiting and not np.all(live) and not self._faults:
            waiting.append("settling")
        overdue = [self._names[i] for i in np.flatnonzero(self._overdue)]
        faults = [f"{self._names[i]}: {text}" for i, text in sorted(self._faults.copy().items())]
        ticker = self._ticker
        return Status(
            self._ticks,
            self._violations,
            stopped(faults, len(self._names)),
            "; ".join(waiting),
            ticker.lateness.summary(),
            ticker.overruns,
            ticker.dropped,
            f"{self.settings.on_timeout} ({enumerated(overdue)})" if overdue else "",
            self._timeouts,
        )

    def _begin_again(self, stamp: int, back: Indices, last: int) -> None:
        taken = Account(*self._taken[back].sum(axis=0).tolist())
        self.counts["time went back"] += len(back)
        self._log.warning(f"{self._named(back)}: {time_went_back(last, stamp, taken)}")
        self._forget(back)

    def _forget(self, which: Indices) -> None:
        """Forget some fibres' lengths and states; newest calcium is kept, as in `Realtime.reset`."""
        self._length_stamps[which] = self._calcium_stamps[which] = _NO_STAMP
        self._taken[which] = 0
        inputs = self._inputs
        change, scale = inputs.change_l0.copy(), inputs.scale.copy()
        change[which] = np.nan
        scale[which] = self._next_scale[which]
        pending = self._pending.copy()
        pending[which] = True
        with self._lock:
            self._inputs = inputs._replace(change_l0=change, scale=scale)
            self._pending = pending

    def _take_up(self) -> _Inputs:
        """Newest inputs; fibres that were reset are at rest from now on."""
        with self._lock:
            inputs, pending = self._inputs, self._pending
            if pending.any():
                self._pending = np.zeros_like(pending)
        if pending.any():
            self._states = np.where(pending[:, None], self._rest, self._states)
            self._scale_out = np.where(pending[:, None], inputs.scale, self._scale_out)
            self._live = self._live & ~pending
            self._overdue = self._overdue & ~pending
            self._faults = {i: fault for i, fault in self._faults.items() if not pending[i]}
        return inputs

    def _ready(self) -> bool:
        inputs = self._take_up()
        stepping = bool(self._live.any())
        due = ~self._live & ~np.isnan(inputs.change_l0) & ~np.isnan(inputs.calcium_um)
        for i in np.flatnonzero(due).tolist():
            if i not in self._faults:
                self._settle(i, float(inputs.change_l0[i]), float(inputs.calcium_um[i]))
        return stepping

    def _settle(self, i: int, change_l0: float, calcium_um: float) -> None:
        try:
            row = self.muscles[i].settle(change_l0, calcium_um)
        except UserError as error:
            self._fail(i, error)
            return
        states, live = self._states.copy(), self._live.copy()
        states[i], live[i] = row, True
        self._states, self._live = states, live

    def _tick(self, deadline_ns: int) -> None:
        inputs, settings = self._inputs, self.settings
        states, live = self._states, self._live & ~self._pending & ~np.isnan(inputs.change_l0)
        change, calcium = inputs.change_l0, inputs.calcium_um
        if settings.extrapolate:
            change = _carried_on(inputs, deadline_ns, settings.extrapolation_limit_s)
        overdue_s = self._watch(inputs, deadline_ns, settings, live)
        if overdue_s is not None:
            overdue = self._overdue
            change = np.where(overdue, inputs.change_l0 if settings.on_timeout == HOLD else states[:, -3], change)
            if settings.on_timeout == DECAY:
                calcium = np.where(overdue, calcium * np.exp(-overdue_s / settings.decay_s), calcium)
        change = np.where(live, change, states[:, -3])
        calcium = np.where(live, calcium, _REST_CALCIUM_UM)
        try:
            self._states = self.batch.step(states, change, calcium, self._dt)
        except UserError:
            self._one_by_one(states, change, calcium, live)
        self._ticks += 1

    def _one_by_one(self, states: Floats, change: Floats, calcium: Floats, live: Flags) -> None:
        stepped = states.copy()
        for i in np.flatnonzero(live).tolist():
            try:
                stepped[i] = self.muscles[i].step(states[i], float(change[i]), float(calcium[i]), self._dt)
            except UserError as error:
                stepped[i] = self._rest[i]
                self._fail(i, error)
        self._states = stepped

    def _watch(self, inputs: _Inputs, now_ns: int, settings: Settings, live: Flags) -> Floats | None:
        """How long each fibre's length is overdue, s, at least 0; None where none is. Logs its begin and end."""
        before = self._overdue
        if settings.timeout_s <= 0.0 and not before.any():
            return None
        age_s = (now_ns - np.maximum(inputs.arrival_ns, self._ticker.begun_ns)) * 1e-9
        overdue_s: Floats = age_s - settings.timeout_s
        overdue = (overdue_s > 0.0) & live & (settings.timeout_s > 0.0)
        if not np.array_equal(overdue, before):
            begun, over = np.flatnonzero(overdue & ~before), np.flatnonzero(before & ~overdue & live)
            if begun.size:
                self._timeouts += int(begun.size)
                self._log.error(
                    f"{self._named(begun)}: no length for {float(age_s[begun[0]]):.3f} s, timeout_s is "
                    f"{settings.timeout_s:g} s: {settings.on_timeout}"
                )
            if over.size:
                self._log.info(f"{self._named(over)}: length is in time again: {settings.on_timeout} ends")
            self._overdue = overdue
        return np.maximum(overdue_s, 0.0) if overdue.any() else None

    def _done(self) -> None:
        live = self._live & ~self._pending
        if not live.any():
            return
        table = self.batch.output_table(self._states)
        if live.all():
            self._emit(self._clock_ns(), None, table, self._scale_out)
        else:
            which = np.flatnonzero(live)
            self._emit(self._clock_ns(), which, table[which], self._scale_out[which])

    def _fail(self, i: int, error: UserError) -> None:
        self._violations += isinstance(error, StateViolation)
        text = f"{error} (after {self._ticks * self._dt:.3f} s of stepping)"
        self._faults = {**self._faults, i: text}
        live = self._live.copy()
        live[i] = False
        self._live = live
        self._log.error(f"{self._names[i]} stopped: {text}; call ~/reset to start again")

    def _named(self, which: Indices) -> str:
        return enumerated([self._names[i] for i in which.tolist()])


def _went_back(stamp: int, last: Stamps) -> Flags:
    """`went_back` for many; stamps in ns."""
    back: Flags = (last != _NO_STAMP) & (stamp < last - round(BACK_S * 1e9))
    return back


def _in_order(stamp: int, last: Stamps, fibres: Indices, what: str) -> tuple[list[Trouble], Flags]:
    """Which fibres' stamps come after the last ones, as `after` has it; the others with their reasons."""
    good = np.ones(len(fibres), dtype=np.bool_)
    if stamp == 0:
        return [], good
    known = last != _NO_STAMP
    good = ~known | ((last < stamp) & (last >= stamp - round(LONGEST_GAP_S * 1e9)))
    troubles = []
    for k in np.flatnonzero(~good).tolist():
        try:
            after(stamp, int(last[k]), what)
        except Refusal as refusal:
            troubles.append(Trouble(int(fibres[k]), refusal))
    return troubles, good


def _why(position_m: Floats, velocity_m_per_s: Floats | None, reference_m: Floats, k: int) -> Refusal:
    """What is wrong with a fibre's sample that is out of bounds."""
    reference = float(reference_m[k])
    try:
        length_change_l0(float(position_m[k]), Scale(reference, 1.0))
        assert velocity_m_per_s is not None
        checked(float(velocity_m_per_s[k]) / reference, VELOCITY_L0_PER_S, "velocity", "L0/s")
    except Refusal as refusal:
        return refusal
    raise AssertionError("vector and scalar bounds differ")


def _carried_on(inputs: _Inputs, time_ns: int, limit_s: float) -> Floats:
    """Length changes carried on by their velocities where there are any and they lead to what is allowed."""
    ahead = np.clip((time_ns - inputs.arrival_ns) * 1e-9, 0.0, limit_s)
    change = inputs.change_l0 + inputs.velocity_l0_per_s * ahead
    good = (change >= LENGTH_CHANGE_L0[0]) & (change <= LENGTH_CHANGE_L0[1])
    return np.where(good, change, inputs.change_l0)
