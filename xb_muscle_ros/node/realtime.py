"""Realtime: one step per period of the steady clock, whatever messages come and when."""

from __future__ import annotations

import functools
import time
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from xb_muscle_ros.errors import StateViolation, UserError
from xb_muscle_ros.models.batch import MuscleBatch
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.node.control import LENGTH, Control
from xb_muscle_ros.node.names import front
from xb_muscle_ros.node.rules import Counts, Scale, scale_of
from xb_muscle_ros.node.samples import Samples
from xb_muscle_ros.node.status import Account, Log, Snapshot, Status, no_state
from xb_muscle_ros.node.stepping import Emit, Flags, Floats, outputs, stopped, use_threads
from xb_muscle_ros.node.ticker import Ticker
from xb_muscle_ros.node.watchdog import Watchdog, unfed

_REST_CALCIUM_UM = 0.1


class Settings(NamedTuple):
    """How the clock drives the fibres; all but rate, priority and threads may change between ticks."""

    rate_hz: float
    extrapolate: bool
    extrapolation_limit_s: float
    max_catch_up: int
    timeout_s: float
    on_timeout: str
    decay_s: float
    realtime_priority: int = 0
    threads: int = 1


class Realtime:
    """Steps at absolute deadlines; between samples the length is held, or carried on by its velocity.

    A fibre joins once it has length and calcium, one that fails leaves until a reset. Fibres that take no part rest in
    their places in the batch, unseen. Callbacks put the newest input in place, the thread takes it from there, all of
    it by one reference, so neither waits for the other. Where length stays away for longer than the settings allow, the
    watchdog takes its place.

    Attributes:
        batch: what is stepped; fibres may be exchanged between ticks.
        settings: may be exchanged between ticks; the rate counts at the next start.
        take_calcium, take_length: see `Samples`.
    """

    def __init__(
        self,
        batch: MuscleBatch,
        settings: Settings,
        emit: Emit,
        clock_ns: Callable[[], int],
        log: Log,
        simulated_time: Callable[[], bool],
        control: Control = LENGTH,
    ) -> None:
        """Keep what is needed; `start` starts.

        Args:
            batch, settings: see above.
            emit: called in the thread for every answer.
            clock_ns: time of the output's stamps, ns.
            log: told when stepping stops, when length stays away and comes back (both in the thread), and when time
                went back.
            simulated_time: whether the time of stamps may go back.
            control: what samples ask for.
        """
        self.batch = batch
        self._control = control
        self.settings = settings
        self._emit = emit
        self._clock_ns = clock_ns
        self._log = log
        self._ticker = Ticker(self._ready, self._tick, self._done)
        self._names = [muscle.fibre.name for muscle in batch.muscles]
        scales = np.array([scale_of(muscle.fibre) for muscle in batch.muscles])
        self._samples = Samples(self._names, scales, log, simulated_time, control)
        self.take_calcium, self.take_length = self._samples.take_calcium, self._samples.take_length
        # The thread's own; arrays are replaced, never changed, since callbacks read them.
        self._rest = np.stack([muscle.rest() for muscle in batch.muscles])
        self._rest[:, -1] = _REST_CALCIUM_UM
        self._states = self._rest
        self._use_live(np.zeros(len(batch), dtype=np.bool_))
        self._faults: dict[int, str] = {}
        self._watchdog = Watchdog(self._names, log, control.topic)
        self._scale_out = self._samples.inputs.scale
        # Resets that were taken up, see `Inputs`.
        self._run = self._samples.inputs.run
        self._ticks = 0
        self._violations = 0

    @property
    def counts(self) -> Counts:
        """What was odd about the input that was taken nevertheless."""
        return self._samples.counts

    def start(self) -> None:
        """Start the thread."""
        settings = self.settings
        period = round(1e9 / settings.rate_hz)
        self._dt = period * 1e-9
        begin = functools.partial(use_threads, self.batch, settings.threads)
        priority = settings.realtime_priority
        self._ticker.start(period, lambda: self.settings.max_catch_up, priority, self._log, begin)

    def stop(self) -> None:
        """End the thread at its next tick, and wait for that."""
        self._ticker.stop()

    def replace(self, index: int, fibre: Fibre) -> None:
        """Go on with other parameters of one fibre; its constants count from its next reset on."""
        # One assignment: a tick sees the old set or the new one, never a mixture.
        self.batch = self.batch.replaced(index, fibre)
        self._samples.next_scale[index] = scale_of(fibre)

    def reset(self) -> Account:
        """Forget states and stamps and start the statistics anew; the next length samples settle anew.

        The newest calcium is kept. Returns what was taken until now, over all fibres.
        """
        taken = self._samples.taken.sum(axis=0).tolist()
        self._samples.forget(np.arange(len(self._names)))
        # The thread takes the rest up at its next tick.
        if not self._ticker.running:
            self._take_up()
        return Account(*taken)

    def save(self) -> tuple[Snapshot, ...]:
        """One snapshot for each fibre: the state of the newest tick, and what drives it.

        Raises:
            UserError: a fibre has no state yet, or has stopped.
        """
        # The thread goes on meanwhile: it takes resets up in the reverse order, and a state is there before it is live.
        run, live, states = self._run, self._live, self._states
        faults, inputs, scales = self._faults, self._samples.inputs, self._scale_out
        live = live & (inputs.run == run)
        for i in range(len(self._names)):
            if i in faults or not live[i]:
                why = no_state(faults.get(i, ""), f"the first {self._control.topic} and calcium")
                raise UserError(f"{front(self._names, [i], begin='fibre ')}{why}")
        return tuple(
            Snapshot(
                states[i], Scale(*scales[i].tolist()), ((0, float(inputs.calcium_um[i])),), None, None, Account(*taken)
            )
            for i, taken in enumerate(self._samples.taken.tolist())
        )

    def load(self, snapshots: Sequence[Snapshot]) -> None:
        """Go on from snapshots, one for each fibre, isometrically at their lengths until the next length samples come.

        Stamps begin anew, whatever they were; the thread pauses for this.
        """
        running = self._ticker.running
        self.stop()
        self.reset()
        states = np.stack([snapshot.state for snapshot in snapshots])
        scales = np.array([snapshot.scale for snapshot in snapshots])
        samples, now = self._samples, time.monotonic_ns()
        samples.taken = np.array([snapshot.account[:2] for snapshot in snapshots])
        samples.inputs = samples.inputs._replace(
            goal=self._control.still(states).copy(),
            velocity_l0_per_s=np.full(len(states), np.nan),
            calcium_um=np.array([snapshot.calcium[-1][1] for snapshot in snapshots]),
            arrival_ns=np.full(len(states), now, dtype=np.int64),
            oldest_ns=now,
            scale=scales,
        )
        self._states, self._scale_out = states, scales
        self._use_live(np.ones(len(states), dtype=np.bool_))
        if running:
            self.start()

    def status(self) -> Status:
        """How it goes, over all fibres."""
        inputs, live, faults = self._samples.inputs, self._live, self._faults
        missing: dict[str, list[int]] = {}
        lacking = [(self._control.topic, np.isnan(inputs.goal)), ("calcium", np.isnan(inputs.calcium_um))]
        for i in np.flatnonzero(~live).tolist():
            if what := " and ".join(name for name, absent in lacking if absent[i]):
                missing.setdefault(what, []).append(i)
        waiting = [f"{front(self._names, which)}waiting for {what}" for what, which in missing.items()]
        if not waiting and not self._all_live and not faults:
            waiting.append("settling")
        overdue = np.flatnonzero(self._watchdog.overdue & live).tolist()
        ticker = self._ticker
        return Status(
            self._ticks,
            self._violations,
            stopped(self._names, faults),
            "; ".join(waiting),
            ticker.lateness.summary(),
            ticker.overruns,
            ticker.dropped,
            f"{self.settings.on_timeout}{front(self._names, overdue, ')', ' (')}" if overdue else "",
            self._watchdog.timeouts,
        )

    def _use_live(self, live: Flags) -> None:
        """Fibres that are stepped from now on, and, asked at every tick, whether those are any and all."""
        self._live, self._any_live, self._all_live = live, bool(live.any()), bool(live.all())

    def _take_up(self) -> None:
        """Fibres that were reset are at rest from now on."""
        inputs = self._samples.inputs
        anew = inputs.run != self._run
        self._use_live(self._live & ~anew)
        self._states = np.where(anew[:, None], self._rest, self._states)
        self._scale_out = np.where(anew[:, None], inputs.scale, self._scale_out)
        self._faults = {i: fault for i, fault in self._faults.items() if not anew[i]}
        self._watchdog.forget(anew)
        if anew.all():
            self._ticker.forget()
        self._run = inputs.run

    def _ready(self) -> bool:
        if self._samples.inputs.run is not self._run:
            self._take_up()
        stepping = self._any_live
        if not self._all_live:
            inputs = self._samples.inputs
            due = ~self._live & ~np.isnan(inputs.goal) & ~np.isnan(inputs.calcium_um)
            for i in np.flatnonzero(due).tolist():
                if i not in self._faults:
                    self._settle(i, float(inputs.goal[i]), float(inputs.calcium_um[i]))
        return stepping

    def _settle(self, i: int, goal: float, calcium_um: float) -> None:
        states, live = self._states.copy(), self._live.copy()
        try:
            states[i], live[i] = self._control.settle(self.batch.muscles[i], goal, calcium_um), True
        except UserError as error:
            self._fail(i, error)
            return
        self._states = states
        self._use_live(live)

    def _tick(self, deadline_ns: int) -> None:
        inputs, settings, states, live = self._samples.inputs, self.settings, self._states, self._live
        complete = self._all_live and inputs.run is self._run
        if not complete:
            # A reset is taken up at the next tick; until then no new length meets an old state.
            live = live & (inputs.run == self._run)
            if not live.any():
                return
        control, goal, calcium = self._control, inputs.goal, inputs.calcium_um
        if settings.extrapolate:
            goal = inputs.carried_on(deadline_ns, settings.extrapolation_limit_s)
        watchdog, begun_ns = self._watchdog, self._ticker.begun_ns
        overdue_s = watchdog.look(inputs, begun_ns, deadline_ns, settings.timeout_s, settings.on_timeout, live)
        if overdue_s is not None:
            held = unfed(settings.on_timeout, overdue_s, settings.decay_s, inputs.goal, control.still(states), calcium)
            goal, calcium = (np.where(watchdog.overdue, *p) for p in zip(held, (goal, calcium), strict=True))
        if not complete:
            goal, calcium = np.where(live, goal, control.still(states)), np.where(live, calcium, _REST_CALCIUM_UM)
        try:
            self._states = control.step_all(self.batch, states, goal, calcium, self._dt)
        except UserError:
            self._one_by_one(states, goal, calcium, live)
        self._ticks += 1

    def _one_by_one(self, states: Floats, goal: Floats, calcium: Floats, live: Flags) -> None:
        stepped = states.copy()
        for i in np.flatnonzero(live).tolist():
            try:
                muscle, here = self.batch.muscles[i], (float(goal[i]), float(calcium[i]))
                stepped[i] = self._control.step(muscle, states[i], *here, self._dt)
            except UserError as error:
                stepped[i] = self._rest[i]
                self._fail(i, error)
        self._states = stepped

    def _done(self) -> None:
        # Of ticks made up for only the newest is worth sending.
        run, which = self._samples.inputs.run, None
        if not (self._all_live and run is self._run):
            which = np.flatnonzero(self._live & (run == self._run))
            if not which.size:
                return
        states = self._states
        table, scales = outputs(self.batch, None, states), self._scale_out
        if which is not None:
            table, scales, states = table[which], scales[which], states[which]
        self._emit(self._clock_ns(), which, table, scales, *self._control.answers(states))

    def _fail(self, i: int, error: UserError) -> None:
        self._violations += isinstance(error, StateViolation)
        text = f"{error} (after {self._ticks * self._dt:.3f} s of stepping)"
        self._faults = {**self._faults, i: text}
        live = self._live.copy()
        live[i] = False
        self._use_live(live)
        self._log.error(f"{front(self._names, [i], ' ')}stopped: {text}; call ~/reset to start again")
