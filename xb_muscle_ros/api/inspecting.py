"""Files looked into before they are imported: what is in them, and the mapping that would import them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from xb_muscle_ros.api.tables import dataframe, drawn
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.files import refuse_older, write_json, write_text
from xb_muscle_ros.trials.bag_files import plain
from xb_muscle_ros.trials.importing import find_recordings
from xb_muscle_ros.trials.inspecting.figure import draw
from xb_muscle_ros.trials.inspecting.inspection import Inspection, inspect_file, one_mapping
from xb_muscle_ros.trials.inspecting.report import report, rows
from xb_muscle_ros.trials.readers.description import name_of
from xb_muscle_ros.trials.readers.registry import READERS
from xb_muscle_ros.trials.trial import Trial

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

FORMAT_VERSION = 1


@dataclass(frozen=True, repr=False, eq=False)
class InspectionResult:
    """What is in files, what was recognised, what is missing.

    Attributes:
        files: in order, those that could be read.
        unreadable: why others could not, one line each.
    """

    files: tuple[Inspection, ...]
    unreadable: tuple[str, ...] = ()

    def __repr__(self) -> str:
        works = sum(one.imports or one.is_own for one in self.files)
        return f"InspectionResult({len(self.files)} files, {works} complete, {len(self.unreadable)} unreadable)"

    @property
    def table(self) -> str:
        """The report as text, file by file; of files with the same signals the first in full."""
        told: list[str] = []
        seen: dict[tuple[object, ...], Path] = {}
        for one in self.files:
            if one.layout in seen and not one.refused and one.contents.facts == {}:
                told.append(f"{one.path}: the signals of {seen[one.layout]}; {_short(one)}")
            else:
                told.append(report(one))
            seen.setdefault(one.layout, one.path)
        return "\n\n".join(told)

    @property
    def rows(self) -> tuple[dict[str, Any], ...]:
        """A mapping for each signal: file, name, unit, number of values, range, sampling rate and role."""
        return tuple({"file": str(one.path), **row} for one in self.files for row in rows(one))

    @property
    def missing(self) -> tuple[str, ...]:
        """What an import of the first file still needs, one line each."""
        return tuple(self.files[0].proposal.missing) if self.files else ()

    @property
    def trials(self) -> tuple[Trial, ...]:
        """What an import by the mapping makes, or `replay` takes a bag for."""
        return tuple(trial for one in self.files for trial in one.trials)

    @property
    def mapping(self) -> str:
        """The mapping that imports all files, as YAML with comments.

        Raises:
            UserError: the files have different signals.
        """
        if not self.files:
            raise UserError("no file could be read, so there is no mapping")
        return one_mapping(self.files).text

    def to_dataframe(self) -> pd.DataFrame:
        """A row for each signal, see `rows`.

        Raises:
            UserError: pandas is not there.
        """
        return dataframe(self.rows)

    def plot(self) -> Figure:
        """Every signal of the first file against time, phases shaded.

        Returns:
            a Matplotlib figure.
        """
        return drawn(lambda: draw(Path("inspection.png"), self.files[0]))

    def save(self, folder: str | Path, *, overwrite: bool = False) -> tuple[Path, ...]:
        """Write ``inspection.json`` and a figure of each file.

        Args:
            folder: made if need be.
            overwrite: replace the results of an older inspection.

        Returns:
            what was written.

        Raises:
            UserError: an older inspection is there, or the folder cannot be written.
        """
        table = Path(folder) / "inspection.json"
        refuse_older([table] if table.exists() else [], overwrite)
        names = [plain(name_of(one.path)).lstrip(".-") or "_" for one in self.files]
        figures = []
        for i, (name, one) in enumerate(zip(names, self.files, strict=True)):
            own = name if names.count(name) == 1 else f"{name}_{i + 1}"
            made = draw(Path(folder) / f"{own}.png", one)
            figures += [] if made is None else [made]
        write_json(
            table,
            {
                "format_version": FORMAT_VERSION,
                "files": [
                    {
                        "path": str(one.path),
                        "format": one.format,
                        "trials": [trial.facts.trial for trial in one.trials],
                        "missing": one.proposal.missing,
                        "guesses": one.proposal.guesses,
                        "refused": one.refused,
                        "signals": rows(one),
                    }
                    for one in self.files
                ],
                "unreadable": self.unreadable,
            },
        )
        return (table, *figures)

    def write_mapping(self, path: str | Path, *, overwrite: bool = False) -> Path:
        """Write `mapping`.

        Args:
            path: of the YAML file.
            overwrite: replace a file of this name.

        Returns:
            its path.

        Raises:
            UserError: see `mapping`; it exists, or cannot be written.
        """
        file, text = Path(path), self.mapping
        refuse_older([file] if file.exists() else [], overwrite)
        write_text(file, text)
        return file


def inspect(paths: str | Path | Sequence[str | Path], *, format: str | None = None) -> InspectionResult:
    """Look into recordings before they are imported: nothing is written, and nothing that is unclear is decided.

    Args:
        paths: recordings, bags, or folders that are searched for both.
        format: of the files, as ``xb_muscle import --format`` has it; None: what each looks like.

    Returns:
        signals with units, ranges and sampling rates; roles and why; what is missing; the mapping.

    Raises:
        UserError: a path does not exist or a folder holds no recording; an unknown format.

    Source:
        formats and mappings: docs/bags.md.

    Examples:
        >>> import xb_muscle_ros as xb
        >>> found = xb.inspect("bags/simulated_18Dec2017a_amp0_rt1ms_pca61")
        >>> found.files[0].is_own, found.trials[0].facts.pca
        (True, 6.1)
    """
    if format is not None and format not in READERS:
        raise UserError(f"format is '{format}'; allowed: {', '.join(READERS)}")
    given = [Path(paths)] if isinstance(paths, (str, Path)) else [Path(path) for path in paths]
    files, unreadable = [], []
    for path in find_recordings(given):
        try:
            files.append(inspect_file(path, format))
        except UserError as problem:
            unreadable.append(str(problem))
        except OSError as problem:
            unreadable.append(f"{path} cannot be read: {problem.strerror or problem}; look at its permissions")
    return InspectionResult(tuple(files), tuple(unreadable))


def _short(one: Inspection) -> str:
    """What there is to say of a file whose signals were shown."""
    if one.proposal.missing:
        return f"an import needs {len(one.proposal.missing)} more"
    return f"an import works, {len(one.trials)} trial{'' if len(one.trials) == 1 else 's'}"
