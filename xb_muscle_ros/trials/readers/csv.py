"""Trials from delimited text, by a mapping of columns and units."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from xb_muscle_ros.trials.readers.assembly import trial_of
from xb_muscle_ros.trials.readers.base import Pending, begin_of, by_columns
from xb_muscle_ros.trials.readers.columns import FILE
from xb_muscle_ros.trials.readers.description import Column, ImportMapping
from xb_muscle_ros.trials.readers.recording import Recording, Signal
from xb_muscle_ros.trials.readers.table import read_table
from xb_muscle_ros.trials.trial import Trial

_LOOKED_AT_BYTES = 4096


class CsvReader:
    """Comma, semicolon or tab separated columns below a header line, one trial to a file."""

    name = "csv"
    suffixes: tuple[str, ...] = (".csv", ".tsv")
    kind = FILE
    defaults: Mapping[str, Any] = {}

    def matches(self, path: Path) -> bool:
        """Whether the file is called so or holds text."""
        if path.suffix.lower() in self.suffixes:
            return True
        begin = begin_of(path, _LOOKED_AT_BYTES)
        return bool(begin) and b"\x00" not in begin

    def trials(self, path: Path, mapping: ImportMapping) -> Iterator[Pending]:
        """The one trial of the file."""
        yield Pending(mapping.trial_of(path), lambda: read_recording(path, mapping))

    def pca(self, path: Path, mapping: ImportMapping) -> float | None:
        """As the file's name or the mapping tells."""
        return mapping.facts_of(path)["pca"]


def read_csv(path: Path, mapping: ImportMapping, isometric_scaling: bool | None = None) -> Trial:
    """Read the trial of one file; see `assembly.trial_of` for what is done to it.

    Raises:
        UserError: a missing column, a cell that is no finite number, or what `assembly.trial_of` refuses.
    """
    return trial_of(read_recording(path, mapping), mapping, path, isometric_scaling)


def read_recording(path: Path, mapping: ImportMapping) -> Recording:
    """The columns of one file.

    Raises:
        UserError: the file is no table, or a column is missing or holds what is no finite number.
    """
    table = read_table(path)

    def signal(column: Column) -> Signal:
        return Signal(f"column '{column.name}'", table.numbers(column.name), lambda i: f"line {table.line(i)}")

    return by_columns(str(path), mapping, signal, mapping.trial_of(path), mapping.facts_of(path))
