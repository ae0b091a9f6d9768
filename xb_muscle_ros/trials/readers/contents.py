"""What is in a file, before anything is said of what it means: signals under the names and units the file has."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from xb_muscle_ros.trials.trial import Array


@dataclass(frozen=True)
class Content:
    """One signal of a file.

    Attributes:
        name: as a mapping names it: the column, channel or topic.
        values: shape (n,); NaN where the file has no number.
        unit: as the file tells it beside the name; empty where it does not, or has it within the name.
        field: of a topic's messages; empty elsewhere.
        told_role: what the signal is by the format itself (``time``, ``length``, ...); empty where the format does
            not tell.
        told_not: why it is none of the signals of a recording, where the format tells; empty elsewhere.
        told_more: what a mapping has to say of it beside name and unit, by the format itself.
        times_s: shape (n,), a clock of its own, s; None where another signal of the file is the clock.
        clock: how a mapping names that clock, for example ``header``.
        of: what a signal without name of its own is of, for messages, for example the type of a topic's messages.
        faults: what keeps it from being read as it is, one line each.
        at: where in the file a number is, for messages; its argument counts from 0.
    """

    name: str
    values: Array
    unit: str = ""
    field: str = ""
    told_role: str = ""
    told_not: str = ""
    told_more: Mapping[str, str] = dataclasses.field(default_factory=dict)
    times_s: Array | None = None
    clock: str = ""
    of: str = ""
    faults: tuple[str, ...] = ()
    at: Callable[[int], str] = "sample {}".format

    @property
    def label(self) -> str:
        """Its name for people."""
        return f"{self.name} {self.field}".strip()

    @property
    def finite(self) -> Array:
        """Its numbers."""
        found: Array = self.values[np.isfinite(self.values)]
        return found


@dataclass(frozen=True)
class Contents:
    """What is in a file.

    Attributes:
        format: in words: encoding, delimiter, version, whatever tells the file from others of its kind.
        signals: in the order of the file.
        trials: names of the trials, where the format tells; signals are then those of the first.
        facts: what the file tells beside its signals, by name, as text.
        others: what is there and is no signal, one line each.
        notes: what was wrong or found out, one line each.
        sheets: of a workbook, those with the columns of the one that is shown, itself among them.
        rate: samples in a second and where that is told, where no signal has to tell the times.
        in_header: of ``f0`` and ``reference_length``, what an import takes from the file itself.
    """

    format: str
    signals: tuple[Content, ...]
    trials: tuple[str, ...] = ()
    facts: Mapping[str, str] = dataclasses.field(default_factory=dict)
    others: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    in_header: tuple[str, ...] = ()
    rate: tuple[float, str] | None = None
    sheets: tuple[str, ...] = ()
