"""What a fibre in lockstep has taken: stamps, calcium, state, and what the next sample asks for."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.errors import StateViolation, UserError
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.node.inputs import (
    CALCIUM_KEPT,
    VELOCITY_L0_PER_S,
    CalciumHistory,
    Counts,
    Refusal,
    Scale,
    after,
    checked,
    length_change_l0,
    went_back,
)
from xb_muscle_ros.node.status import Account, Log, Snapshot, Status, time_went_back


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


class Timeline:
    """What one fibre has taken and what may come next; the stepping itself is left to others.

    Calcium is held from its stamp to the next one. The step that ends at t_k uses the newest calcium with a stamp not
    after t_(k-1), so that a calcium sample has one whole step's time to arrive. The first sample settles isometrically.

    Where time is simulated, a length sample whose stamp went back (see `went_back`) resets and settles anew.

    Attributes:
        next_scale: becomes the scale in use at the next reset.
        counts: what was odd about the input that was taken nevertheless.
    """

    def __init__(self, scale: Scale, log: Log, simulated_time: Callable[[], bool]) -> None:
        """Keep what is needed.

        Args:
            scale: see above.
            log: told when time went back.
            simulated_time: whether time may go back.
        """
        self.next_scale = scale
        self.counts = Counts()
        self._log = log
        self._simulated_time = simulated_time
        self._samples = 0
        self._violations = 0
        self._run = _Run(scale)

    @property
    def scale(self) -> Scale:
        """The scale in use."""
        return self._run.scale

    def reset(self) -> Account:
        """Forget state, stamps and calcium; the next length sample settles anew. Returns what was taken until now."""
        run, self._run = self._run, _Run(self.next_scale)
        return run.account()

    def save(self) -> Snapshot:
        """All that the answers to later samples depend on.

        Raises:
            UserError: there is no state yet, or integration failed.
        """
        run = self._run
        if run.fault:
            raise UserError(f"there is no state to save, stepping has stopped: {run.fault}; call ~/reset first")
        if run.state is None:
            raise UserError("there is no state to save yet: the fibre settles with the first length sample")
        return Snapshot(run.state, run.scale, run.calcium.kept(), run.stamp, run.asked, run.account())

    def load(self, snapshot: Snapshot) -> None:
        """Go on from a snapshot: the next length sample is the one after its last; all taken since is forgotten."""
        run = self._run = _Run(snapshot.scale)
        run.state = snapshot.state
        run.change = float(snapshot.state[-3])
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
        run, last = self._run, self._run.calcium_stamp
        if last is not None and stamp <= last and self._simulated_time():
            if went_back(stamp, run.stamp):
                self._keep_for_later(stamp, calcium_um)
                return
            if went_back(stamp, last):
                # Length went back first; a straggler from before has no say in what comes after the last.
                last = None
        run.calcium_stamp = after(stamp, last, "calcium")
        # Values from before time went back yield.
        run.calcium.cut(stamp)
        run.calcium.add(stamp, calcium_um)
        run.calcium_samples += 1
        if run.asked is not None and stamp <= run.asked:
            # A step that should have used it is done: this run differs from an offline replay of the same samples.
            run.late += 1
            self.counts["late calcium"] += 1

    def plan(self, stamp: int, position_m: float) -> Plan:
        """What a length sample (stamp in ns, m) asks for; follow with `commit` or `failed`.

        Raises:
            Refusal: the sample cannot be integrated.
        """
        back = went_back(stamp, self._run.stamp) and self._simulated_time()
        if self._run.fault and not back:
            raise Refusal("stopped", "integration failed before; call ~/reset to start again")
        change = length_change_l0(position_m, self.next_scale if back else self._run.scale)
        if back:
            self._begin_again(stamp)
        run = self._run
        last = run.stamp
        stamp = after(stamp, last, "length")
        asked = stamp if last is None else last
        calcium = run.calcium.at(asked)
        if calcium is None:
            remedy = "publish it first"
            if run.calcium.full:
                remedy = f"the newest {CALCIUM_KEPT} are kept and all are later; publish less of it ahead of length"
            raise Refusal("waiting for calcium", f"none with a stamp up to {asked * 1e-9:.9f} s; {remedy}")
        if last is None:
            return Plan(stamp, asked, change, calcium, None, 0.0)
        dt_s = (stamp - last) / 1e9
        checked((change - run.change) / dt_s, VELOCITY_L0_PER_S, "velocity from the last sample to this", "L0/s")
        return Plan(stamp, asked, change, calcium, run.state, dt_s)

    def commit(self, plan: Plan, state: npt.NDArray[np.float64]) -> None:
        """Take a plan's result up."""
        run = self._run
        run.state, run.stamp, run.change, run.asked = state, plan.stamp, plan.change_l0, plan.asked
        run.samples += 1
        self._samples += 1

    def failed(self, plan: Plan, error: UserError) -> UserError:
        """Stop until the next reset, because a plan could not be integrated; returns what to say."""
        self._violations += isinstance(error, StateViolation)
        self._run.fault = f"{error} (in the step from {plan.asked * 1e-9:.9f} s to {plan.stamp * 1e-9:.9f} s)"
        return UserError(self._run.fault)

    def status(self) -> Status:
        """How it goes."""
        waiting = "" if self._run.state is not None else "waiting for the first length sample and its calcium"
        return Status(ticks=self._samples, violations=self._violations, fault=self._run.fault, waiting=waiting)

    def _keep_for_later(self, stamp: int, calcium_um: float) -> None:
        """Calcium that came before the length that takes time back waits for it."""
        coming = self._run.coming
        last = coming.last_stamp
        if went_back(stamp, last):
            coming.cut(stamp)
            last = None
        coming.add(after(stamp, last, "calcium"), calcium_um)
        self.counts["calcium before its length went back"] += 1

    def _begin_again(self, stamp: int) -> None:
        old = self._run
        account = self.reset()
        run = self._run
        # Calcium from before that time still holds, unless newer has come for it.
        run.calcium = old.calcium
        run.calcium.cut(stamp + 1)
        for when, calcium_um in old.coming.kept():
            run.calcium.cut(when)
            run.calcium.add(when, calcium_um)
        run.calcium_stamp = old.coming.last_stamp
        run.calcium_samples = len(old.coming.kept())
        self.counts["time went back"] += 1
        assert old.stamp is not None
        self._log.warning(time_went_back(old.stamp, stamp, account))


def stepped(muscle: Muscle, plan: Plan) -> npt.NDArray[np.float64]:
    """State at the end of a plan.

    Raises:
        UserError, StateViolation: see `Muscle`.
    """
    if plan.state is None:
        return muscle.settle(plan.change_l0, plan.calcium_um)
    return muscle.step(plan.state, plan.change_l0, plan.calcium_um, plan.dt_s)


class _Run:
    """What a reset forgets."""

    def __init__(self, scale: Scale) -> None:
        self.scale = scale
        self.state: npt.NDArray[np.float64] | None = None
        # Stamp (ns) and length change (L0) of the last length sample, and until when calcium was asked for, ns.
        self.stamp: int | None = None
        self.change = 0.0
        self.asked: int | None = None
        self.calcium = CalciumHistory()
        # Stamp of the last calcium sample of this run, ns; older ones may be left from before time went back.
        self.calcium_stamp: int | None = None
        # Calcium of a time that length has yet to go back to.
        self.coming = CalciumHistory()
        self.fault = ""
        self.samples = 0
        self.calcium_samples = 0
        self.late = 0

    def account(self) -> Account:
        """What was taken."""
        return Account(self.samples, self.calcium_samples, self.late)
