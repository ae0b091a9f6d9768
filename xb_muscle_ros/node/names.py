"""Names of fibres: in messages that come, and in what is said of them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.node.rules import Refusal

Indices = npt.NDArray[np.intp]

KINDS_KEPT = 8
"""Lists of names that are remembered: as many senders may have a part of the fibres each."""
_NAMES_SHOWN, _LETTERS_SHOWN = 3, 100
# A sender that makes up names must not fill the memory.
_STRANGERS_KEPT = 1000


class Places(NamedTuple):
    """Where the fibres of a message are.

    Attributes:
        fibres: indices of the fibres, without repeats.
        values: for each, the index of its value in the message; None where every value is taken in order.
        new: names of other fibres that were not met before.
    """

    fibres: Indices
    values: Indices | None
    new: list[str]


class Names:
    """Finds the fibres in the names of a message, and remembers the names it does not know."""

    def __init__(self, fibres: Sequence[str]) -> None:
        self._index = {name: i for i, name in enumerate(fibres)}
        self._all = np.arange(len(fibres))
        self._strangers: set[str] = set()
        none: tuple[str, ...] = ()
        self._last = none, Places(self._all, None, [])
        self._known = dict([self._last])

    def places(self, names: Sequence[str], values: int, field: str) -> Places:
        """Which fibres the values of a message are of; of a name that comes twice the first counts.

        Args:
            names: of the message; empty stands for all fibres in order.
            values: how many the field holds.
            field: its name, for the message.

        Raises:
            Refusal: there are not as many values as names.
        """
        if values != (len(names) or len(self._all)):
            whom = f"{len(names)} names" if names else f"no names, which stand for all {len(self._all)} fibres"
            detail = f"{values} values in {field} for {whom}; send one per name"
            raise Refusal("wrong array size", detail)
        last, places = self._last
        if names is last:
            return places
        kind = tuple(names)
        found = self._known.get(kind)
        if found is not None:
            self._last = kind, found
            return found
        found = self._find(kind)
        if len(self._known) >= KINDS_KEPT:
            self._known.clear()
        # New names are news only once.
        self._known[kind] = found._replace(new=[])
        self._last = kind, self._known[kind]
        return found

    def _find(self, names: Sequence[str]) -> Places:
        if not names:
            return Places(self._all, None, [])
        place: dict[int, int] = {}
        for k, name in enumerate(names):
            i = self._index.get(name)
            if i is not None:
                place.setdefault(i, k)
        new = [name for name in dict.fromkeys(names) if name not in self._index and name not in self._strangers]
        if len(self._strangers) < _STRANGERS_KEPT:
            self._strangers.update(new)
        fibres, values = np.array([*place], dtype=np.intp), np.array([*place.values()], dtype=np.intp)
        in_order = len(values) == len(names) and np.array_equal(values, np.arange(len(names)))
        return Places(fibres, None if in_order else values, new)


def enumerated(names: Sequence[str]) -> str:
    """Some names, and how many more there are."""
    shown = ", ".join(
        name if len(name) <= _LETTERS_SHOWN else f"{name[:_LETTERS_SHOWN]}…" for name in names[:_NAMES_SHOWN]
    )
    return shown if len(names) <= _NAMES_SHOWN else f"{shown} and {len(names) - _NAMES_SHOWN} more"


def front(names: Sequence[str], which: Iterable[int], end: str = ": ", begin: str = "") -> str:
    """Whom a text is about, for its beginning: nothing in a node of one fibre, where it can be about no other."""
    return "" if len(names) == 1 else f"{begin}{enumerated([names[i] for i in which])}{end}"
