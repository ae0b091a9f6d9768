"""Lockstep for many fibres: each as in a node of its own, those that go the same way stepped in one call."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

import numba
import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.batch import MuscleBatch
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.node.inputs import Counts, Refusal, scale_of
from xb_muscle_ros.node.several import Chorus, EmitMany, Floats, Indices, Trouble, enumerated, scale_rows
from xb_muscle_ros.node.status import Account, Log, Snapshot, Status
from xb_muscle_ros.node.timeline import Plan, Timeline, stepped


class LockstepMany:
    """Answers every length message with the forces of the fibres it names; the others do not move.

    Every fibre has a `Timeline` of its own, so that its forces are those that a node with this one fibre would give.

    Attributes:
        batch: what is stepped; fibres may be exchanged between messages.
        threads: that step together.
        counts: what was odd about the input that was taken nevertheless.
    """

    def __init__(
        self, batch: MuscleBatch, emit: EmitMany, log: Log, simulated_time: Callable[[], bool], threads: int = 1
    ) -> None:
        """Keep what is needed.

        Args:
            batch, threads: see above.
            emit: called for every answer.
            log: told when time went back.
            simulated_time: whether time may go back.
        """
        self.batch = batch
        self.threads = threads
        self.counts = Counts()
        self._answers = 0
        self._emit = emit
        self._chorus = Chorus(log)
        self._timelines = tuple(Timeline(scale_of(m.fibre), self._chorus, simulated_time) for m in batch.muscles)
        for timeline in self._timelines:
            timeline.counts = self.counts
        self._scales = scale_rows([timeline.scale for timeline in self._timelines])

    @property
    def muscles(self) -> tuple[Muscle, ...]:
        """One for each fibre, in order."""
        return self.batch.muscles

    def start(self) -> None:
        """Samples drive it; only the number of threads is set, for the thread that calls."""
        use_threads(self.threads)

    def stop(self) -> None:
        """Nothing to stop."""

    def replace(self, index: int, fibre: Fibre) -> None:
        """Go on with other parameters of one fibre; its constants count from its next reset on."""
        self.batch = self.batch.replaced(index, fibre)
        self._timelines[index].next_scale = scale_of(fibre)

    def reset(self) -> Account:
        """Forget all fibres' states, stamps and calcium. Returns what was taken until now, over all of them."""
        account = total(timeline.reset() for timeline in self._timelines)
        self._scales = scale_rows([timeline.scale for timeline in self._timelines])
        return account

    def save(self) -> tuple[Snapshot, ...]:
        """One snapshot for each fibre; see `Timeline.save`."""
        made = []
        for muscle, timeline in zip(self.muscles, self._timelines, strict=True):
            try:
                made.append(timeline.save())
            except UserError as error:
                raise UserError(f"fibre {muscle.fibre.name}: {error}") from error
        return tuple(made)

    def load(self, snapshots: Sequence[Snapshot]) -> None:
        """Go on from snapshots, one for each fibre; see `Timeline.load`."""
        for timeline, snapshot in zip(self._timelines, snapshots, strict=True):
            timeline.load(snapshot)
        self._scales = scale_rows([timeline.scale for timeline in self._timelines])

    def take_calcium(self, stamp: int, fibres: Indices, calcium_um: Floats) -> list[Trouble]:
        """Keep calcium samples (µM) of some fibres with one stamp (ns); returns what was refused."""
        troubles = []
        for i, value in zip(fibres.tolist(), calcium_um.tolist(), strict=True):
            try:
                self._timelines[i].take_calcium(stamp, value)
            except Refusal as refusal:
                troubles.append(Trouble(i, refusal))
        return troubles

    def take_length(
        self, stamp: int, fibres: Indices, position_m: Floats, velocity_m_per_s: Floats | None
    ) -> list[Trouble]:
        """Step some fibres to lengths (m) of one stamp (ns) and emit their answers in one; velocity is not needed here.

        Returns what was refused, and what failed and stays stopped until the next reset; other fibres do not mind.
        """
        del velocity_m_per_s
        troubles: list[Trouble] = []
        plans: list[tuple[int, Plan]] = []
        again = self.counts["time went back"]
        for i, position in zip(fibres.tolist(), position_m.tolist(), strict=True):
            self._chorus.speaker = self.muscles[i].fibre.name
            try:
                plans.append((i, self._timelines[i].plan(stamp, position)))
            except Refusal as refusal:
                troubles.append(Trouble(i, refusal))
        if self.counts["time went back"] != again:
            self._chorus.flush()
            self._scales = scale_rows([timeline.scale for timeline in self._timelines])
        # The batch knows its fibres by their place.
        plans.sort(key=lambda entry: entry[0])
        states = self._together(plans)
        if states is not None:
            for (i, plan), state in zip(plans, states, strict=True):
                self._timelines[i].commit(plan, state)
            self._answers += 1
            self._emit(stamp, None, self.batch.output_table(states), self._scales)
        elif plans:
            self._one_by_one(stamp, plans, troubles)
        return troubles

    def status(self) -> Status:
        """How it goes, over all fibres."""
        each = [timeline.status() for timeline in self._timelines]
        names = [muscle.fibre.name for muscle in self.muscles]
        waiting = [name for name, status in zip(names, each, strict=True) if status.waiting]
        faults = [f"{name}: {status.fault}" for name, status in zip(names, each, strict=True) if status.fault]
        return Status(
            ticks=self._answers,
            violations=sum(status.violations for status in each),
            fault=stopped(faults, len(each)),
            waiting=f"{enumerated(waiting)}: waiting for the first length sample and its calcium" if waiting else "",
        )

    def _together(self, plans: list[tuple[int, Plan]]) -> Floats | None:
        """States of all fibres at the ends of their plans; None where they cannot go in one call."""
        if len(plans) != len(self._timelines):
            return None
        dt_s = plans[0][1].dt_s
        if any(plan.state is None or plan.dt_s != dt_s for _, plan in plans):
            return None
        states = np.array([plan.state for _, plan in plans])
        change = np.array([plan.change_l0 for _, plan in plans])
        calcium = np.array([plan.calcium_um for _, plan in plans])
        try:
            return self.batch.step(states, change, calcium, dt_s)
        except UserError:
            return None

    def _one_by_one(self, stamp: int, plans: list[tuple[int, Plan]], troubles: list[Trouble]) -> None:
        done: list[int] = []
        rows = []
        for i, plan in plans:
            muscle, timeline = self.muscles[i], self._timelines[i]
            try:
                state = stepped(muscle, plan)
            except UserError as error:
                troubles.append(Trouble(i, timeline.failed(plan, error)))
                continue
            timeline.commit(plan, state)
            done.append(i)
            rows.append(muscle.outputs(state))
        if done:
            self._answers += 1
            which = np.array(done, dtype=np.intp)
            self._emit(stamp, which, np.array(rows), self._scales[which])


def total(accounts: Iterable[Account]) -> Account:
    """Sum over fibres."""
    return Account(*(sum(column) for column in zip(*accounts, strict=True)))


def stopped(faults: Sequence[str], fibres: int) -> str:
    """Why some fibres stopped; empty where none did."""
    return f"{len(faults)} of {fibres} fibres; {faults[0]}" if faults else ""


def use_threads(threads: int) -> None:
    """Let batches that this thread steps use so many threads, at most one for each core."""
    numba.set_num_threads(min(threads, numba.config.NUMBA_NUM_THREADS))
