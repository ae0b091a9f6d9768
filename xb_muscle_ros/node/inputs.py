"""From messages to numbers a fibre can be stepped with; what cannot be is refused with a reason, and counted."""

from __future__ import annotations

import math
from collections import Counter, deque
from collections.abc import Iterable, Sequence
from typing import NamedTuple, Protocol

from xb_muscle_ros.models.fibre_file import Fibre

# What any muscle may be asked for. Wider than muscle works in, narrower than a mistaken unit.
LENGTH_CHANGE_L0 = (-0.5, 0.5)
CALCIUM_UM = (0.0, 1e4)
VELOCITY_L0_PER_S = (-1e3, 1e3)
LONGEST_GAP_S = 3600.0
# Messages that overtake each other do so by milliseconds; a bag that starts again goes back by its whole length.
BACK_S = 0.1

# Samples of calcium ahead of length.
CALCIUM_KEPT = 1024


class Refusal(Exception):
    """Input that is not integrated.

    Attributes:
        reason: one of a few short words to count by.
    """

    def __init__(self, reason: str, detail: str) -> None:
        super().__init__(f"{reason}: {detail}")
        self.reason = reason


class Stamp(Protocol):
    """builtin_interfaces/Time."""

    sec: int
    nanosec: int


class Scale(NamedTuple):
    """What one L0 and one F0 are; both are constants of a fibre."""

    reference_length_m: float
    f0_n: float


def scale_of(fibre: Fibre) -> Scale:
    """Constants of a fibre."""
    return Scale(fibre.reference_length_m, fibre.f0_n)


def stamp_ns(stamp: Stamp) -> int:
    """Time of a message in ns."""
    return int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec)


def check_one_per_name(names: Sequence[str], fibres: int, values: int, field: str) -> None:
    """Check that a message has a value for each of its names; without names, for each of the node's fibres.

    Raises:
        Refusal: it has not.
    """
    if values != (len(names) or fibres):
        raise Refusal("wrong array size", f"{values} values in {field} for {len(names)} names; send one per name")


class Strangers:
    """Names of fibres that a node does not have, each news once."""

    def __init__(self) -> None:
        self._seen: set[str] = set()

    def news(self, names: Iterable[str]) -> list[str]:
        """Those that were not met before."""
        new = [name for name in dict.fromkeys(names) if name not in self._seen]
        # A sender that makes up names must not fill the memory.
        if len(self._seen) < 1000:
            self._seen.update(new)
        return new


class Names:
    """Finds a fibre in the names of a message, and remembers the names it does not know."""

    def __init__(self, fibre: str) -> None:
        self._fibre = fibre
        self._strangers = Strangers()

    def index(self, names: Sequence[str], values: int, field: str) -> int | None:
        """Index of the fibre among the values of a message; None where the message is for other fibres.

        Args:
            names: of the message; empty stands for the fibre itself.
            values: how many the field holds.
            field: name of the field, for the message.

        Raises:
            Refusal: there are not as many values as names.
        """
        check_one_per_name(names, 1, values, field)
        if not names:
            return 0
        return next((i for i, name in enumerate(names) if name == self._fibre), None)

    def news(self, names: Sequence[str]) -> list[str]:
        """Names of other fibres that were not met before."""
        return self._strangers.news(name for name in names if name != self._fibre)


def checked(value: float, bounds: tuple[float, float], what: str, unit: str, remedy: str = "") -> float:
    """Return a value within its bounds; `remedy` ends what is said of one that is not.

    Raises:
        Refusal: not finite, or out of bounds.
    """
    if not math.isfinite(value):
        raise Refusal("not finite", f"{what} is {value}; send finite numbers")
    if not bounds[0] <= value <= bounds[1]:
        allowed = f"allowed is {bounds[0]:g} to {bounds[1]:g} {unit}"
        raise Refusal("out of range", f"{what} is {value:g} {unit}; {allowed}{'; ' if remedy else ''}{remedy}")
    return value


def length_change_l0(position_m: float, scale: Scale) -> float:
    """Length change relative to rest in L0, as the offline replay computes it; `position_m` is the fibre's length.

    Raises:
        Refusal: see `checked`.
    """
    change = position_m / scale.reference_length_m - 1.0
    what = f"length change (position {position_m:g} m)"
    remedy = f"send m, with 1 L0 = {scale.reference_length_m:g} m (constants.reference_length_m)"
    return checked(change, LENGTH_CHANGE_L0, what, "L0", remedy)


def after(stamp: int, last: int | None, what: str) -> int:
    """Return a stamp (ns) that comes after the last one, and not absurdly long after it.

    Raises:
        Refusal: the stamp is not after the last, or more than an hour after it.
    """
    if last is None:
        return stamp
    if stamp <= last:
        # Nobody's clock shows zero twice: the sender leaves stamps out.
        remedy = "call ~/reset to start again" if stamp else "give each message a stamp of its own"
        raise Refusal(
            "stamp not after the last",
            f"{what} at {stamp * 1e-9:.9f} s came after {last * 1e-9:.9f} s; {remedy}",
        )
    if stamp - last > LONGEST_GAP_S * 1e9:
        raise Refusal(
            "stamp too far ahead",
            f"{what} at {stamp * 1e-9:.9f} s came after {last * 1e-9:.9f} s; allowed is {LONGEST_GAP_S:g} s; "
            "send stamps of one clock, and call ~/reset where it changes",
        )
    return stamp


def went_back(stamp: int, last: int | None) -> bool:
    """Whether a stamp (ns) lies so far before the last one that time itself must have gone back: by more than 0.1 s."""
    return last is not None and last - stamp > BACK_S * 1e9


class CalciumHistory:
    """Calcium by stamp, held until the next one; keeps only what a later question can need."""

    def __init__(self) -> None:
        self._kept: deque[tuple[int, float]] = deque(maxlen=CALCIUM_KEPT)

    @property
    def last_stamp(self) -> int | None:
        """Stamp of the newest value, ns."""
        return self._kept[-1][0] if self._kept else None

    @property
    def full(self) -> bool:
        """Whether the oldest values may have been given up for newer ones."""
        return len(self._kept) == CALCIUM_KEPT

    def add(self, stamp: int, calcium_um: float) -> None:
        """Append a value (µM) that holds from `stamp` (ns) on; stamps ascend."""
        self._kept.append((stamp, calcium_um))

    def at(self, stamp: int) -> float | None:
        """Newest value (µM) with a stamp not after `stamp` (ns); None where there is none. Questions ascend in time."""
        kept = self._kept
        while len(kept) > 1 and kept[1][0] <= stamp:
            kept.popleft()
        return kept[0][1] if kept and kept[0][0] <= stamp else None

    def cut(self, stamp: int) -> None:
        """Forget values that hold from `stamp` (ns) or later on."""
        while self._kept and self._kept[-1][0] >= stamp:
            self._kept.pop()

    def kept(self) -> tuple[tuple[int, float], ...]:
        """Stamps (ns) and values (µM) that later questions can need."""
        return tuple(self._kept)


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
