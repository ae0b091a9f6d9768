"""The base of all readers: it finds the trials in a file and gives the signals of each, one at a time."""

from __future__ import annotations

import abc
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from xb_muscle_ros.trials.readers.columns import FILE
from xb_muscle_ros.trials.readers.description import ImportMapping
from xb_muscle_ros.trials.readers.recording import Recording

_BEGIN_BYTES = 4096


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
        defaults: what a mapping need not say for this format; a tree as a mapping file has it.
    """

    name: str
    suffixes: tuple[str, ...]
    begins: tuple[bytes, ...] = ()
    kind: str = FILE
    defaults: Mapping[str, Any] = {}

    def matches(self, path: Path) -> bool:
        """Whether a file or folder is of this format, as far as its begin and its name tell."""
        return path.suffix.lower() in self.suffixes or begin_of(path).startswith(self.begins)

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


def begin_of(path: Path) -> bytes:
    """The first bytes of a file, 4096 at most; none where there is no file."""
    if not path.is_file():
        return b""
    with path.open("rb") as file:
        return file.read(_BEGIN_BYTES)
