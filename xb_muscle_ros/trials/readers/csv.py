"""Trials from delimited text, by a mapping of columns and units."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.readers.assembly import trial_of
from xb_muscle_ros.trials.readers.base import begin_of
from xb_muscle_ros.trials.readers.delimited import read_table
from xb_muscle_ros.trials.readers.description import ImportMapping
from xb_muscle_ros.trials.readers.encoding import looks_like_text
from xb_muscle_ros.trials.readers.options import ANY_TABLE, TableOptions
from xb_muscle_ros.trials.readers.table import Table
from xb_muscle_ros.trials.readers.tabular import TableReader
from xb_muscle_ros.trials.trial import Trial


class CsvReader(TableReader):
    """Columns between commas, semicolons, tabs or blanks, below a header line; text exports of LabChart and LabVIEW."""

    name = "csv"
    suffixes = (".csv", ".tsv", ".lvm")
    takes = (*ANY_TABLE, "decimal", "encoding", "header", "blanks")

    def matches(self, path: Path) -> bool:
        """Whether the file is called so or holds text."""
        return super().matches(path) or looks_like_text(begin_of(path))

    def tables(self, path: Path, options: TableOptions) -> Iterator[Table]:
        """The one table of the file."""
        yield read_table(path, options)


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
