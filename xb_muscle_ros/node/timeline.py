"""What fibres in lockstep have taken: stamps, calcium, state, and what the next sample asks for."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.node.calcium import KEPT, CalciumHistory
from xb_muscle_ros.node.control import LENGTH, Control
from xb_muscle_ros.node.names import Indices
from xb_muscle_ros.node.plan import Numbers, Plan, States, let_pass, number, numbers
from xb_muscle_ros.node.rules import (
    NO_STAMP,
    VELOCITY_L0_PER_S,
    Counts,
    Refusal,
    Scale,
    follows,
    inside,
    out_of_order,
    outside,
    went_back,
)
from xb_muscle_ros.node.status import Account, Snapshot, no_state
from xb_muscle_ros.node.stepping import Flags, Floats


@dataclass
class Run:
    """What a reset forgets.

    Attributes:
        scale: in use, shape (fibres, 2): one L0 (m) and one F0 (N).
        states: shape (fibres, n).
        fault: why they stopped; empty where they did not.
    """

    scale: Floats
    states: States | None = None
    # Stamp (ns) and goals of the last sample of length or load, and until when calcium was asked for, ns.
    stamp: int = NO_STAMP
    goal: Numbers = 0.0
    asked: int = NO_STAMP
    calcium: CalciumHistory = field(default_factory=CalciumHistory)
    # Stamp of the last calcium sample of this run, ns; older ones may be left from before time went back.
    calcium_stamp: int = NO_STAMP
    # Calcium of a time that length has yet to go back to.
    coming: CalciumHistory = field(default_factory=CalciumHistory)
    fault: str = ""
    samples: int = 0
    calcium_samples: int = 0
    late: int = 0

    def account(self) -> Account:
        """What each fibre has taken."""
        return Account(self.samples, self.calcium_samples, self.late)

    def picked(self, which: Indices) -> Run:
        """The same for some of the fibres."""

        def pick(values: Numbers) -> Numbers:
            return numbers(np.atleast_1d(values)[which])

        return replace(
            self,
            scale=self.scale[which],
            states=None if self.states is None else np.asarray(self.states)[which],
            goal=pick(self.goal) if self.stamp != NO_STAMP else 0.0,
            calcium=self.calcium.each(pick),
            coming=self.coming.each(pick),
        )


class Timeline:
    """What fibres have taken that take the same samples, and what may come next; the stepping is left to others.

    Calcium is held from its stamp to the next one. The step that ends at t_k uses the newest calcium with a stamp not
    after t_(k-1), so that a calcium sample has one whole step's time to arrive. The first sample settles isometrically.

    Where time is simulated, a length sample whose stamp went back (see `went_back`) resets and settles anew.

    Attributes:
        fibres: whose, ascending; all that are named here by a place are named by a place in this list.
        run: since the last reset.
        next_scale: becomes the scale in use at the next reset.
    """

    def __init__(
        self,
        fibres: Sequence[int],
        scale: Floats,
        counts: Counts,
        simulated_time: Callable[[], bool],
        on_back: Callable[[Sequence[int], int, Account], None],
        control: Control = LENGTH,
    ) -> None:
        """Keep what is needed.

        Args:
            fibres: see above.
            scale: shape (fibres, 2), see `Run`.
            counts: of what was odd about the input that was taken nevertheless.
            simulated_time: whether time may go back.
            on_back: called where it did, with the fibres, the last stamp (ns) and what each had taken.
            control: what samples ask for.
        """
        self._control = control
        self.next_scale = scale
        self._counts = counts
        self._simulated_time = simulated_time
        self._on_back = on_back
        self._become(fibres, Run(scale.copy()))

    def _become(self, fibres: Sequence[int], run: Run) -> None:
        self.fibres = list(fibres)
        self.places: Indices = np.array(self.fibres, dtype=np.intp)
        self.run = run

    def part(self, stay: Flags) -> Timeline:
        """Let fibres go, who from now on take other samples than those that stay; returns their timeline."""
        run, fibres, scale = self.run, self.places, self.next_scale
        kept, gone = np.flatnonzero(stay), np.flatnonzero(~stay)
        other = Timeline(
            fibres[gone].tolist(), scale[gone], self._counts, self._simulated_time, self._on_back, self._control
        )
        other.run = run.picked(gone)
        self.next_scale = scale[kept]
        self._become(fibres[kept].tolist(), run.picked(kept))
        return other

    def reset(self) -> Account:
        """Forget state, stamps and calcium; the next length sample settles anew. Returns what each fibre had taken."""
        run, self.run = self.run, Run(self.next_scale.copy())
        return run.account()

    def save(self, place: int) -> Snapshot:
        """All that the answers of a fibre to later samples depend on.

        Raises:
            UserError: there is no state yet, or integration failed.
        """
        run = self.run
        if run.fault or run.states is None:
            raise no_state(run.fault, f"the first {self._control.topic} sample")
        calcium = run.calcium.each(lambda values: number(values, place))
        scale = Scale(*run.scale[place].tolist())
        return Snapshot(run.states[place], scale, calcium.kept(), run.stamp, run.asked, run.account())

    def load(self, snapshots: Sequence[Snapshot]) -> None:
        """Go on from snapshots, one for each fibre, which differ in values only; see `history`.

        The next length sample is the one after their last; all taken since is forgotten.
        """
        first = snapshots[0]
        run = self.run = Run(np.array([snapshot.scale for snapshot in snapshots]))
        states = run.states = np.stack([snapshot.state for snapshot in snapshots])
        run.goal = numbers(states[:, -3].copy())
        assert first.stamp is not None
        assert first.asked is not None
        run.stamp, run.asked = first.stamp, first.asked
        values = np.array([[value for _, value in snapshot.calcium] for snapshot in snapshots])
        for (stamp, _), calcium_um in zip(first.calcium, values.T, strict=True):
            run.calcium.add(stamp, numbers(calcium_um))
        run.calcium_stamp = run.calcium.last_stamp
        run.samples, run.calcium_samples, run.late = first.account

    def take_calcium(self, stamp: int, calcium_um: Numbers) -> None:
        """Keep calcium samples (stamp in ns, µM).

        Raises:
            Refusal: the stamp is not after the last one.
        """
        run, last = self.run, self.run.calcium_stamp
        if stamp <= last and self._simulated_time():
            if went_back(stamp, run.stamp):
                self._keep_for_later(stamp, calcium_um)
                return
            if went_back(stamp, last):
                # Length went back first; a straggler from before has no say in what comes after the last.
                last = NO_STAMP
        run.calcium_stamp = _after(stamp, last, "calcium")
        # Values from before time went back yield.
        run.calcium.add(stamp, calcium_um)
        run.calcium_samples += 1
        if stamp <= run.asked:
            # A step that should have used it is done: this run differs from an offline replay of the same samples.
            run.late += 1
            self._counts["late calcium"] += len(self.fibres)

    def plan(self, stamp: int, given: Numbers) -> Plan:
        """What a sample (stamp in ns, m or N) asks for; follow with `commit` or `failed`.

        Raises:
            Refusal: the sample cannot be integrated, by none of the fibres or by the only one.
            Divided: some of many fibres cannot integrate it, or none can, each for a reason of its own.
        """
        back = went_back(stamp, self.run.stamp) and self._simulated_time()
        if self.run.fault and not back:
            raise Refusal("stopped", "integration failed before; call ~/reset to start again")
        control = self._control
        unit = numbers((self.next_scale if back else self.run.scale)[:, control.unit])
        goal = control.goal(given, unit)
        let_pass(inside(goal, control.allowed), control.impossible, given, unit)
        if back:
            self._begin_again(stamp)
        run = self.run
        last = run.stamp
        stamp = _after(stamp, last, control.topic)
        asked = stamp if last == NO_STAMP else last
        calcium = run.calcium.at(asked)
        if calcium is None:
            remedy = "publish it first"
            if run.calcium.full:
                remedy = f"the newest {KEPT} are kept and all are later; publish less of it ahead of length"
            raise Refusal("waiting for calcium", f"none with a stamp up to {asked * 1e-9:.9f} s; {remedy}")
        if last == NO_STAMP:
            return Plan(stamp, asked, goal, calcium, None, 0.0)
        dt_s = (stamp - last) / 1e9
        if control is LENGTH:
            velocity = (goal - run.goal) / dt_s
            let_pass(inside(velocity, VELOCITY_L0_PER_S), _too_fast, velocity)
        return Plan(stamp, asked, goal, calcium, run.states, dt_s)

    def commit(self, plan: Plan, states: States) -> None:
        """Take a plan's result up, shape (fibres, n)."""
        run = self.run
        run.states, run.stamp, run.goal, run.asked = states, plan.stamp, plan.goal, plan.asked
        run.samples += 1

    def failed(self, plan: Plan, error: UserError) -> UserError:
        """Stop until the next reset, because a plan could not be integrated; returns what to say."""
        self.run.fault = f"{error} (in the step from {plan.asked * 1e-9:.9f} s to {plan.stamp * 1e-9:.9f} s)"
        return UserError(self.run.fault)

    def _keep_for_later(self, stamp: int, calcium_um: Numbers) -> None:
        """Calcium that came before the length that takes time back waits for it."""
        coming = self.run.coming
        last = coming.last_stamp
        coming.add(_after(stamp, NO_STAMP if went_back(stamp, last) else last, "calcium"), calcium_um)
        self._counts["calcium before its length went back"] += len(self.fibres)

    def _begin_again(self, stamp: int) -> None:
        old = self.run
        account = self.reset()
        run = self.run
        # Calcium from before that time still holds, unless newer has come for it.
        run.calcium = old.calcium
        run.calcium.cut(stamp + 1)
        for when, calcium_um in old.coming.kept():
            run.calcium.add(when, calcium_um)
        run.calcium_stamp = old.coming.last_stamp
        run.calcium_samples = len(old.coming.kept())
        self._counts["time went back"] += len(self.fibres)
        self._on_back(self.fibres, old.stamp, account)


def history(snapshot: Snapshot) -> object:
    """What snapshots have in common whose fibres took the same samples."""
    return snapshot.stamp, snapshot.asked, tuple(stamp for stamp, _ in snapshot.calcium), snapshot.account


def _too_fast(velocity_l0_per_s: float) -> Refusal:
    return outside(velocity_l0_per_s, VELOCITY_L0_PER_S, "velocity from the last sample to this", "L0/s")


def _after(stamp: int, last: int, what: str) -> int:
    """Return a stamp (ns) that follows the last one.

    Raises:
        Refusal: it does not.
    """
    if not follows(stamp, last):
        raise out_of_order(stamp, last, what)
    return stamp
