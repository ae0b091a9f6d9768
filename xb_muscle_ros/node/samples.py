"""The newest samples of a realtime node's fibres: put in place by callbacks, read by the thread that ticks."""

# mypy: allow-untyped-decorators

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from numba import njit

from xb_muscle_ros.node.control import LENGTH, Control
from xb_muscle_ros.node.names import Indices, front
from xb_muscle_ros.node.rules import (
    LENGTH_CHANGE_L0,
    NO_STAMP,
    VELOCITY_L0_PER_S,
    Counts,
    Trouble,
    follows,
    inside,
    length_change_l0,
    out_of_order,
    outside,
    went_back,
)
from xb_muscle_ros.node.status import Account, Log, time_went_back
from xb_muscle_ros.node.stepping import Flags, Floats

Stamps = npt.NDArray[np.int64]

_NO_VELOCITY = np.empty(0)
# The rules themselves, for one value, within compiled loops.
_inside, _follows, _length_change_l0 = njit(inside), njit(follows), njit(length_change_l0)


class Inputs(NamedTuple):
    """The newest samples, shape (fibres,), never changed but replaced; NaN where there is none.

    Attributes:
        goal: length change, L0, or load, F0.
        velocity_l0_per_s, calcium_um: velocity is NaN also where a sample came without.
        arrival_ns, oldest_ns: steady time of the samples of length or load, and of the oldest of them.
        scale: in use, shape (fibres, 2): one L0 (m) and one F0 (N).
        run: counts the resets of each fibre; the same array as long as there is none.
    """

    goal: Floats
    velocity_l0_per_s: Floats
    calcium_um: Floats
    arrival_ns: Stamps
    oldest_ns: int
    scale: Floats
    run: Stamps

    def carried_on(self, time_ns: int, limit_s: float) -> Floats:
        """Length changes carried on by their velocities, where there are any and they lead to what is allowed."""
        carried: Floats = _carried_on(self.goal, self.velocity_l0_per_s, self.arrival_ns, time_ns, limit_s)
        return carried


@njit(cache=True)
def _carried_on(
    change_l0: Floats, velocity_l0_per_s: Floats, arrival_ns: Stamps, time_ns: int, limit_s: float
) -> Floats:
    """See `Inputs.carried_on`."""
    carried = change_l0.copy()
    for k in range(carried.size):
        ahead_s = min(max((time_ns - arrival_ns[k]) * 1e-9, 0.0), limit_s)
        change = change_l0[k] + velocity_l0_per_s[k] * ahead_s
        # Where the velocity would lead out of what is allowed, or there is none, the sample is the better guess.
        if _inside(change, LENGTH_CHANGE_L0):
            carried[k] = change
    return carried


@njit(cache=True)
def _judged(
    stamp: int, position_m: Floats, velocity_m_per_s: Floats, reference_m: Floats, last: Stamps
) -> tuple[Floats, Floats, Flags, bool]:
    """Length changes (L0), velocities (L0/s; NaN where there are none), who can take them, and whether all can.

    Args:
        stamp, last: of the sample and of each fibre's last one, ns; a stamp of 0 follows any.
        position_m, velocity_m_per_s: shape (fibres,), the latter may be empty.
        reference_m: one L0 of each fibre.
    """
    change, rate = np.empty(position_m.size), np.full(position_m.size, np.nan)
    good = np.empty(position_m.size, dtype=np.bool_)
    all_good = True
    for k in range(change.size):
        change[k] = _length_change_l0(position_m[k], reference_m[k])
        good[k] = _inside(change[k], LENGTH_CHANGE_L0) and (stamp == 0 or _follows(stamp, last[k]))
        if velocity_m_per_s.size:
            rate[k] = velocity_m_per_s[k] / reference_m[k]
            good[k] = good[k] and _inside(rate[k], VELOCITY_L0_PER_S)
        all_good = all_good and good[k]
    return change, rate, good, all_good


@njit(cache=True)
def _put(
    fibres: Indices, change: Floats, rate: Floats, now_ns: int, changes: Floats, rates: Floats, arrivals: Stamps
) -> int:
    """Put what came for some fibres among that of all; returns the oldest arrival, ns."""
    for k in range(fibres.size):
        i = fibres[k]
        changes[i], rates[i], arrivals[i] = change[k], rate[k], now_ns
    return int(arrivals.min())


