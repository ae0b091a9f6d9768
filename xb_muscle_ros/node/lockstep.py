"""Lockstep: one step per sample, by the samples' own stamps, so that the same input gives the same bits."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence

import numpy as np

from xb_muscle_ros.errors import StateViolation, UserError
from xb_muscle_ros.models.batch import MuscleBatch
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.node.control import LENGTH, Control
from xb_muscle_ros.node.names import Indices, front
from xb_muscle_ros.node.plan import Divided, Plan, States, numbers
from xb_muscle_ros.node.rules import Counts, Refusal, Trouble, scale_of
from xb_muscle_ros.node.status import Account, Log, Snapshot, Status, time_went_back
from xb_muscle_ros.node.stepping import Emit, Flags, Floats, outputs, stopped, use_threads
from xb_muscle_ros.node.timeline import Timeline, history


class Lockstep:
    """Answers every message of length or load at once, with the forces of the fibres it names; the others do not move.

    Forces are those that a node with the one fibre would give. Fibres have one `Timeline` together as long as they take
    the same samples, which a reset makes them begin anew; those that go the same way are stepped in one call.

    Attributes:
        batch: what is stepped; fibres may be exchanged between messages.
        threads: that step together.
        counts: what was odd about the input that was taken nevertheless.
    """

    def __init__(
        self,
        batch: MuscleBatch,
        emit: Emit,
        log: Log,
        simulated_time: Callable[[], bool],
        threads: int = 1,
        control: Control = LENGTH,
    ) -> None:
        """Keep what is needed.

        Args:
            batch, threads: see above.
            emit: called for every answer.
            log: told when time went back.
            simulated_time: whether time may go back.
            control: what samples ask for.
        """
        self.batch = batch
        self._control = control
        self.threads = threads
        self.counts = Counts()
        self._answers = 0
        self._violations = 0
        self._emit = emit
        self._log = log
        self._simulated_time = simulated_time
        self._names = [muscle.fibre.name for muscle in batch.muscles]
        self._every: Indices = np.arange(len(batch))
        # Fibres as they were named last; mostly they are named so again.
        self._named: Indices = self._every
        # Whose time went back within a message, with the last stamp (ns) and what each had taken until then.
        self._back: list[tuple[Sequence[int], int, Account]] = []
        self._next_scales = np.array([scale_of(muscle.fibre) for muscle in batch.muscles])
        self._timelines = [self._timeline(self._every)]
        self._use_scales()

    def start(self) -> None:
        """Samples drive it; only the number of threads is set, for the thread that calls."""
        use_threads(self.batch, self.threads)

    def stop(self) -> None:
        """Nothing to stop."""

    def replace(self, index: int, fibre: Fibre) -> None:
        """Go on with other parameters of one fibre; its constants count from its next reset on."""
        self.batch = self.batch.replaced(index, fibre)
        self._next_scales[index] = scale_of(fibre)
        for timeline in self._timelines:
            timeline.next_scale = self._next_scales[timeline.places]

    def reset(self) -> Account:
        """Forget all fibres' states, stamps and calcium. Returns what was taken until now, over all of them."""
        account = _total((timeline.fibres, timeline.run.account()) for timeline in self._timelines)
        self._timelines = [self._timeline(self._every)]
        self._use_scales()
        return account

    def save(self) -> tuple[Snapshot, ...]:
        """One snapshot for each fibre; see `Timeline.save`."""
        where = {i: (timeline, k) for timeline in self._timelines for k, i in enumerate(timeline.fibres)}
        made = []
        for i in range(len(self._names)):
            timeline, k = where[i]
            try:
                made.append(timeline.save(k))
            except UserError as error:
                raise UserError(f"{front(self._names, [i], begin='fibre ')}{error}") from error
        return tuple(made)

    def load(self, snapshots: Sequence[Snapshot]) -> None:
        """Go on from snapshots, one for each fibre; see `Timeline.load`."""
        alike: dict[object, list[int]] = {}
        for i, snapshot in enumerate(snapshots):
            alike.setdefault(history(snapshot), []).append(i)
        self._timelines = [self._timeline(np.array(which, dtype=np.intp)) for which in alike.values()]
        for timeline in self._timelines:
            timeline.load([snapshots[i] for i in timeline.fibres])
        self._use_scales()

    def take_calcium(self, stamp: int, fibres: Indices, calcium_um: Floats) -> list[Trouble]:
        """Keep calcium samples (µM) of some fibres with one stamp (ns); returns what was refused."""
        troubles: list[Trouble] = []
        for timeline, values in self._shares(fibres, calcium_um):
            try:
                timeline.take_calcium(stamp, numbers(values))
            except Refusal as refusal:
                troubles += [Trouble(i, refusal) for i in timeline.fibres]
        return troubles

    def take_length(self, stamp: int, fibres: Indices, given: Floats, velocity_m_per_s: Floats | None) -> list[Trouble]:
        """Step some fibres to lengths (m) or loads (N) of one stamp (ns) and emit their answers in one.

        Velocity is not needed here.

        Returns what was refused, and what failed and stays stopped until the next reset; other fibres do not mind.
        """
        del velocity_m_per_s
        troubles: list[Trouble] = []
        plans = []
        for timeline, values in self._shares(fibres, given):
            plan = self._plan(timeline, stamp, values, troubles)
            if plan is not None:
                plans.append((timeline, plan))
        if self._back:
            which = sorted(i for back, _, _ in self._back for i in back)
            taken = _total((back, account) for back, _, account in self._back)
            self._log.warning(
                front(self._names, which) + time_went_back(self._back[0][1], stamp, taken, self._control.topic)
            )
            self._back.clear()
            self._use_scales()
        done, states = self._stepped(plans, troubles)
        if done.size:
            chosen = None if done.size == len(self._names) else done
            self._answers += 1
            scales = self._scales if chosen is None else self._scales[chosen]
            self._emit(stamp, chosen, outputs(self.batch, chosen, states), scales, *self._control.answers(states))
        return troubles

    def status(self) -> Status:
        """How it goes, over all fibres."""
        waiting = sorted(i for timeline in self._timelines if timeline.run.states is None for i in timeline.fibres)
        faults = {i: timeline.run.fault for timeline in self._timelines if timeline.run.fault for i in timeline.fibres}
        what = f"{front(self._names, waiting)}waiting for the first {self._control.topic} sample and its calcium"
        return Status(self._answers, self._violations, stopped(self._names, faults), what if waiting else "")

    def _timeline(self, fibres: Indices) -> Timeline:
        scales = self._next_scales[fibres]
        return Timeline(fibres.tolist(), scales, self.counts, self._simulated_time, self._note_back, self._control)

    def _shares(self, fibres: Indices, values: Floats) -> Iterator[tuple[Timeline, Floats]]:
        """Timelines of the fibres that a message names, and their values; those that it names in part are parted."""
        if len(self._timelines) == 1 and (fibres is self._named or np.array_equal(fibres, self._every)):
            self._named = fibres
            yield self._timelines[0], values
            return
        place = np.full(len(self._names), -1, dtype=np.intp)
        place[fibres] = np.arange(fibres.size)
        for timeline in tuple(self._timelines):
            named = place[timeline.places] >= 0
            if not named.any():
                continue
            if not named.all():
                self._part(timeline, named)
            yield timeline, values[place[timeline.places]]

    def _part(self, timeline: Timeline, stay: Flags) -> Timeline:
        other = timeline.part(stay)
        self._timelines.append(other)
        return other

    def _plan(self, timeline: Timeline, stamp: int, values: Floats, troubles: list[Trouble]) -> Plan | None:
        """What a sample asks for of the fibres of a timeline that can take it; the others go to the troubles."""
        try:
            return timeline.plan(stamp, numbers(values))
        except Refusal as refusal:
            troubles += [Trouble(i, refusal) for i in timeline.fibres]
        except Divided as divided:
            troubles += [Trouble(timeline.fibres[k], refusal) for k, refusal in divided.refused.items()]
            if divided.good.any():
                self._part(timeline, divided.good)
                return self._plan(timeline, stamp, values[divided.good], troubles)
        return None

    def _stepped(self, plans: Sequence[tuple[Timeline, Plan]], troubles: list[Trouble]) -> tuple[Indices, States]:
        """Fibres that came to the ends of their plans, ascending, and their states there; others go to the troubles."""
        together = self._together(plans)
        if together is not None:
            for timeline, plan in plans:
                timeline.commit(plan, together if len(plans) == 1 else together[timeline.places])
            return self._every, together
        parts = [self._one_by_one(timeline, plan, troubles) for timeline, plan in plans]
        if len(parts) == 1:
            return parts[0]
        done = np.concatenate([fibres for fibres, _ in parts]) if parts else np.empty(0, dtype=np.intp)
        order = np.argsort(done)
        return done[order], np.array([state for _, states in parts for state in states])[order]

    def _one_by_one(self, timeline: Timeline, plan: Plan, troubles: list[Trouble]) -> tuple[Indices, States]:
        """Fibres of a timeline that came to the end of its plan, and their states there.

        Those that fail go to the troubles, and have a timeline of their own from now on.
        """
        states = []
        failed: dict[int, UserError] = {}
        for k, i in enumerate(timeline.fibres):
            try:
                states.append(plan.step(self.batch, i, k, self._control))
            except UserError as error:
                self._violations += isinstance(error, StateViolation)
                failed[i] = error
        if not failed:
            timeline.commit(plan, states)
            return timeline.places, states
        done = np.array([i for i in timeline.fibres if i not in failed], dtype=np.intp)
        for i, why in failed.items():
            one = timeline
            if len(timeline.fibres) > 1:
                stay = timeline.places != i
                one, plan = self._part(timeline, stay), plan.picked(np.flatnonzero(stay))
            troubles.append(Trouble(i, one.failed(plan, why)))
        if states:
            timeline.commit(plan, states)
        return done, states

    def _together(self, plans: Sequence[tuple[Timeline, Plan]]) -> Floats | None:
        """States of all fibres at the ends of their plans; None where they cannot, or one need not, go in one call."""
        count = len(self._names)
        if count == 1 or sum(len(timeline.fibres) for timeline, _ in plans) != count:
            return None
        dt_s = plans[0][1].dt_s
        if any(plan.states is None or plan.dt_s != dt_s for _, plan in plans):
            return None
        if len(plans) == 1:
            states, goals, calcium = plans[0][1].states, plans[0][1].goal, plans[0][1].calcium_um
            assert states is not None
            states = np.asarray(states)
        else:
            goals, calcium = np.empty((2, count))
            states = np.empty((count, len(self.batch.state_names)))
            for timeline, plan in plans:
                at = timeline.places
                states[at], goals[at], calcium[at] = plan.states, plan.goal, plan.calcium_um
        try:
            return self._control.step_all(self.batch, states, goals, calcium, dt_s)
        except UserError:
            return None

    def _note_back(self, fibres: Sequence[int], last: int, taken: Account) -> None:
        self._back.append((fibres, last, taken))

    def _use_scales(self) -> None:
        scales = np.empty((len(self._names), 2))
        for timeline in self._timelines:
            scales[timeline.places] = timeline.run.scale
        self._scales = scales


def _total(taken: Iterable[tuple[Sequence[int], Account]]) -> Account:
    """Sum over fibres of what each of some took."""
    made = np.zeros(len(Account._fields), dtype=np.int64)
    for fibres, account in taken:
        made += len(fibres) * np.array(account)
    return Account(*made.tolist())
