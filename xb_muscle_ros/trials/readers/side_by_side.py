"""Trials beside each other in a table: patterns of column names, whose named groups tell the trials apart."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.readers.description import Column, ImportMapping, fact_of
from xb_muscle_ros.trials.readers.table import Table

TRIAL = "trial"


class Aside(NamedTuple):
    """Columns of one trial.

    Attributes:
        name: of the trial; empty where all columns go by their own names.
        columns: name of the column of each signal.
        own: those that are of this trial alone.
        facts: what their names tell.
    """

    name: str
    columns: Mapping[str, str]
    own: tuple[str, ...]
    facts: Mapping[str, float]


Key = tuple[tuple[str, str], ...]


def columns_of(table: Table, mapping: ImportMapping) -> list[Aside]:
    """The trials that the names of columns tell of, in the order of the table; one where no pattern is given.

    Raises:
        UserError: a pattern matches no column, or the same trial twice, or a trial lacks a signal.
    """
    common = {key: column.name for key, column in mapping.columns.items() if column.pattern is None}
    patterns = {key: column for key, column in mapping.columns.items() if column.pattern is not None}
    if not patterns:
        return [Aside("", common, (), {})]
    found = {key: _matching(table, key, column) for key, column in patterns.items()}
    trials = list(dict.fromkeys(trial for columns in found.values() for trial in columns))
    asides = []
    for trial in trials:
        missing = next((key for key in found if trial not in found[key]), None)
        if missing is not None:
            there = next(columns[trial] for columns in found.values() if trial in columns)
            raise UserError(
                f"{table.where}: column '{there}' is of trial '{_name(trial)}', which has no column of {missing} by "
                f"columns.{missing}.pattern '{patterns[missing].name}'; change the pattern, or the column's name"
            )
        own = {key: columns[trial] for key, columns in found.items()}
        facts = _facts(table, trial, [(own[key], column) for key, column in patterns.items()])
        asides.append(Aside(_name(trial), {**common, **own}, tuple(own.values()), facts))
    names = [aside.name for aside in asides]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise UserError(
            f"{table.where}: two trials are called '{twice}' by their columns; make the group 'trial' differ"
        )
    return asides


def _matching(table: Table, key: str, column: Column) -> dict[Key, str]:
    """Columns whose names match a signal's pattern, by what its groups find."""
    assert column.pattern is not None
    found: dict[Key, str] = {}
    for name in table.header:
        match = column.pattern.fullmatch(name)
        if match is None:
            continue
        trial = tuple(sorted((group, text) for group, text in match.groupdict().items() if text is not None))
        if trial in found:
            raise UserError(
                f"{table.where}: columns '{found[trial]}' and '{name}' both are {key} of trial '{_name(trial)}' by "
                f"columns.{key}.pattern; make its groups tell them apart"
            )
        found[trial] = name
    if not found:
        raise UserError(
            f"{table.where} has no column whose whole name is '{column.name}' (columns.{key}.pattern); its columns: "
            f"{', '.join(table.header)}"
        )
    return found


def _name(trial: Key) -> str:
    """The group 'trial' as it stands, and facts with their names."""
    groups = dict(trial)
    first = groups.pop(TRIAL, None)
    if first is not None:
        return first.strip() or "_".join(groups.values())
    words = {"pca": "pCa", "amplitude_l0": "amp", "recovery_s": "rt"}
    return "_".join(f"{words[group]}{text.strip()}" for group, text in groups.items())


def _facts(table: Table, trial: Key, columns: list[tuple[str, Column]]) -> dict[str, float]:
    facts = {}
    for group, text in trial:
        if group != TRIAL:
            name, column = columns[0]
            facts[group] = fact_of(text, column.factors.get(group, 1.0), group, f"{table.where}, column '{name}'")
    return facts
