"""What a muscle may be given: lengths that a fibre can have, calcium that is there, time that goes on."""

from __future__ import annotations

import math
from typing import NoReturn

import numpy as np
import numpy.typing as npt
from numba import njit

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.composition import INPUTS

Array = npt.NDArray[np.float64]

_ROWS = {row.name: row for row in INPUTS}
SHORTEST_L0, LONGEST_L0 = _ROWS["length_change"].lower, _ROWS["length_change"].upper
"""Length changes that a step takes, L0: the shortest fibre has no length left."""
MOST_CALCIUM_UM = _ROWS["calcium"].upper
LONGEST_S = 1e7
"""Longest step, s."""


def check(fibre: str, length_change_l0: float, calcium_um: float, dt_s: float = 1.0) -> None:
    """Check one step's input; three comparisons, some 0.1 µs.

    Args:
        fibre: named in the message.
        length_change_l0, calcium_um: L0 and µM.
        dt_s: duration, s.

    Raises:
        UserError: out of range or not a number.
    """
    # Written so that a NaN fails the comparison.
    if (
        SHORTEST_L0 <= length_change_l0 <= LONGEST_L0
        and 0.0 <= calcium_um <= MOST_CALCIUM_UM
        and 0.0 < dt_s <= LONGEST_S
    ):
        return
    _refuse(f"fibre {fibre}", length_change_l0, calcium_um, dt_s)


def check_many(
    fibres: tuple[str, ...], states: Array, columns: int, length_change_l0: Array, calcium_um: Array, dt_s: float
) -> None:
    """Check one step's input of many fibres: some 1 µs for 10 fibres, 4 µs for 1000.

    Args:
        fibres: names, for the message.
        states: shape (fibres, columns).
        columns: entries of a state.
        length_change_l0, calcium_um: shape (fibres,), L0 and µM.
        dt_s: duration, s.

    Raises:
        UserError: out of range, not a number, or of another shape; names the first fibre at fault.
    """
    count = len(fibres)
    check_states(states, count, columns)
    for name, values in (("length changes", length_change_l0), ("calcium", calcium_um)):
        if values.shape != (count,):
            raise UserError(f"{name} of {count} fibres has shape {values.shape}; needed is ({count},)")
    if getattr(dt_s, "shape", ()):
        raise UserError(f"step of {count} fibres is an array; needed is one number of seconds for all")
    k = first_refused(length_change_l0, calcium_um)
    if k < 0 and 0.0 < dt_s <= LONGEST_S:
        return
    k = max(int(k), 0)
    _refuse(f"fibre {fibres[k]}", float(length_change_l0[k]), float(calcium_um[k]), dt_s)


def check_states(states: Array, count: int, columns: int) -> None:
    """See whether compiled loops may be given states, which they take as they are.

    Args:
        states: shape (fibres, columns).
        count: fibres.
        columns: entries of a state.

    Raises:
        UserError: they have another shape, or are not 64-bit numbers.
    """
    if states.shape != (count, columns) or states.dtype != np.float64:
        raise UserError(
            f"states of {count} fibres have shape {states.shape} of {states.dtype}; needed is ({count}, {columns}) of "
            "float64"
        )


def check_samples(fibre: str, dt_s: Array, length_change_l0: Array, calcium_um: Array, first: int = 0) -> None:
    """Check the samples of a run, in one pass.

    Args:
        fibre: named in the message.
        dt_s: shape (n - 1,), from each sample to the next, s.
        length_change_l0, calcium_um: shape (n,), L0 and µM.
        first: which sample of all the first one is, for the message.

    Raises:
        UserError: out of range, not a number, or of another length; names the first sample at fault.
    """
    size = length_change_l0.size
    if dt_s.shape != (size - 1,) or calcium_um.shape != (size,):
        raise UserError(
            f"fibre {fibre}: {size} lengths, {calcium_um.size} values of calcium and {dt_s.size} steps; needed are as "
            "many lengths as values of calcium, and one step less"
        )
    k = first_refused(length_change_l0, calcium_um)
    if k >= 0:
        _refuse(f"fibre {fibre}, sample {first + k}", float(length_change_l0[k]), float(calcium_um[k]), 1.0)
    if size > 1 and not (dt_s.min() > 0.0 and dt_s.max() <= LONGEST_S):
        k = int(np.flatnonzero(~((dt_s > 0.0) & (dt_s <= LONGEST_S)))[0])
        _refuse(f"fibre {fibre}, sample {first + k + 1}", 0.0, 0.0, float(dt_s[k]))


