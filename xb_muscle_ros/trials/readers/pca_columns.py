"""Columns of a table that hold, or are named after, another pCa than a trial is given."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.readers.calcium import PCA_COLUMN, SAME_PCA, pcas_in
from xb_muscle_ros.trials.readers.description import ImportMapping
from xb_muscle_ros.trials.readers.parts import Part
from xb_muscle_ros.trials.readers.table import Table


def check_pca(table: Table, mapping: ImportMapping, part: Part, pca: float | None) -> Iterator[str]:
    """Warnings on columns of a given pCa, after making sure that no column tells another than the trial is given.

    Raises:
        UserError: a column of pCa that is not read holds another.
    """
    if mapping.calcium is not None or mapping.activation is not None or pca is None:
        return
    told = pcas_in("" if table.name else table.sheet)  # the trial is called by `name`, and looked at by that
    if len(told) == 1 and abs(told[0] - pca) > SAME_PCA:
        yield f"{table.where}: the sheet is called by pCa {told[0]:g}, the trial has {pca:g}; check both"
    force = part.columns.get("force", "")
    patterns = [column.pattern for column in mapping.columns.values() if column.pattern is not None]
    # Names of columns that tell pCa go before a column of it, which is of one trial at most.
    of_names = any("pca" in pattern.groupindex for pattern in patterns)
    others = []
    for name in table.header:
        stated = next(iter(pcas_in(name)), None)
        if stated is None:
            if PCA_COLUMN.match(name) and not of_names:
                _check_column(table, name, part, pca)
            continue
        if abs(stated - pca) > SAME_PCA and name == force:
            yield f"{table.where}: the force column is '{name}', but pCa is given as {pca:g}; check both"
        elif abs(stated - pca) > SAME_PCA and not any(pattern.fullmatch(name) for pattern in patterns):
            others.append(f"'{name}'")
    if others:
        yield (
            f"{table.where}: not read, because of another pCa by name: {', '.join(others)}; a pattern in the mapping "
            "reads them all (columns.force.pattern), or import the file again for each, with its --force-column, --pca "
            "and --trial"
        )


def _check_column(table: Table, name: str, part: Part, pca: float) -> None:
    values = table.rows.column(table.index(name), table.decimal)[part.rows]
    with np.errstate(invalid="ignore"):
        if not np.all((values >= 1.0) & (values <= 12.0)):
            return  # no pCa
    other = np.flatnonzero(np.abs(values - pca) > SAME_PCA)
    if other.size:
        row = int(part.rows[other[0]])
        raise UserError(
            f"{table.where}, {table.place(row)}, column '{name}' holds {table.text(name, row)}, but pCa is given as "
            f"{pca:g} for the whole trial; read the column with --calcium-column '{name}' --calcium-unit pCa"
        )
