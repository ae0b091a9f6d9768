"""Realtime for many fibres: all stepped in one call per tick, whichever of them have got new samples."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

import numpy as np

from xb_muscle_ros.errors import StateViolation, UserError
from xb_muscle_ros.models.batch import MuscleBatch
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.node.inputs import LENGTH_CHANGE_L0, Counts, Scale, scale_of
from xb_muscle_ros.node.lockstep_many import stopped, use_threads
from xb_muscle_ros.node.realtime import Settings
from xb_muscle_ros.node.samples import Flags, Inputs, Samples
from xb_muscle_ros.node.several import EmitMany, Floats, Indices, Trouble, enumerated, scale_rows
from xb_muscle_ros.node.status import Account, Log, Snapshot, Status
from xb_muscle_ros.node.ticker import Ticker
from xb_muscle_ros.node.watchdog import DECAY, HOLD

_REST_CALCIUM_UM = 0.1


class RealtimeMany:
    """Steps at absolute deadlines; a fibre joins once it has length and calcium, one that fails leaves until a reset.

    See `Realtime`, whose behaviour each fibre has. Fibres that take no part rest in their places in the batch, unseen.

    Attributes:
        batch: what is stepped; fibres may be exchanged between ticks.
        settings: as for `Realtime`.
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
        self._emit = emit
        self._clock_ns = clock_ns
        self._log = log
        self._ticker = Ticker(self._ready, self._tick, self._done)
        self._names = [muscle.fibre.name for muscle in batch.muscles]
        scales = scale_rows([scale_of(muscle.fibre) for muscle in batch.muscles])
        self._samples = Samples(self._names, scales, log, simulated_time)
        # The thread's own.
        self._rest = np.stack([muscle.rest() for muscle in batch.muscles])
        self._rest[:, -1] = _REST_CALCIUM_UM
        self._states = self._rest.copy()
        self._live = np.zeros(len(batch), dtype=np.bool_)
        self._faults: dict[int, str] = {}
        self._overdue = np.zeros(len(batch), dtype=np.bool_)
        self._timeouts = 0
        self._scale_out = self._samples.inputs.scale
        self._ticks = 0
        self._violations = 0
        self.reset()

    @property
    def counts(self) -> Counts:
        """What was odd about the input that was taken nevertheless."""
        return self._samples.counts

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
        self._samples.next_scale[index] = scale_of(fibre)

    def reset(self) -> Account:
        """Forget all fibres' states and stamps; see `Realtime.reset`. Returns what was taken, over all of them."""
        taken = self._samples.taken.sum(axis=0).tolist()
        self._samples.forget(np.arange(len(self._names)))
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
        states, live, inputs, scales = self._states, self._live.copy(), self._samples.inputs, self._scale_out
        for i, name in enumerate(self._names):
            if i in self._faults:
                raise UserError(
                    f"fibre {name}: there is no state to save, stepping has stopped: {self._faults[i]}; "
                    "call ~/reset first"
                )
            if not live[i] or self._samples.pending[i]:
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
                Account(*self._samples.taken[i].tolist()),
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
        self._samples.taken = np.array([snapshot.account[:2] for snapshot in snapshots])
        scale = scale_rows([snapshot.scale for snapshot in snapshots])
        self._samples.put(
            Inputs(
                states[:, -3].copy(),
                np.full(count, np.nan),
                np.array([snapshot.calcium[-1][1] for snapshot in snapshots]),
                np.full(count, time.monotonic_ns(), dtype=np.int64),
                scale,
            )
        )
        self._states, self._scale_out = states, scale
        self._live = np.ones(count, dtype=np.bool_)
        if running:
            self.start()

    def take_calcium(self, stamp: int, fibres: Indices, calcium_um: Floats) -> list[Trouble]:
        """See `Samples`."""
        return self._samples.take_calcium(stamp, fibres, calcium_um)

    def take_length(
        self, stamp: int, fibres: Indices, position_m: Floats, velocity_m_per_s: Floats | None
    ) -> list[Trouble]:
        """See `Samples`."""
        return self._samples.take_length(stamp, fibres, position_m, velocity_m_per_s)

    def status(self) -> Status:
        """How it goes, over all fibres."""
        inputs, live = self._samples.inputs, self._live
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

    def _take_up(self) -> Inputs:
        """Newest inputs; fibres that were reset are at rest from now on."""
        inputs, pending = self._samples.take_up()
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
        inputs, settings = self._samples.inputs, self.settings
        states, live = self._states, self._live & ~self._samples.pending & ~np.isnan(inputs.change_l0)
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

    def _watch(self, inputs: Inputs, now_ns: int, settings: Settings, live: Flags) -> Floats | None:
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
        live = self._live & ~self._samples.pending
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


def _carried_on(inputs: Inputs, time_ns: int, limit_s: float) -> Floats:
    """Length changes carried on by their velocities where there are any and they lead to what is allowed."""
    ahead = np.clip((time_ns - inputs.arrival_ns) * 1e-9, 0.0, limit_s)
    change = inputs.change_l0 + inputs.velocity_l0_per_s * ahead
    good = (change >= LENGTH_CHANGE_L0[0]) & (change <= LENGTH_CHANGE_L0[1])
    return np.where(good, change, inputs.change_l0)
