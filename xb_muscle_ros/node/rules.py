"""The rules for input: stamps that follow each other, time that has gone back, numbers that can be meant.

A rule is a predicate, for one value or for an array of them, and the refusal of one value that fails it.
"""

from __future__ import annotations

import math
from collections import Counter
from typing import Any, NamedTuple

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.fibre_file import Fibre

# What any muscle may be asked for. Wider than muscle works in, narrower than a mistaken unit.
LENGTH_CHANGE_L0 = (-0.5, 0.5)
LOAD_F0 = (-1.0, 10.0)
CALCIUM_UM = (0.0, 1e4)
VELOCITY_L0_PER_S = (-1e3, 1e3)
LONGEST_GAP_S = 3600.0
# Messages that overtake each other do so by milliseconds; a bag that starts again goes back by its whole length.
BACK_S = 0.1
NO_STAMP = -(2**63)
"""In the place of the last stamp where there is none."""

_GAP_NS, _BACK_NS = round(LONGEST_GAP_S * 1e9), round(BACK_S * 1e9)


class Refusal(Exception):
    """Input that is not integrated.

    Attributes:
        reason: one of a few short words to count by.
    """

    def __init__(self, reason: str, detail: str) -> None:
        super().__init__(f"{reason}: {detail}")
        self.reason = reason


class Trouble(NamedTuple):
    """A sample of one fibre that was refused, or whose integration failed."""

    fibre: int
    error: Refusal | UserError


class Scale(NamedTuple):
    """What one L0 and one F0 are; both are constants of a fibre."""

    reference_length_m: float
    f0_n: float


def scale_of(fibre: Fibre) -> Scale:
    """Constants of a fibre."""
    return Scale(fibre.reference_length_m, fibre.f0_n)


def stamp_ns(stamp: Any) -> int:
    """Time in ns of a builtin_interfaces/Time."""
    return int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)


def inside(values: Any, bounds: tuple[float, float]) -> Any:
    """Whether a value, or each of an array, is a number within bounds."""
    return (values >= bounds[0]) & (values <= bounds[1])


def outside(value: float, bounds: tuple[float, float], what: str, unit: str, remedy: str = "") -> Refusal:
    """The refusal of a value that is not `inside`; `remedy` ends it."""
    if not math.isfinite(value):
        return Refusal("not finite", f"{what} is {value}; send finite numbers")
    allowed = f"allowed is {bounds[0]:g} to {bounds[1]:g} {unit}"
    return Refusal("out of range", f"{what} is {value:g} {unit}; {allowed}{'; ' if remedy else ''}{remedy}")


def length_change_l0(position_m: Any, reference_m: Any) -> Any:
    """Length change relative to rest in L0, as the offline replay computes it; `position_m` is the fibre's length."""
    return position_m / reference_m - 1.0


def impossible_length(position_m: float, reference_m: float) -> Refusal:
    """The refusal of a length (m) whose change is outside `LENGTH_CHANGE_L0`."""
    remedy = f"send m, with 1 L0 = {reference_m:g} m (constants.reference_length_m)"
    what = f"length change (position {position_m:g} m)"
    return outside(length_change_l0(position_m, reference_m), LENGTH_CHANGE_L0, what, "L0", remedy)


def load_f0(force_n: Any, f0_n: Any) -> Any:
    """Load in F0; `force_n` is the force that the fibre is to bear, N."""
    return force_n / f0_n


def impossible_load(force_n: float, f0_n: float) -> Refusal:
    """The refusal of a load (N) outside `LOAD_F0`."""
    remedy = f"send N, with 1 F0 = {f0_n:g} N (constants.f0_n)"
    return outside(load_f0(force_n, f0_n), LOAD_F0, f"load (effort {force_n:g} N)", "F0", remedy)


def follows(stamp: int, last: Any) -> Any:
    """Whether a stamp (ns) comes after the last one, or after each of an array, and not absurdly long after it."""
    return (last == NO_STAMP) | ((last < stamp) & (last >= stamp - _GAP_NS))


def out_of_order(stamp: int, last: int, what: str) -> Refusal:
    """The refusal of a stamp (ns) that does not follow the last one: `what` is its sample's quantity."""
    told = f"{what} at {stamp * 1e-9:.9f} s came after {last * 1e-9:.9f} s"
    if stamp <= last:
        # Nobody's clock shows zero twice: the sender leaves stamps out.
        remedy = "call ~/reset to start again" if stamp else "give each message a stamp of its own"
        return Refusal("stamp not after the last", f"{told}; {remedy}")
    return Refusal(
        "stamp too far ahead",
        f"{told}; allowed is {LONGEST_GAP_S:g} s; send stamps of one clock, and call ~/reset where it changes",
    )


def went_back(stamp: int, last: Any) -> Any:
    """Whether a stamp (ns) lies so far before the last that time itself must have gone back: by more than 0.1 s."""
    return (last != NO_STAMP) & (stamp < last - _BACK_NS)


class Counts(Counter[str]):
    """How often each reason occurred, and how many since the last look."""

    def __init__(self) -> None:
        super().__init__()
        self._looked = 0

    def new(self) -> int:
        """How many were counted since the last call."""
        total = sum(self.values())
        new, self._looked = total - self._looked, total
        return new