def check_loads(fibre: str, dt_s: Array, load_f0: Array, calcium_um: Array) -> None:
    """Check the samples of a force clamp.

    Args:
        fibre: named in the message.
        dt_s: shape (n - 1,), from each sample to the next, s.
        load_f0, calcium_um: shape (n,), F0 and µM.

    Raises:
        UserError: out of range, not a number, or of another length; names the first sample at fault.
    """
    if load_f0.shape != calcium_um.shape:
        raise UserError(
            f"fibre {fibre}: {load_f0.size} loads and {calcium_um.size} values of calcium; needed are as many of both"
        )
    check_samples(fibre, dt_s, np.zeros(load_f0.size), calcium_um)
    if not np.isfinite(load_f0).all():
        k = int(np.flatnonzero(~np.isfinite(load_f0))[0])
        check_load(f"{fibre}, sample {k}", float(load_f0[k]))


def check_load(fibre: str, load_f0: float) -> None:
    """Check one load.

    Raises:
        UserError: not a number.
    """
    if not math.isfinite(load_f0):
        raise UserError(f"fibre {fibre}: load is {load_f0:g} F0; allowed is any number; give the force to hold, F0")


def check_limits(fibre: str, shortest_l0: float, longest_l0: float, now_l0: float) -> None:
    """Check the limits between which a length is looked for, from the one that the fibre has now on.

    Raises:
        UserError: not in order, or beyond what a step takes, or the length now is beyond them.
    """
    if not SHORTEST_L0 <= shortest_l0 < longest_l0 <= LONGEST_L0:
        raise UserError(
            f"fibre {fibre}: limits of the length change are {shortest_l0:g} and {longest_l0:g} L0; allowed are two "
            f"between {SHORTEST_L0:g} and {LONGEST_L0:g}, the shorter first"
        )
    if not shortest_l0 <= now_l0 <= longest_l0:
        raise UserError(
            f"fibre {fibre}: its length change is {now_l0:.6g} L0, beyond the limits {shortest_l0:g} to {longest_l0:g} "
            "between which loads are borne; begin from a length within them"
        )


@njit(cache=True)
def first_refused(length_change_l0: Array, calcium_um: Array) -> int:
    """Place of the first pair that is out of range or not a number, else -1."""
    for k in range(length_change_l0.size):
        if not (SHORTEST_L0 <= length_change_l0[k] <= LONGEST_L0 and 0.0 <= calcium_um[k] <= MOST_CALCIUM_UM):
            return k
    return -1


def _refuse(where: str, length_change_l0: float, calcium_um: float, dt_s: float) -> NoReturn:
    """Say which of them is at fault.

    Raises:
        UserError: always.
    """
    if not SHORTEST_L0 <= length_change_l0 <= LONGEST_L0:
        what = (
            f"length change is {length_change_l0:g} L0; allowed is {SHORTEST_L0:g} to {LONGEST_L0:g} (0 is rest, "
            f"{SHORTEST_L0:g} no length at all)"
        )
    elif not 0.0 <= calcium_um <= MOST_CALCIUM_UM:
        what = f"calcium is {calcium_um:g} µM; allowed is 0 to {MOST_CALCIUM_UM:g} (10^(6 - pCa) µM)"
    else:
        what = f"step is {dt_s:g} s; allowed is above 0 to {LONGEST_S:g}"
    missing = math.isnan(length_change_l0 + calcium_um + dt_s)
    raise UserError(f"{where}: {what}{'; a value is missing' if missing else ''}")
