"""Trials from MATLAB files: variables, matrices, cell arrays and structs, by a mapping of paths (see `mat_path`).

One layout needs no mapping: that of `mat_grid`. Units may stand beside the numbers: ``force_unit``, ``force_units``,
or a field ``force`` in a struct ``unit`` or ``units``, there or in a struct above.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.readers import mat_grid
from xb_muscle_ros.trials.readers.base import Pending, Reader, Recording, Signal
from xb_muscle_ros.trials.readers.contents import Contents
from xb_muscle_ros.trials.readers.description import ImportMapping, filled
from xb_muscle_ros.trials.readers.left_out import Told
from xb_muscle_ros.trials.readers.mat_contents import grid_contents, mat_contents
from xb_muscle_ros.trials.readers.mat_file import MAT5, MAT73, load, names_of
from xb_muscle_ros.trials.readers.mat_nodes import Struct, listed
from xb_muscle_ros.trials.readers.mat_path import MatPath
from xb_muscle_ros.trials.readers.mat_pca import check_pca, is_pca
from xb_muscle_ros.trials.readers.mat_units import UNIT_NAMES, unit_beside
from xb_muscle_ros.trials.readers.told_units import differing, told_of, told_unit
from xb_muscle_ros.trials.trial import Array

_ROOT = re.compile(r"\s*\w*")
_PATH_SIGNS = re.compile(r"[.(){}]")
# Variables that are taken without being named.
_USUAL = {"time": ("time", "t"), "length": ("length",), "force": ("force",)}


class MatReader(Reader):
    """One trial to a file, or many: a column, a row, a cell or a struct for each."""

    name = "mat"
    suffixes = (".mat",)
    begins = (MAT5, MAT73)
    takes = ("columns.trial", "columns.time.rate")
    tells = True
    defaults: Mapping[str, Any] = {"fibre": "{file}"}

    def told(self, path: Path, tree: Mapping[str, Any]) -> Told:
        """Columns of the known layout, or of variables with usual names, and units that stand beside the numbers.

        Raises:
            UserError: the file cannot be read, or nothing tells which variables are time and length.
        """
        every = tree.get("columns", {})
        columns = {key: each for key, each in every.items() if isinstance(each, Mapping)}
        named = {key: str(each["column"]) for key, each in columns.items() if "column" in each}
        content = _content(path, list(named.values()))
        if _is_grid(content, list(named.values())):
            return mat_grid.TOLD
        found = {}
        for key, usual in _USUAL.items():
            name = next((each for each in content if each.casefold() in usual), None)
            if name is not None and key not in named and "rate" not in columns.get(key, {}):
                found[key] = name
        _check_named(path, {*named, *found, *(key for key, each in columns.items() if "rate" in each)})
        units = {}
        for key, name in {**found, **named}.items():
            if "unit" not in columns.get(key, {}) and key != "trial":
                unit = unit_beside(content, MatPath(name, str(path)))
                if unit:
                    units[key] = told_unit(unit, key, f"{path}: {name}")
        return told_of(str(path), found, units)

    def trials(self, path: Path, mapping: ImportMapping) -> Iterator[Pending]:
        """The measured trials of the file; it is read whole, its trials are made one at a time.

        Raises:
            UserError: no such file, or one without the variables, or with arrays that do not fit each other.
        """
        names = [column.name for column in mapping.columns.values()]
        content = _content(path, names if mapping.trial_column is None else [*names, mapping.trial_column])
        if _is_grid(content, names):
            yield from mat_grid.trials(path, mapping, content)
            return
        paths = _paths(mapping)
        count = _count(paths, content, path)
        names = [_name(path, mapping, paths, content, i, count) for i in range(count or 1)]
        empty = [i for i in range(count or 0) if _is_empty(paths, content, i, str(path))]
        numbers = ", ".join(str(i + 1) for i in empty)
        notices = (f"{path}: trials without a length or force were not measured and are left out: {numbers}",)
        units = {key: unit_beside(content, each) or "" for key, each in paths.items() if key != "trial"}
        first = (*mapping.told, *differing(str(path), units, mapping), *(notices if empty else ()))
        for i, name in enumerate(names):
            if i not in empty:
                where = str(path) if count is None else f"{path}, trial {name}"
                yield Pending(name, partial(_recording, paths, content, i, mapping, (path, where, name, first)))
                first = ()

    def pca(self, path: Path, mapping: ImportMapping) -> None:
        """None: a file may hold several."""

    def contents(self, path: Path) -> Contents:
        """Every vector and column of the file, of its first trial where it holds several; see `mat_contents`."""
        content = load(path)
        return grid_contents(path, content) if mat_grid.is_grid(content) else mat_contents(content)


def _content(path: Path, columns: list[str]) -> Struct:
    """The variables that columns name, those that may tell units or pCa, and those of usual names.

    All, where one is missing. A file may hold a film beside its numbers.
    """
    roots = {_ROOT.match(text).group() for text in columns}  # type: ignore[union-attr]  # it matches anything
    wanted = {each.casefold() for each in (mat_grid.STRUCT, *UNIT_NAMES, *itertools.chain(*_USUAL.values()))}
    beside = {f"{root}_{unit}" for root in (*roots, *itertools.chain(*_USUAL.values())) for unit in UNIT_NAMES}
    wanted |= {name.casefold() for name in beside}
    names = names_of(path)
    chosen = {name for name in names if name in roots or name.casefold() in wanted or is_pca(name)}
    return load(path, chosen | beside if roots <= set(names) else None)


def _is_grid(content: Struct, columns: list[str]) -> bool:
    """Whether a file is of the layout of `mat_grid`, and none of the columns is a path of another."""
    return mat_grid.is_grid(content) and not any(_PATH_SIGNS.search(name) for name in columns)


def _check_named(path: Path, keys: set[str]) -> None:
    missing = next((key for key in ("length", "time") if key not in keys), None)
    if missing is not None:
        content = load(path)
        rate = ", or give --rate" if missing == "time" else ""
        raise UserError(
            f"{path} has no struct '{mat_grid.STRUCT}' with pCas, ISIs and AMPs, so columns.{missing} has to name a "
            f"variable (--{missing}-column){rate}; the file holds {listed(content)}"
        )


def _paths(mapping: ImportMapping) -> dict[str, MatPath]:
    """Paths of the signals, and that of the trial's name."""
    found = {
        key: MatPath(column.name, mapping.where)
        for key, column in mapping.columns.items()
        if not (key == "time" and mapping.rate_hz is not None)
    }
    return found if mapping.trial_column is None else {**found, "trial": MatPath(mapping.trial_column, mapping.where)}


