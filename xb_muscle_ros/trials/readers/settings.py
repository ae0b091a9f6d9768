"""The settings of an import, and the mapping they make for each file."""

from __future__ import annotations

import contextlib
import functools
import hashlib
import json
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from xb_muscle_ros.errors import UserError, suggest
from xb_muscle_ros.trials.readers.assembly import made_of
from xb_muscle_ros.trials.readers.base import Reader
from xb_muscle_ros.trials.readers.description import FACTS, ImportMapping, name_of
from xb_muscle_ros.trials.readers.force import Force, isometric_force
from xb_muscle_ros.trials.readers.left_out import Told, is_left_out
from xb_muscle_ros.trials.readers.mapping import build_mapping
from xb_muscle_ros.trials.readers.options import PATTERN, TABLE_KEYS, read_options
from xb_muscle_ros.trials.readers.registry import READERS, reader_for
from xb_muscle_ros.trials.readers.tree import Keys, dotted_keys, merged
from xb_muscle_ros.trials.readers.units import Quantity

# Raised when the same file and mapping would make another trial than before.
VERSION = 3
# Mappings, and F0 of preparations, that are kept: files come kind by kind and folder by folder.
_KEPT = 64
_SAME_PCA = 1e-6


class MappingError(UserError):
    """The mapping is wrong, whatever the file; there is no use in going on with the next one."""


class Prepared(NamedTuple):
    """A file, what reads it and how, and a digest of all that decides what becomes of it beside its content."""

    path: Path
    reader: Reader
    mapping: ImportMapping
    digest: str


class ImportSettings:
    """Mapping file and options of an import."""

    def __init__(
        self,
        tree: Mapping[str, Any],
        where: str,
        file_format: str | None = None,
        isometric_scaling: bool | None = None,
        overrides: Mapping[str, Any] | None = None,
    ) -> None:
        """Check what can be checked before any file is seen.

        Args:
            tree: of the mapping file; empty where there is none.
            file_format: name of a reader; None for what the mapping says, or else each file looks like.
            overrides: goes before the mapping file, for every file.

        Raises:
            UserError: an unknown format, or ``per_file`` that cannot be used.
        """
        rest = Keys(tree, where).values
        self._format = file_format or rest.pop("format", None)
        rest.pop("format", None)
        if self._format is not None and self._format not in READERS:
            raise UserError(f"{where}: format is '{self._format}'{suggest(str(self._format), READERS)}")
        self._cases = _cases(rest.pop("per_file", []), where)
        self._tree, self._where, self._overrides = rest, where, overrides or {}
        self.isometric_scaling = isometric_scaling
        self._merged = functools.lru_cache(_KEPT)(self._merge)
        self._mapping = functools.lru_cache(_KEPT)(self._built)
        self._isometric_f0 = functools.lru_cache(_KEPT)(self._f0_of_folder)
        if not self._cases and self._format is not None:
            reader = READERS[self._format]
            if not reader.tells or not is_left_out(self._merged(reader, ())):  # else the file may tell it
                self._mapping(reader, (), Told())

    def prepare(self, path: Path) -> Prepared:
        """What a file needs to be read.

        Raises:
            UserError: it cannot be read, is of no known format, or its F0 cannot be found.
            MappingError: the mapping does not fit its format.
        """
        reader = reader_for(path, self._format)
        matching = tuple(i for i, (files, _) in enumerate(self._cases) if files.search(name_of(path)))
        told = reader.told(path, self._merged(reader, matching))
        general, digest = self._mapping(reader, matching, told)
        mapping = reader.completed(path, general)
        if mapping.f0_at_pca is None:
            return Prepared(path, reader, mapping, digest)
        suffix = path.suffix.lower()
        found = self._isometric_f0(path.resolve().parent, suffix, reader, matching, told)
        if found is None:
            raise UserError(
                f"{path}: no {suffix} file in its folder has an isometric force at pCa {mapping.f0_at_pca:g}, so F0 is "
                "not known; add that trial, or give f0 in the mapping or by --f0"
            )
        f0, note = found
        digest = hashlib.sha256(f"{digest} {f0.value!r} {note}".encode()).hexdigest()
        return Prepared(path, reader, replace(mapping, f0=f0, f0_note=note), digest)

    def _f0_of_folder(
        self, folder: Path, suffix: str, reader: Reader, matching: tuple[int, ...], told: Told
    ) -> tuple[Quantity, str] | None:
        """See `isometric_f0`; every file is read by what it tells itself."""
        mapping, _ = self._mapping(reader, matching, told)
        assert mapping.force is not None  # the mapping was checked
        assert mapping.f0_at_pca is not None  # or nobody would ask

        def mapping_of(file: Path) -> ImportMapping:
            return self._mapping(reader, matching, reader.told(file, self._merged(reader, matching)))[0]

        return isometric_f0(folder, suffix, reader, mapping_of, (mapping.force.unit.kind, mapping.f0_at_pca))

    def _own(self, matching: tuple[int, ...]) -> Mapping[str, Any]:
        """Keys that the mapping and the options tell for files that some of the cases match."""
        trees = (self._tree, *(self._cases[i][1] for i in matching), self._overrides)
        own: Mapping[str, Any] = functools.reduce(merged, trees, {})
        return own

    def _merge(self, reader: Reader, matching: tuple[int, ...]) -> Mapping[str, Any]:
        """Keys that hold for files of a format that some of the cases match."""
        trees = (self._tree, *(self._cases[i][1] for i in matching), self._overrides)
        tree = functools.reduce(merged, trees, dict(reader.defaults_for(self._own(matching))))
        try:
            read_options(Keys(tree, self._where), FACTS)  # a table is looked into before the rest is checked
        except UserError as problem:
            raise MappingError(str(problem)) from None
        return tree

    def _built(self, reader: Reader, matching: tuple[int, ...], found: Told) -> tuple[ImportMapping, str]:
        """The mapping of such files, with what they tell themselves, and its digest."""
        tree = merged(found.tree, self._merged(reader, matching))
        sure = frozenset(name for name in FACTS if self._overrides.get(name) is not None)
        decides = [VERSION, reader.name, self.isometric_scaling, _with_text_keys(tree), *sorted(sure)]
        told = json.dumps(decides, sort_keys=True)
        try:
            made = build_mapping(tree, self._where, reader.kind, reader.in_header)
            _check_format(made, tree, reader)
        except UserError as problem:
            raise MappingError(str(problem)) from None
        made = replace(made, told=found.lines, own_keys=frozenset(dotted_keys(self._own(matching))), sure=sure)
        return made, hashlib.sha256(told.encode()).hexdigest()


