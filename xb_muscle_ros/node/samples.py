"""The newest samples of many fibres: written by callbacks, read by the thread that ticks."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

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
from xb_muscle_ros.node.several import Floats, Indices, Trouble, enumerated
from xb_muscle_ros.node.status import Account, Log, time_went_back

Flags = npt.NDArray[np.bool_]
Stamps = npt.NDArray[np.int64]

_NO_STAMP = -(2**63)


class Inputs(NamedTuple):
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


class Samples:
    """Takes samples, refuses what cannot be used, and remembers which fibres are to settle anew.

    Attributes:
        inputs, pending: newest samples, and fibres (flags) that were reset since `take_up`; each replaced, never
            changed. Reading both without the lock, read `inputs` first.
        next_scale: shape (fibres, 2), becomes the scale in use at a fibre's next reset.
        counts: what was odd about the input that was taken nevertheless.
        taken: length and calcium samples of each fibre since its last reset, shape (fibres, 2).
    """

    def __init__(self, names: Sequence[str], scale: Floats, log: Log, simulated_time: Callable[[], bool]) -> None:
        """Know nothing yet.

        Args:
            names: of the fibres.
            scale: see `next_scale`.
            log: told when time went back.
            simulated_time: whether the time of stamps may go back.
        """
        count = len(names)
        none = np.full(count, np.nan)
        self.next_scale = scale
        self.counts = Counts()
        self.inputs = Inputs(none, none, none, np.zeros(count, dtype=np.int64), scale.copy())
        self.pending = np.ones(count, dtype=np.bool_)
        self.taken = np.zeros((count, 2), dtype=np.int64)
        self._names = names
        self._log = log
        self._simulated_time = simulated_time
        # Callbacks replace inputs and ask for resets under it; the thread takes both up together.
        self._lock = threading.Lock()
        self._length_stamps = np.full(count, _NO_STAMP, dtype=np.int64)
        self._calcium_stamps = self._length_stamps.copy()

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
        values = self.inputs.calcium_um.copy()
        values[fibres] = calcium_um
        self.taken[fibres, 1] += 1
        with self._lock:
            self.inputs = self.inputs._replace(calcium_um=values)
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
        reference = np.where(back, self.next_scale[fibres, 0], self.inputs.scale[fibres, 0])
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
        self.taken[fibres, 0] += 1
        old = self.inputs
        changes, rates, arrivals = old.change_l0.copy(), old.velocity_l0_per_s.copy(), old.arrival_ns.copy()
        changes[fibres], rates[fibres], arrivals[fibres] = change, rate, time.monotonic_ns()
        with self._lock:
            self.inputs = old._replace(change_l0=changes, velocity_l0_per_s=rates, arrival_ns=arrivals)
        return troubles

    def forget(self, which: Indices) -> None:
        """Forget some fibres' lengths and states; newest calcium is kept, as in `Realtime.reset`."""
        self._length_stamps[which] = self._calcium_stamps[which] = _NO_STAMP
        self.taken[which] = 0
        inputs = self.inputs
        change, scale = inputs.change_l0.copy(), inputs.scale.copy()
        change[which] = np.nan
        scale[which] = self.next_scale[which]
        pending = self.pending.copy()
        pending[which] = True
        with self._lock:
            self.inputs = inputs._replace(change_l0=change, scale=scale)
            self.pending = pending

    def take_up(self) -> tuple[Inputs, Flags]:
        """Newest inputs, and the fibres that were reset since the last call."""
        with self._lock:
            inputs, pending = self.inputs, self.pending
            if pending.any():
                self.pending = np.zeros_like(pending)
        return inputs, pending

    def put(self, inputs: Inputs) -> None:
        """Go on with samples from elsewhere; stamps are as after a reset."""
        with self._lock:
            self.inputs = inputs

    def _begin_again(self, stamp: int, back: Indices, last: int) -> None:
        taken = Account(*self.taken[back].sum(axis=0).tolist())
        self.counts["time went back"] += len(back)
        who = enumerated([self._names[i] for i in back.tolist()])
        self._log.warning(f"{who}: {time_went_back(last, stamp, taken)}")
        self.forget(back)


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
