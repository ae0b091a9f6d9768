"""The interface of a reader: it finds the trials in a file and gives the signals of each, one at a time."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple, Protocol

from xb_muscle_ros.trials.readers.description import Column, ImportMapping
from xb_muscle_ros.trials.readers.recording import Recording, Signal


class Pending(NamedTuple):
    """A trial that has been found and not yet read.

    Attributes:
        trial: its name, unique within the file.
        read: gives its signals; raises `UserError` where they are broken.
    """

    trial: str
    read: Callable[[], Recording]


class Reader(Protocol):
    """Reads one format.

    Attributes:
        name: of the format, as ``--format`` has it.
        suffixes: endings such files usually have.
        kind: how a mapping names signals, `mapping.FILE` or `mapping.BAG`.
        defaults: what a mapping need not say for this format; a tree as a mapping file has it.
    """

    name: str
    suffixes: tuple[str, ...]
    kind: str
    defaults: Mapping[str, Any]

    def matches(self, path: Path) -> bool:
        """Whether a file or folder is of this format, as far as its begin and its name tell."""

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


def begin_of(path: Path, count: int) -> bytes:
    """The first bytes of a file; none where there is no file."""
    if not path.is_file():
        return b""
    with path.open("rb") as file:
        return file.read(count)


def by_columns(
    where: str,
    mapping: ImportMapping,
    signal: Callable[[Column], Signal],
    trial: str,
    facts: Mapping[str, float | None],
) -> Recording:
    """A recording whose signals are columns of one table.

    Args:
        where: the file, for messages.
        mapping: names the columns.
        signal: finds one; raises `UserError` where there is none.
        trial: its name.
        facts: that the file tells.
    """
    return Recording(
        where=where,
        trial=trial,
        time=signal(mapping.time),
        length=signal(mapping.length),
        force=None if mapping.force is None else signal(mapping.force),
        calcium=None if mapping.calcium is None else signal(mapping.calcium),
        stimulation=None if mapping.stimulation is None else signal(mapping.stimulation.column),
        facts=facts,
    )