class Samples:
    """Takes samples, refuses what cannot be used, and counts resets, after which a fibre is to settle anew.

    One thread writes; another may read `inputs` at any time, since it is replaced as one.

    Attributes:
        inputs: newest samples.
        next_scale: shape (fibres, 2), becomes the scale in use at a fibre's next reset.
        counts: what was odd about the input that was taken nevertheless.
        taken: samples of length (or load) and calcium of each fibre since its last reset, shape (fibres, 2).
    """

    def __init__(
        self,
        names: Sequence[str],
        scale: Floats,
        log: Log,
        simulated_time: Callable[[], bool],
        control: Control = LENGTH,
    ) -> None:
        """Know nothing yet.

        Args:
            names: of the fibres.
            scale: see `next_scale`.
            log: told when time went back.
            simulated_time: whether the time of stamps may go back.
            control: what samples ask for.
        """
        self._control = control
        count = len(names)
        none, zero = np.full(count, np.nan), np.zeros(count, dtype=np.int64)
        self.inputs = Inputs(none, none, none, zero, 0, scale.copy(), zero)
        self.next_scale = scale
        self.counts = Counts()
        self.taken = np.zeros((count, 2), dtype=np.int64)
        self._names = names
        self._log = log
        self._simulated_time = simulated_time
        self._length_stamps = np.full(count, NO_STAMP, dtype=np.int64)
        self._calcium_stamps = self._length_stamps.copy()
        # Neither the first tick nor the first message shall wait for a compiler.
        self.inputs.carried_on(0, 0.0)
        change, rate, *_ = _judged(0, none, _NO_VELOCITY, none, zero)
        _put(np.arange(0), change[:0], rate[:0], 0, none.copy(), none.copy(), zero.copy())

    def take_calcium(self, stamp: int, fibres: Indices, calcium_um: Floats) -> list[Trouble]:
        """Use calcium (µM) of some fibres from the next tick on; a stamp of 0 stands for an unstamped message."""
        troubles: list[Trouble] = []
        if stamp != 0:
            last = self._calcium_stamps[fibres]
            good = follows(stamp, last)
            if self._simulated_time():
                good |= went_back(stamp, last)
            if not good.all():
                for k in np.flatnonzero(~good).tolist():
                    troubles.append(Trouble(int(fibres[k]), out_of_order(stamp, int(last[k]), "calcium")))
                fibres, calcium_um = fibres[good], calcium_um[good]
            self._calcium_stamps[fibres] = stamp
        values = self.inputs.calcium_um.copy()
        values[fibres] = calcium_um
        self.taken[fibres, 1] += 1
        self.inputs = self.inputs._replace(calcium_um=values)
        return troubles

    def take_length(self, stamp: int, fibres: Indices, given: Floats, velocity_m_per_s: Floats | None) -> list[Trouble]:
        """Use lengths (m, m/s or None) or loads (N) of some fibres from the next tick on; see `take_calcium`."""
        control = self._control
        old, last, back = self.inputs, self._length_stamps[fibres], None
        unit = old.scale[fibres, control.unit]
        if stamp != 0 and self._simulated_time():
            back = went_back(stamp, last)
            last = np.where(back, NO_STAMP, last)
            unit = np.where(back, self.next_scale[fibres, control.unit], unit)
        if control is LENGTH:
            velocity = _NO_VELOCITY if velocity_m_per_s is None else velocity_m_per_s
            goal, rate, good, all_good = _judged(stamp, given, velocity, unit, last)
        else:
            goal, rate = control.goal(given, unit), np.full(given.size, np.nan)
            good = inside(goal, control.allowed) & (np.full(given.size, stamp == 0) | follows(stamp, last))
            all_good = bool(good.all())
        troubles = []
        if not all_good:
            for k in np.flatnonzero(~good).tolist():
                why = outside(float(rate[k]), VELOCITY_L0_PER_S, "velocity", "L0/s")
                if stamp != 0 and not follows(stamp, int(last[k])):
                    why = out_of_order(stamp, int(last[k]), control.topic)
                elif not inside(goal[k], control.allowed):
                    why = control.impossible(float(given[k]), float(unit[k]))
                troubles.append(Trouble(int(fibres[k]), why))
            fibres, goal, rate = fibres[good], goal[good], rate[good]
        if back is not None and (back & good).any():
            self._begin_again(stamp, fibres[back[good]])
            old = self.inputs
        if stamp != 0:
            self._length_stamps[fibres] = stamp
        self.taken[fibres, 0] += 1
        goals, rates, arrivals = old.goal.copy(), old.velocity_l0_per_s.copy(), old.arrival_ns.copy()
        oldest = _put(fibres, goal, rate, time.monotonic_ns(), goals, rates, arrivals)
        self.inputs = Inputs(goals, rates, old.calcium_um, arrivals, oldest, old.scale, old.run)
        return troubles

    def forget(self, which: Indices) -> None:
        """Forget some fibres' lengths and stamps.

        The newest calcium is kept: it holds whatever the clock of the samples says.
        """
        self._length_stamps[which] = self._calcium_stamps[which] = NO_STAMP
        self.taken[which] = 0
        inputs = self.inputs
        goal, scale, run = inputs.goal.copy(), inputs.scale.copy(), inputs.run.copy()
        goal[which] = np.nan
        scale[which] = self.next_scale[which]
        run[which] += 1
        self.inputs = inputs._replace(goal=goal, scale=scale, run=run)

    def _begin_again(self, stamp: int, back: Indices) -> None:
        last = int(self._length_stamps[back[0]])
        taken = Account(*self.taken[back].sum(axis=0).tolist())
        self.counts["time went back"] += len(back)
        self._log.warning(front(self._names, back.tolist()) + time_went_back(last, stamp, taken, self._control.topic))
        self.forget(back)
