"""Trials in one table: separated by a column, or by time that starts anew; and pCa that the table tells beside."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.readers.description import ImportMapping
from xb_muscle_ros.trials.readers.numerals import number
from xb_muscle_ros.trials.readers.table import Table

# A column of this name tells trials apart without being asked for.
TRIAL_COLUMN = "trial"
# Time that starts anew comes back to its first value within so many steps, and goes on for so many samples.
_SAME_START_STEPS = 2.0
_LEAST_SAMPLES = 10
# pCa is noted to a tenth.
_SAME_PCA = 0.05
_PCA_COLUMN = re.compile(r"p[ _-]?ca([^a-z0-9]|$)", re.IGNORECASE)
_PCA_IN_NAME = re.compile(r"p[ _-]?ca[ _=:-]*(\d+(?:[.,]\d+)?)", re.IGNORECASE)


class Part(NamedTuple):
    """Rows of one trial.

    Attributes:
        name: what its name has beside the file's; empty where the table is one trial.
        rows: indices, in the order of the file.
        told: how the table was split, with the first part only.
    """

    name: str
    rows: npt.NDArray[np.int64]
    told: tuple[str, ...] = ()


def parts_of(table: Table, mapping: ImportMapping) -> list[Part]:
    """The trials in a table: one for each value of the trial column, or each time that time starts anew.

    Raises:
        UserError: the mapping's trial column is missing or has an empty cell.
    """
    parts = _by_column(table, mapping) or _by_time(table, mapping)
    if len(parts) < 2:
        return [Part("", np.arange(len(table.rows)))]
    return parts


def check_pca(table: Table, mapping: ImportMapping, part: Part, pca: float | None) -> Iterator[str]:
    """Warnings on columns of a given pCa, after making sure that no column tells another than the trial is given.

    Raises:
        UserError: a column of pCa that is not read holds another.
    """
    if mapping.calcium is not None or mapping.activation is not None or pca is None:
        return
    force = "" if mapping.force is None else mapping.force.name
    others = []
    for name in table.header:
        if _PCA_COLUMN.match(name):
            _check_column(table, name, part, pca)
        found = _PCA_IN_NAME.search(name)
        if found is None:
            continue
        told = float(found.group(1).replace(",", "."))
        told = told / 10.0 if told > 12.0 else told  # 61 is 6.1
        if abs(told - pca) > _SAME_PCA and name == force:
            yield f"{table.path}: the force column is '{name}', but pCa is given as {pca:g}; check both"
        elif abs(told - pca) > _SAME_PCA:
            others.append(f"'{name}'")
    if others:
        yield (
            f"{table.path}: not read, because of another pCa by name: {', '.join(others)}; import the file again for "
            "each, with its --force-column, --pca and --trial"
        )


def _check_column(table: Table, name: str, part: Part, pca: float) -> None:
    texts = table.texts(name)
    values = np.array([number(texts[row], table.decimal) for row in part.rows])
    with np.errstate(invalid="ignore"):
        if not np.all((values >= 1.0) & (values <= 12.0)):
            return  # no pCa
    other = np.flatnonzero(np.abs(values - pca) > _SAME_PCA)
    if other.size:
        row = int(part.rows[other[0]])
        raise UserError(
            f"{table.path}, line {table.line(row)}, column '{name}' holds {texts[row]}, but pCa is given as {pca:g} "
            f"for the whole trial; read the column with --calcium-column '{name}' --calcium-unit pCa"
        )


def _by_column(table: Table, mapping: ImportMapping) -> list[Part]:
    asked = mapping.trial_column
    name = asked or next((each for each in table.header if each.casefold() == TRIAL_COLUMN), None)
    if name is None:
        return []
    texts = table.texts(name)
    rows: dict[str, list[int]] = {}
    for row, text in enumerate(texts):
        rows.setdefault(text, []).append(row)
    if "" in rows and asked:
        raise UserError(
            f"{table.path}, line {table.line(rows[''][0])}, column '{name}' holds nothing; needed is the name or "
            "number of the trial; fill it in"
        )
    if not asked and (min(map(len, rows.values())) < _LEAST_SAMPLES or "" in rows):
        return []  # it numbers something else
    told = (f"{table.path}: column '{name}' tells {len(rows)} trials apart",)
    return [Part(text, np.array(each), told if i == 0 else ()) for i, (text, each) in enumerate(rows.items())]


def _by_time(table: Table, mapping: ImportMapping) -> list[Part]:
    if mapping.rate_hz is not None:
        return []
    time = table.numbers(mapping.time.name)
    steps = np.diff(time)
    anew = np.flatnonzero(steps <= 0.0) + 1
    if not anew.size or not (steps > 0.0).any():
        return []
    step = float(np.median(steps[steps > 0.0]))
    bounds = [0, *anew.tolist(), time.size]
    if np.any(np.abs(time[anew] - time[0]) > _SAME_START_STEPS * step) or np.min(np.diff(bounds)) < _LEAST_SAMPLES:
        return []  # a clock that steps back; the trial is refused when it is read
    count = anew.size + 1
    told = (f"{table.path}: time starts anew in line {table.line(int(anew[0]))}; the table is {count} trials",)
    return [
        Part(str(i + 1), np.arange(bounds[i], bounds[i + 1]), told if i == 0 else ()) for i in range(len(bounds) - 1)
    ]
