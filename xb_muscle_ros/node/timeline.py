"""What a fibre in lockstep has taken: stamps, calcium, state, and what the next sample asks for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.node.calcium import KEPT, CalciumHistory
from xb_muscle_ros.node.rules import (
    LENGTH_CHANGE_L0,
    NO_STAMP,
    VELOCITY_L0_PER_S,
    Counts,
    Refusal,
    Scale,
    follows,
    impossible_length,
    inside,
    length_change_l0,
    out_of_order,
    outside,
    went_back,
)
from xb_muscle_ros.node.status import Account, Snapshot, no_state


class Plan(NamedTuple):
    """A length sample that can be integrated.

    Attributes:
        stamp, asked: of the sample, and until when calcium was asked for, ns.
        change_l0, calcium_um: to step to, and with.
        state: to step from; None: settle.
        dt_s: from the last sample; 0 where there is none.
    """

    stamp: int
    asked: int
    change_l0: float
    calcium_um: float
    state: npt.NDArray[np.float64] | None
    dt_s: float

    def step(self, muscle: Muscle) -> npt.NDArray[np.float64]:
        """State at its end.

        Raises:
            UserError, StateViolation: see `Muscle`.
        """
        if self.state is None:
            return muscle.settle(self.change_l0, self.calcium_um)
        return muscle.step(self.state, self.change_l0, self.calcium_um, self.dt_s)


@dataclass
class Run:
    """What a reset forgets.

    Attributes:
        scale: in use.
        fault: why it stopped; empty where it did not.
    """

    scale: Scale
    state: npt.NDArray[np.float64] | None = None
    # Stamp (ns) and length change (L0) of the last length sample, and until when calcium was asked for, ns.
    stamp: int = NO_STAMP
    change: float = 0.0
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
        """What was taken."""
        return Account(self.samples, self.calcium_samples, self.late)


class Timeline:
    """What one fibre has taken and what may come next; the stepping itself is left to others.

    Calcium is held from its stamp to the next one. The step that ends at t_k uses the newest calcium with a stamp not
    after t_(k-1), so that a calcium sample has one whole step's time to arrive. The first sample settles isometrically.

    Where time is simulated, a length sample whose stamp went back (see `went_back`) resets and settles anew.

    Attributes:
        run: since the last reset.
        next_scale: becomes the scale in use at the next reset.
    """

    def __init__(
        self, scale: Scale, counts: Counts, simulated_time: Callable[[], bool], on_back: Callable[[int, Account], None]
    ) -> None:
        """Keep what is needed.

        Args:
            scale: see above.
            counts: of what was odd about the input that was taken nevertheless.
            simulated_time: whether time may go back.
            on_back: called where it did, with the last stamp (ns) and what had been taken.
        """
        self.next_scale = scale
        self._counts = counts
        self._simulated_time = simulated_time
        self._on_back = on_back
        self.run = Run(scale)

    def reset(self) -> Account:
        """Forget state, stamps and calcium; the next length sample settles anew. Returns what was taken until now."""
        run, self.run = self.run, Run(self.next_scale)
        return run.account()

    def save(self) -> Snapshot:
        """All that the answers to later samples depend on.

        Raises:
            UserError: there is no state yet, or integration failed.
        """
        run = self.run
        if run.fault or run.state is None:
            raise no_state(run.fault, "the first length sample")
        return Snapshot(run.state, run.scale, run.calcium.kept(), run.stamp, run.asked, run.account())

    def load(self, snapshot: Snapshot) -> None:
        """Go on from a snapshot: the next length sample is the one after its last; all taken since is forgotten."""
        run = self.run = Run(snapshot.scale)
        run.state = snapshot.state
        run.change = float(snapshot.state[-3])
        assert snapshot.stamp is not None
        assert snapshot.asked is not None
        run.stamp, run.asked = snapshot.stamp, snapshot.asked
        for stamp, calcium_um in snapshot.calcium:
            run.calcium.add(stamp, calcium_um)
        run.calcium_stamp = run.calcium.last_stamp
        run.samples, run.calcium_samples, run.late = snapshot.account

    def take_calcium(self, stamp: int, calcium_um: float) -> None:
        """Keep a calcium sample (stamp in ns, µM).

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
            self._counts["late calcium"] += 1

    def plan(self, stamp: int, position_m: float) -> Plan:
        """What a length sample (stamp in ns, m) asks for; follow with `commit` or `failed`.

        Raises:
            Refusal: the sample cannot be integrated.
        """
        back = went_back(stamp, self.run.stamp) and self._simulated_time()
        if self.run.fault and not back:
            raise Refusal("stopped", "integration failed before; call ~/reset to start again")
        reference = (self.next_scale if back else self.run.scale).reference_length_m
        change = length_change_l0(position_m, reference)
        if not inside(change, LENGTH_CHANGE_L0):
            raise impossible_length(position_m, reference)
        if back:
            self._begin_again(stamp)
        run = self.run
        last = run.stamp
        stamp = _after(stamp, last, "length")
        asked = stamp if last == NO_STAMP else last
        calcium = run.calcium.at(asked)
        if calcium is None:
            remedy = "publish it first"
            if run.calcium.full:
                remedy = f"the newest {KEPT} are kept and all are later; publish less of it ahead of length"
            raise Refusal("waiting for calcium", f"none with a stamp up to {asked * 1e-9:.9f} s; {remedy}")
        if last == NO_STAMP:
            return Plan(stamp, asked, change, calcium, None, 0.0)
        dt_s = (stamp - last) / 1e9
        velocity = (change - run.change) / dt_s
        if not inside(velocity, VELOCITY_L0_PER_S):
            raise outside(velocity, VELOCITY_L0_PER_S, "velocity from the last sample to this", "L0/s")
        return Plan(stamp, asked, change, calcium, run.state, dt_s)

    def commit(self, plan: Plan, state: npt.NDArray[np.float64]) -> None:
        """Take a plan's result up."""
        run = self.run
        run.state, run.stamp, run.change, run.asked = state, plan.stamp, plan.change_l0, plan.asked
        run.samples += 1

    def failed(self, plan: Plan, error: UserError) -> UserError:
        """Stop until the next reset, because a plan could not be integrated; returns what to say."""
        self.run.fault = f"{error} (in the step from {plan.asked * 1e-9:.9f} s to {plan.stamp * 1e-9:.9f} s)"
        return UserError(self.run.fault)

    def _keep_for_later(self, stamp: int, calcium_um: float) -> None:
        """Calcium that came before the length that takes time back waits for it."""
        coming = self.run.coming
        last = coming.last_stamp
        coming.add(_after(stamp, NO_STAMP if went_back(stamp, last) else last, "calcium"), calcium_um)
        self._counts["calcium before its length went back"] += 1

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
        self._counts["time went back"] += 1
        self._on_back(old.stamp, account)


def _after(stamp: int, last: int, what: str) -> int:
    """Return a stamp (ns) that follows the last one.

    Raises:
        Refusal: it does not.
    """
    if not follows(stamp, last):
        raise out_of_order(stamp, last, what)
    return stamp
