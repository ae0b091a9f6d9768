"""Tables of trials as CSV, as Parquet and as OpenSim's storage files; each file appears whole or not at all."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.files import replaced, write_text
from xb_muscle_ros.trials.inspecting.mapping_text import scalar
from xb_muscle_ros.trials.tabulating import TrialTable
from xb_muscle_ros.trials.trial import Trial

# A length in m whose L0 is 1 m is in L0.
_NORMALISED_M = 1.0


def write_csv(path: Path, table: TrialTable) -> None:
    """Facts and notes as lines of comment, a header line, numbers as Python writes them: they come back bit for bit."""
    lines = [f"# {name}: {text}" for name, text in table.facts.items()]
    lines += [f"# {note}" for note in table.notes]
    lines.append(",".join(table.columns))
    with replaced(path) as temporary, temporary.open("w", encoding="utf-8", newline="\n") as file:
        file.writelines(f"{line}\n" for line in itertools.chain(lines, _rows(table, ",")))


def write_sto(path: Path, table: TrialTable) -> None:
    """OpenSim's storage format: keys and values, ``endheader``, names and rows separated by tabs, ``time`` first."""
    rows = len(table.columns["time_s"])
    lines = [path.stem, "version=1", f"nRows={rows}", f"nColumns={len(table.columns)}", "inDegrees=no"]
    lines += [f"{name}={text}" for name, text in table.facts.items()]
    lines += [note.replace("=", ":") for note in table.notes]
    names = ["time", *list(table.columns)[1:]]
    with replaced(path) as temporary, temporary.open("w", encoding="utf-8", newline="\n") as file:
        file.writelines(
            f"{line}\n" for line in itertools.chain((*lines, "endheader", "\t".join(names)), _rows(table, "\t"))
        )


def write_parquet(path: Path, table: TrialTable) -> None:
    """One row group; facts and notes as metadata of the schema.

    Raises:
        UserError: pyarrow is not there.
    """
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ImportError as error:
        raise UserError(f"Parquet needs pyarrow ({error}); pip install 'xb_muscle_ros[parquet]'") from error
    made = pa.table({name: pa.array(values) for name, values in table.columns.items()})
    metadata = {**table.facts, "notes": "; ".join(table.notes)}
    with replaced(path) as temporary:
        pq.write_table(made.replace_schema_metadata(metadata), temporary)


WRITERS: Mapping[str, Callable[[Path, TrialTable], None]] = {
    "csv": write_csv,
    "parquet": write_parquet,
    "sto": write_sto,
}
"""By the ending of the file, which is the name of the format."""


def write_mapping(path: Path, trial: Trial, table: TrialTable) -> None:
    """The mapping by which an import makes the trial of its CSV table again."""
    write_text(path, "".join(f"{line}\n" for line in _mapping(trial, table)))


def _mapping(trial: Trial, table: TrialTable) -> Iterator[str]:
    facts = trial.facts
    yield "# xb_muscle import reads the table of this name by this mapping; phases are found from length."
    yield "format: csv"
    for key in ("fibre", "trial", "data_set", "source"):
        if getattr(facts, key):
            yield f"{key}: {scalar(getattr(facts, key))}"
    normalised = facts.reference_length_m == _NORMALISED_M
    yield "columns:"
    yield "  time: {column: time_s, unit: s}"
    yield f"  length: {{column: length_m, unit: {'L0' if normalised else 'm'}}}"
    if "force_measured_n" in table.columns:
        yield f"  force: {{column: force_measured_n, unit: {'F0' if facts.f0_n == 1.0 else 'N'}}}"
    by_pca = facts.pca is not None and trial.calcium_um.size == 1 and 10.0 ** (6.0 - facts.pca) == trial.calcium_um[0]
    if by_pca:
        yield f"pca: {facts.pca!r}"
    else:
        yield "  calcium: {column: calcium_um, unit: uM}"
    if not normalised:
        yield f"reference_length: {facts.reference_length_m!r} m"
    if "force_measured_n" in table.columns and facts.f0_n != 1.0:
        yield f"f0: {facts.f0_n!r} N"
    for key in ("amplitude_l0", "recovery_s"):
        if getattr(facts, key) is not None:
            yield f"{key}: {getattr(facts, key)!r}"


def _rows(table: TrialTable, delimiter: str) -> Iterator[str]:
    columns = [values.tolist() for values in table.columns.values()]
    for row in zip(*columns, strict=True):
        yield delimiter.join(map(repr, row))
