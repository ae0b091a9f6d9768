"""What many fibres in one node share: names in messages, and one line in the log for what befalls many at once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.node.inputs import Refusal, Scale, Strangers, check_one_per_name
from xb_muscle_ros.node.status import Log

Floats = npt.NDArray[np.float64]
Indices = npt.NDArray[np.intp]

# Stamp (ns), which fibres (None: all, in order), their outputs (fibre, name of `Outputs`) and scales (fibre, 2).
EmitMany = Callable[[int, "Indices | None", Floats, Floats], None]

_NAMES_SHOWN = 3


class Trouble(NamedTuple):
    """A sample of one fibre that was refused, or whose integration failed."""

    fibre: int
    error: Refusal | UserError


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


class NamesOfMany:
    """Finds the fibres in the names of a message, and remembers the names it does not know."""

    def __init__(self, fibres: Sequence[str]) -> None:
        self._index = {name: i for i, name in enumerate(fibres)}
        self._all = np.arange(len(fibres))
        self._strangers = Strangers()
        self._last: tuple[list[str], Places] = ([], Places(self._all, None, []))

    def places(self, names: Sequence[str], values: int, field: str) -> Places:
        """Which fibres the values of a message are of; of a name that comes twice the first counts.

        Args:
            names: of the message; empty stands for all fibres in order.
            values: how many the field holds.
            field: its name, for the message.

        Raises:
            Refusal: there are not as many values as names.
        """
        check_one_per_name(names, len(self._all), values, field)
        last, found = self._last
        if names != last:
            found = self._find(names)
            # New names are news only once.
            self._last = ([*names], found._replace(new=[]))
        return found

    def _find(self, names: Sequence[str]) -> Places:
        if not names:
            return Places(self._all, None, [])
        place: dict[int, int] = {}
        for k, name in enumerate(names):
            i = self._index.get(name)
            if i is not None:
                place.setdefault(i, k)
        new = self._strangers.news(name for name in names if name not in self._index)
        fibres, values = np.array([*place], dtype=np.intp), np.array([*place.values()], dtype=np.intp)
        in_order = len(values) == len(names) and np.array_equal(values, np.arange(len(names)))
        return Places(fibres, None if in_order else values, new)


def enumerated(names: Sequence[str]) -> str:
    """Some names, and how many more there are."""
    shown = ", ".join(names[:_NAMES_SHOWN])
    return shown if len(names) <= _NAMES_SHOWN else f"{shown} and {len(names) - _NAMES_SHOWN} more"


def scale_rows(scales: Sequence[Scale]) -> Floats:
    """One L0 (m) and one F0 (N) of each fibre, shape (fibres, 2)."""
    return np.array(scales, dtype=np.float64)


class Chorus:
    """A log for many fibres: what several say within one message is said once.

    Attributes:
        speaker: name of the fibre that is being served.
    """

    def __init__(self, log: Log) -> None:
        self.speaker = ""
        self._log = log
        self._said: dict[str, tuple[str, list[str]]] = {}

    def error(self, message: str) -> None:
        """Not used by the timelines of fibres; goes straight on."""
        self._log.error(message)

    def info(self, message: str) -> None:
        """Not used by the timelines of fibres; goes straight on."""
        self._log.info(message)

    def warning(self, message: str) -> None:
        """Keep it until `flush`; what begins alike counts as the same."""
        self._said.setdefault(message.partition(":")[0], (message, []))[1].append(self.speaker)

    def flush(self) -> None:
        """Say what was kept."""
        for message, speakers in self._said.values():
            self._log.warning(f"{enumerated(speakers)}: {message}")
        self._said.clear()
