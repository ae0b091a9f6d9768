"""Lockstep: one step per length sample, by the samples' own stamps, so that the same input gives the same bits."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Sequence

import numpy as np

from xb_muscle_ros.errors import StateViolation, UserError
from xb_muscle_ros.models.batch import MuscleBatch
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.node.names import Indices, front
from xb_muscle_ros.node.rules import Counts, Refusal, Trouble, scale_of
from xb_muscle_ros.node.status import Account, Log, Snapshot, Status, time_went_back
from xb_muscle_ros.node.stepping import Emit, Floats, outputs, stopped, use_threads
from xb_muscle_ros.node.timeline import Plan, Timeline


class Lockstep:
    """Answers every length message at once, with the forces of the fibres it names; the others do not move.

    Every fibre has a `Timeline` of its own, so that its forces are those that a node with this one fibre would give.
    Those that go the same way are stepped in one call.

    Attributes:
        batch: what is stepped; fibres may be exchanged between messages.
        threads: that step together.
        counts: what was odd about the input that was taken nevertheless.
    """

    def __init__(
        self, batch: MuscleBatch, emit: Emit, log: Log, simulated_time: Callable[[], bool], threads: int = 1
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
        self._violations = 0
        self._emit = emit
        self._log = log
        self._names = [muscle.fibre.name for muscle in batch.muscles]
        # Whose time went back within a message, with the last stamp (ns) and what was taken until then.
        self._back: list[tuple[int, int, Account]] = []
        self._timelines = [
            Timeline(scale_of(muscle.fibre), self.counts, simulated_time, functools.partial(self._note_back, i))
            for i, muscle in enumerate(batch.muscles)
        ]
        self._use_scales()

    def start(self) -> None:
        """Samples drive it; only the number of threads is set, for the thread that calls."""
        use_threads(self.batch, self.threads)

    def stop(self) -> None:
        """Nothing to stop."""

    def replace(self, index: int, fibre: Fibre) -> None:
        """Go on with other parameters of one fibre; its constants count from its next reset on."""
        self.batch = self.batch.replaced(index, fibre)
        self._timelines[index].next_scale = scale_of(fibre)

    def reset(self) -> Account:
        """Forget all fibres' states, stamps and calcium. Returns what was taken until now, over all of them."""
        account = _total(timeline.reset() for timeline in self._timelines)
        self._use_scales()
        return account

    def save(self) -> tuple[Snapshot, ...]:
        """One snapshot for each fibre; see `Timeline.save`."""
        made = []
        for i, timeline in enumerate(self._timelines):
            try:
                made.append(timeline.save())
            except UserError as error:
                raise UserError(f"{front(self._names, [i], begin='fibre ')}{error}") from error
        return tuple(made)

    def load(self, snapshots: Sequence[Snapshot]) -> None:
        """Go on from snapshots, one for each fibre; see `Timeline.load`."""
        for timeline, snapshot in zip(self._timelines, snapshots, strict=True):
            timeline.load(snapshot)
        self._use_scales()

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
        for i, position in zip(fibres.tolist(), position_m.tolist(), strict=True):
            try:
                plans.append((i, self._timelines[i].plan(stamp, position)))
            except Refusal as refusal:
                troubles.append(Trouble(i, refusal))
        if self._back:
            which, last, taken = zip(*self._back, strict=True)
            self._log.warning(front(self._names, which) + time_went_back(last[0], stamp, _total(taken)))
            self._back.clear()
            self._use_scales()
        # The batch knows its fibres by their place.
        plans.sort()
        done, states = self._stepped(plans, troubles)
        if done:
            chosen = None if len(done) == len(self._timelines) else np.array(done, dtype=np.intp)
            self._answers += 1
            scales = self._scales if chosen is None else self._scales[chosen]
            self._emit(stamp, chosen, outputs(self.batch, chosen, states), scales)
        return troubles

    def status(self) -> Status:
        """How it goes, over all fibres."""
        waiting = [i for i, timeline in enumerate(self._timelines) if timeline.run.state is None]
        faults = {i: timeline.run.fault for i, timeline in enumerate(self._timelines) if timeline.run.fault}
        what = f"{front(self._names, waiting)}waiting for the first length sample and its calcium"
        return Status(self._answers, self._violations, stopped(self._names, faults), what if waiting else "")

    def _stepped(
        self, plans: Sequence[tuple[int, Plan]], troubles: list[Trouble]
    ) -> tuple[list[int], Sequence[Floats] | Floats]:
        """Fibres that came to the ends of their plans, and their states there; the others go to the troubles."""
        together = self._together([plan for _, plan in plans])
        if together is not None:
            for (i, plan), state in zip(plans, together, strict=True):
                self._timelines[i].commit(plan, state)
            return [i for i, _ in plans], together
        done, states = [], []
        for i, plan in plans:
            timeline = self._timelines[i]
            try:
                states.append(plan.step(self.batch.muscles[i]))
            except UserError as error:
                self._violations += isinstance(error, StateViolation)
                troubles.append(Trouble(i, timeline.failed(plan, error)))
                continue
            timeline.commit(plan, states[-1])
            done.append(i)
        return done, states

    def _together(self, plans: Sequence[Plan]) -> Floats | None:
        """States of all fibres at the ends of their plans; None where they cannot, or one need not, go in one call."""
        if len(plans) != len(self._timelines) or len(plans) == 1:
            return None
        dt_s = plans[0].dt_s
        if any(plan.state is None or plan.dt_s != dt_s for plan in plans):
            return None
        states = np.array([plan.state for plan in plans])
        change, calcium = np.array([(plan.change_l0, plan.calcium_um) for plan in plans]).T
        try:
            return self.batch.step(states, change, calcium, dt_s)
        except UserError:
            return None

    def _note_back(self, i: int, last: int, taken: Account) -> None:
        self._back.append((i, last, taken))

    def _use_scales(self) -> None:
        self._scales = np.array([timeline.run.scale for timeline in self._timelines])


def _total(accounts: Iterable[Account]) -> Account:
    """Sum over fibres."""
    return Account(*(sum(column) for column in zip(*accounts, strict=True)))
