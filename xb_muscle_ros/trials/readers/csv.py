"""Trials from delimited text, by a mapping of columns and units."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.readers.assembly import trial_of
from xb_muscle_ros.trials.readers.base import Pending, Reader, begin_of
from xb_muscle_ros.trials.readers.description import Column, ImportMapping, filled
from xb_muscle_ros.trials.readers.recording import Recording, Signal
from xb_muscle_ros.trials.readers.table import Table, read_table
from xb_muscle_ros.trials.readers.table_trials import Part, check_pca, parts_of
from xb_muscle_ros.trials.readers.text_file import looks_like_text
from xb_muscle_ros.trials.trial import Trial


class CsvReader(Reader):
    """Comma, semicolon or tab separated columns below a header line.

    A file is one trial, unless a column tells trials apart or time starts anew; their names then have the column's
    value, or the number from 1, behind the file's.
    """

    name = "csv"
    suffixes = (".csv", ".tsv")

    def matches(self, path: Path) -> bool:
        """Whether the file is called so or holds text."""
        return super().matches(path) or looks_like_text(begin_of(path))

    def trials(self, path: Path, mapping: ImportMapping) -> Iterator[Pending]:
        """The trials of the table; it is read whole."""
        table = read_table(path, mapping.decimal)
        for i, part in enumerate(parts_of(table, mapping)):
            told = table.told if i == 0 else ()
            yield Pending(_name(path, mapping, part), partial(_recording, table, mapping, part, told))

    def pca(self, path: Path, mapping: ImportMapping) -> float | None:
        """As the file's name or the mapping tells; None where a column does."""
        return None if mapping.calcium is not None else super().pca(path, mapping)


def read_csv(path: Path, mapping: ImportMapping, isometric_scaling: bool | None = None) -> Trial:
    """Read the trial of a file that holds one; see `assembly.trial_of` for what is done to it.

    Raises:
        UserError: a missing column, a cell that is no finite number, several trials, or what `assembly.trial_of`
            refuses.
    """
    pending = list(CsvReader().trials(path, mapping))
    if len(pending) > 1:
        raise UserError(f"{path} holds {len(pending)} trials; import them with xb_muscle import")
    return trial_of(pending[0].read(), mapping, path, isometric_scaling)


def _name(path: Path, mapping: ImportMapping, part: Part) -> str:
    return "_".join(text for text in (filled(mapping.trial, path), part.name) if text)


def _recording(table: Table, mapping: ImportMapping, part: Part, told: tuple[str, ...]) -> Recording:
    """The columns of one trial in a table."""
    where = f"{table.path}, trial {_name(table.path, mapping, part)}" if part.name else str(table.path)
    facts = mapping.facts_of(table.path)

    def at(i: int) -> str:
        return f"line {table.line(int(part.rows[i]))}"

    def signal(column: Column) -> Signal:
        if column is mapping.time and mapping.rate_hz is not None:
            return Signal(column.name, np.arange(part.rows.size) / mapping.rate_hz, at)
        return Signal(f"column '{column.name}'", table.numbers(column.name)[part.rows], at)

    return Recording(
        where,
        _name(table.path, mapping, part),
        {key: signal(column) for key, column in mapping.columns.items()},
        facts,
        warnings=(*told, *part.told, *check_pca(table, mapping, part, facts["pca"])),
    )
