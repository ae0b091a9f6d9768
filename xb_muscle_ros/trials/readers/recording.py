"""What a reader finds of one trial: signals as the file has them, before units and facts are applied."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.trial import Array


@dataclass(frozen=True)
class Signal:
    """Numbers of one signal in the unit of the file.

    Attributes:
        name: for messages, for example ``column 'force_n'``.
        values: shape (n,).
        at: where in the file a number is, for messages, for example ``line 7``; its argument counts from 0.
        times: shape (n,), in the unit of time, where the signal has a clock of its own; None for that of the lengths.
    """

    name: str
    values: Array
    at: Callable[[int], str]
    times: Array | None = None

    def place(self, where: str, i: int) -> str:
        """A number of the signal, for messages."""
        return f"{where}, {self.at(i)}, {self.name}"


@dataclass(frozen=True)
class Recording:
    """Signals and facts of one trial.

    Attributes:
        where: the file, and the trial within it where it holds several, for messages.
        trial: name of the trial.
        time, length: signals every trial has.
        force, calcium, stimulation: signals it may have.
        facts: pCa, amplitude (L0) and recovery (s) where the file tells them.
        notes: what the file tells about the trial, in words, for the bag's ``source``.
        warnings: what was wrong with the file and could be lived with.
        test_start_s: when the test stretch was to begin by what the file tells, in the trial's own time, s.
    """

    where: str
    trial: str
    time: Signal
    length: Signal
    force: Signal | None = None
    calcium: Signal | None = None
    stimulation: Signal | None = None
    facts: Mapping[str, float | None] = field(default_factory=lambda: MappingProxyType({}))
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    test_start_s: float | None = None

    def __post_init__(self) -> None:
        """Make sure that signals are whole: as many numbers as times, all of them finite.

        Raises:
            UserError: naming the signal and the first place at fault.
        """
        for signal in (self.time, self.length, self.force, self.calcium, self.stimulation):
            if signal is not None:
                self._check(signal)

    def _check(self, signal: Signal) -> None:
        times = self.time.values if signal.times is None else signal.times
        if signal.values.size == 0:
            raise UserError(f"{self.where}, {signal.name} has no samples; at least one is needed")
        if signal.values.shape != times.shape:
            raise UserError(
                f"{self.where}, {signal.name} has {signal.values.size} samples at {times.size} times; one each is "
                "needed"
            )
        bad = ~np.isfinite(signal.values)
        if bad.any():
            first = int(np.argmax(bad))
            after = np.flatnonzero(~bad[first:])
            run = int(after[0]) if after.size else bad.size - first
            more = f" (a run of {run})" if run > 1 else ""
            raise UserError(
                f"{signal.place(self.where, first)} is {signal.values[first]}{more}; allowed are finite numbers; "
                "mend or cut the record"
            )