def _count(paths: Mapping[str, MatPath], content: Struct, path: Path) -> int | None:
    """How many trials there are; None for a file that is one."""
    runs = {key: each.find(content, 0, str(path)).runs for key, each in paths.items()}
    told = {key: count for key, count in runs.items() if count is not None}
    if not told:
        return None
    first, count = next(iter(told.items()))
    other = next((key for key, each in told.items() if each != count), None)
    if other is not None:
        raise UserError(
            f"{path}: {paths[first].text} runs over {count} trials, {paths[other].text} over {told[other]}; all need "
            "as many"
        )
    return count


def _name(path: Path, mapping: ImportMapping, paths: Mapping[str, MatPath], content: Struct, i: int, count: Any) -> str:
    """A trial's name: the file's, and its own or its number where there are several."""
    whole = filled(mapping.trial, path)
    if "trial" in paths:
        node = paths["trial"].find(content, i, str(path)).node
        own = node if isinstance(node, str) else f"{paths['trial'].numbers(content, i, str(path))[0]:g}"
        return f"{whole}_{own.strip()}"
    return whole if count is None else f"{whole}_{i + 1}"


def _values(path: MatPath, content: Struct, i: int, where: str) -> Array:
    """Numbers of a trial, without what fills up the end of short ones in an array of several."""
    values = path.numbers(content, i, where)
    if not path.find(content, i, where).padded:
        return values
    finite = np.flatnonzero(np.isfinite(values))
    return values[: finite[-1] + 1] if finite.size else values[:0]


def _is_empty(paths: Mapping[str, MatPath], content: Struct, i: int, where: str) -> bool:
    try:
        return any(_values(paths[key], content, i, where).size == 0 for key in ("length", "force") if key in paths)
    except UserError:
        return False  # told when its turn comes


def _recording(
    paths: Mapping[str, MatPath], content: Struct, i: int, mapping: ImportMapping, told: tuple[Path, str, str, Any]
) -> Recording:
    path, where, name, warnings = told
    facts = mapping.facts_of(path)
    if facts["pca"] is not None and mapping.calcium is None and mapping.activation is None:
        check_pca(content, i, _count(paths, content, path), paths["length"], facts["pca"], where)
    found = {key: _values(each, content, i, where) for key, each in paths.items() if key != "trial"}
    count = found["length"].size
    time, line = _times(found.get("time"), count, mapping, paths, content, where)
    found["time"] = time
    if found.get("calcium", time).size == 1 < count:
        found["calcium"] = np.full(count, found["calcium"][0])
    if "force" in found and found["force"].size != count:
        raise UserError(
            f"{where}: {mapping.length.name} has {count} samples, {paths['force'].text} {found['force'].size}; needed "
            "are equal numbers; mend the file"
        )
    return Recording(
        where,
        name,
        {key: Signal(mapping.columns[key].name, values, lambda i: f"sample {i + 1}") for key, values in found.items()},
        facts,
        warnings=(*warnings, *line),
    )


def _times(
    time: Array | None, count: int, mapping: ImportMapping, paths: Mapping[str, MatPath], content: Struct, where: str
) -> tuple[Array, tuple[str, ...]]:
    """Times of a trial in the unit of the file, and a line where they are not those of the file."""
    if time is None:
        assert mapping.rate_hz is not None  # the mapping was checked
        return np.arange(count) / mapping.rate_hz, ()
    if time.size == 1 < count:
        unit = mapping.time.unit_name
        line = f"{where}: {mapping.time.name} is one number, {time[0]:g} {unit}, taken as the time between samples"
        return np.arange(count) * time[0], (line,)
    length = paths["length"].find(content, 0, where)
    if time.size > count and length.padded and paths["time"].find(content, 0, where).runs is None:
        return time[:count], ()  # one clock for all trials, of which this one is shorter
    return time, ()
