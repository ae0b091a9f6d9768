"""What a reader is, and what it finds of a trial: signals as the file has them, before units and facts are applied."""

from __future__ import annotations

import abc
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.readers.columns import FILE
from xb_muscle_ros.trials.readers.contents import Content, Contents
from xb_muscle_ros.trials.readers.description import ImportMapping
from xb_muscle_ros.trials.readers.left_out import Told
from xb_muscle_ros.trials.readers.mapping import build_mapping
from xb_muscle_ros.trials.trial import Array

_BEGIN_BYTES = 4096


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

    def check(self, where: str, values: Array, limits: tuple[float, float], shown: str, remedy: str) -> None:
        """Make sure that the signal's numbers, converted, are within limits.

        Args:
            values: shape (n,).
            limits: least and most.
            shown: how a message shows a value: a format with its unit.
            remedy: what the message ends with.

        Raises:
            UserError: naming the first that is not.
        """
        low, high = limits
        bad = np.flatnonzero(~((values >= low) & (values <= high)))
        if bad.size:
            i = int(bad[0])
            found = shown.format(values[i])
            raise UserError(f"{self.place(where, i)} is {found}; allowed is {low:g} to {high:g}; {remedy}")


@dataclass(frozen=True)
class Recording:
    """Signals and facts of one trial.

    Attributes:
        where: the file, and the trial within it where it holds several, for messages.
        trial: name of the trial.
        signals: by name: ``time`` and ``length``, and ``force``, ``calcium`` and ``stimulation`` where there are any.
        facts: pCa, amplitude (L0) and recovery (s) where the file tells them.
        notes: what the file tells about the trial, in words, for the bag's ``source``.
        warnings: what was wrong with the file and could be lived with.
        test_start_s: when the test stretch was to begin by what the file tells, in the trial's own time, s.
    """

    where: str
    trial: str
    signals: Mapping[str, Signal]
    facts: Mapping[str, float | None] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    test_start_s: float | None = None

    def __post_init__(self) -> None:
        """Make sure that signals are whole: as many numbers as times, all of them finite.

        Raises:
            UserError: naming the signal and the first place at fault.
        """
        for signal in self.signals.values():
            times = self.signals["time"].values if signal.times is None else signal.times
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
                run = int(np.argmin(bad[first:])) or bad.size - first
                more = f" (a run of {run})" if run > 1 else ""
                raise UserError(
                    f"{signal.place(self.where, first)} is {signal.values[first]}{more}; allowed are finite numbers; "
                    "mend or cut the record"
                )


@dataclass(frozen=True)
class Draft:
    """A trial in the making.

    Attributes:
        notes: what was done to the data, in words, for the trial's ``source``.
        warnings: what is unusual, one line each.
    """

    recording: Recording
    mapping: ImportMapping
    notes: list[str]
    warnings: list[str]

    @property
    def where(self) -> str:
        """The trial, for messages."""
        return self.recording.where

    def warn(self, line: str) -> None:
        """Add a warning, with the trial's name before it."""
        self.warnings.append(f"{self.where}: {line}")


class Pending(NamedTuple):
    """A trial that has been found and not yet read.

    Attributes:
        trial: its name, unique within the file.
        read: gives its signals; raises `UserError` where they are broken.
    """

    trial: str
    read: Callable[[], Recording]


class Reader(abc.ABC):
    """Reads one format.

    Attributes:
        name: of the format, as ``--format`` has it.
        suffixes: endings such files usually have.
        begins: what such files begin with, where that tells them.
        kind: how a mapping names signals, `columns.FILE` or `columns.BAG`.
        takes: keys of a mapping that are for some formats alone and have a use for this one.
        tells: whether its files tell a part of the mapping, see `told`.
        defaults: what a mapping need not say for this format; a tree as a mapping file has it.
        in_header: of ``f0`` and ``reference_length``, what files of the format may tell themselves; see `completed`.
    """

    name: str
    suffixes: tuple[str, ...]
    begins: tuple[bytes, ...] = ()
    kind: str = FILE
    in_header: tuple[str, ...] = ()
    takes: tuple[str, ...] = ()
    tells: bool = False
    defaults: Mapping[str, Any] = {}

    def matches(self, path: Path) -> bool:
        """Whether a file or folder is of this format, as far as its begin and its name tell."""
        return path.suffix.lower() in self.suffixes or begin_of(path).startswith(self.begins)

    def told(self, path: Path, tree: Mapping[str, Any]) -> Told:
        """What a file tells of what a mapping, given as a tree, leaves out.

        Raises:
            UserError: the file cannot be read, or does not tell it, or a unit that is not known.
        """
        return Told()

    def defaults_for(self, own: Mapping[str, Any]) -> Mapping[str, Any]:
        """What a mapping with these keys of its own need not say."""
        return self.defaults

    def completed(self, path: Path, mapping: ImportMapping) -> ImportMapping:
        """The mapping of one file, with what its header tells where the mapping tells nothing.

        Raises:
            UserError: the file cannot be read, or a fact is neither in the header nor in the mapping.
        """
        return mapping

    @abc.abstractmethod
    def trials(self, path: Path, mapping: ImportMapping) -> Iterator[Pending]:
        """The trials of a file in a fixed order; a file with one trial is not opened for its name.

        Raises:
            UserError: the file cannot be read at all.
        """

    def pca(self, path: Path, mapping: ImportMapping) -> float | None:
        """The pCa of the trial in a file, read at little cost; None where it has none or holds several trials.

        Raises:
            UserError: the file cannot be read.
        """
        return mapping.facts_of(path)["pca"]

    def contents(self, path: Path) -> Contents:
        """What is in a file, for people and for `inspecting`; here the signals of its first trial, by the defaults.

        Raises:
            UserError: the file cannot be read; the format's defaults do not name its signals.
        """
        mapping = build_mapping({"fibre": "{file}", **self.defaults}, f"defaults of {self.name}", self.kind)
        pending = list(self.trials(path, mapping))
        if not pending:
            raise UserError(f"{path} holds no measured trial; give another file")
        recording = pending[0].read()
        signals = [
            self.content_of(key, column.name, signal.values, column.field, signal.times, signal.at)
            for key, column in mapping.columns.items()
            for signal in [recording.signals[key]]
        ]
        facts = {name: f"{value:g}" for name, value in recording.facts.items() if value is not None}
        return Contents(
            self.name, tuple(signals), tuple(each.trial for each in pending), facts, recording.notes, recording.warnings
        )

    def content_of(
        self,
        role: str,
        name: str,
        values: Array,
        field: str = "",
        times_s: Array | None = None,
        at: Callable[[int], str] = "sample {}".format,
    ) -> Content:
        """A signal whose role and unit the format's defaults tell."""
        keys = dict(self.defaults["columns"][role])
        unit = keys.pop("unit", "s")
        for key in ("column", "topic", "field", "stamp"):
            keys.pop(key, None)
        return Content(name, values, unit, field, role, told_more=keys, times_s=times_s, at=at)


def begin_of(path: Path) -> bytes:
    """The first bytes of a file, 4096 at most; none where there is no file."""
    if not path.is_file():
        return b""
    with path.open("rb") as file:
        return file.read(_BEGIN_BYTES)