def _check_format(made: ImportMapping, tree: Mapping[str, Any], reader: Reader) -> None:
    """What only some formats have."""
    told: dict[str, object] = {"columns.trial": made.trial_column, "columns.time.rate": made.rate_hz}
    some = (*TABLE_KEYS, "gear_ratio")
    keys = [*(key for key, value in told.items() if value is not None), *(key for key in some if key in tree)]
    unused = [(key, key) for key in keys if key not in reader.takes]
    patterns = [f"columns.{key}.pattern" for key, column in made.columns.items() if column.pattern is not None]
    unused += [(key, PATTERN) for key in patterns if PATTERN not in reader.takes]
    if unused:
        key, needed = unused[0]
        names = ", ".join(each.name for each in READERS.values() if needed in each.takes)
        raise UserError(f"{made.where}: {key} is for {names}, the file is {reader.name}; leave it out")


def _with_text_keys(tree: object) -> object:
    """A tree as JSON takes it: YAML has keys and values that are numbers or dates."""
    if isinstance(tree, Mapping):
        return {str(key): _with_text_keys(value) for key, value in tree.items()}
    if isinstance(tree, list):
        return [_with_text_keys(value) for value in tree]
    return str(tree)


def _cases(told: object, where: str) -> list[tuple[re.Pattern[str], Mapping[str, Any]]]:
    """Keys that hold for files whose name matches; their nulls take keys out."""
    if not isinstance(told, list):
        raise UserError(f"{where}: per_file is {told!r}; needed is a list of keys, each with 'files'")
    cases: list[tuple[re.Pattern[str], Mapping[str, Any]]] = []
    for i, tree in enumerate(told, 1):
        keys = Keys(tree, where, f"per_file, entry {i}")
        files = keys.pattern("files", "give a regular expression of file names")
        nested = next((key for key in ("per_file", "format") if key in tree), None)
        if nested is not None:
            raise UserError(f"{where}: {keys.path} has {nested}; that holds for all files")
        cases.append((files, {key: value for key, value in tree.items() if key != "files"}))
    return cases


def isometric_f0(
    folder: Path, suffix: str, reader: Reader, mapping_of: Callable[[Path], ImportMapping], sought: tuple[str, float]
) -> tuple[Quantity, str] | None:
    """F0 of the preparation whose files a folder holds, and its origin in words; None where no file tells it.

    Args:
        mapping_of: gives the mapping of each; its F0 is not used.
        sought: kind of the force, and pCa of the trial. Where several have it, the largest force counts: a fibre runs
            down.
    """
    kind, pca = sought
    found = [
        (force, file.name)
        for file in sorted(folder.iterdir())
        if file.suffix.lower() == suffix and file.is_file()
        for force in _forces(file, reader, mapping_of, sought)
    ]
    force, name = max(found, key=lambda each: each[0], default=(0.0, ""))
    if force <= 0.0:
        return None
    return Quantity(force, kind), f", the initial isometric force at pCa {pca:g} in {name}"


def _forces(
    file: Path, reader: Reader, mapping_of: Callable[[Path], ImportMapping], sought: tuple[str, float]
) -> Iterator[float]:
    """Initial isometric forces of a file's trials at a pCa, of those that have one and can be read."""
    kind, pca = sought
    with contextlib.suppress(UserError):  # a broken neighbour is told when its turn comes
        mapping = replace(mapping_of(file), f0=None, f0_at_pca=None)
        if mapping.force is None or mapping.force.unit.kind != kind:
            return
        found = reader.pca(file, mapping)
        if found is not None and abs(found - pca) > _SAME_PCA:
            return
        own = reader.completed(file, mapping)
        for pending in reader.trials(file, own):
            with contextlib.suppress(UserError):
                trial = made_of(pending.read(), own, file, isometric_scaling=False)
                force = isometric_force(Force(trial.force_time_s, trial.force_n), trial.facts.phases)
                if force is not None and trial.facts.pca is not None and abs(trial.facts.pca - pca) <= _SAME_PCA:
                    yield force
