"""All that an import was told, and the mapping it makes of that for each file."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from xb_muscle_ros.errors import UserError, suggest
from xb_muscle_ros.trials.readers.base import Reader
from xb_muscle_ros.trials.readers.description import ImportMapping, name_of
from xb_muscle_ros.trials.readers.mapping import build_mapping
from xb_muscle_ros.trials.readers.preparation import FoundF0, isometric_f0
from xb_muscle_ros.trials.readers.registry import READERS, reader_for
from xb_muscle_ros.trials.readers.tree import merged, subtree, text_at

# Raised when the same file and mapping would make another trial than before.
VERSION = 2
# Mappings, and F0 of preparations, that are kept: files come kind by kind and folder by folder.
_KEPT = 64


class MappingError(UserError):
    """The mapping is wrong, whatever the file; there is no use in going on with the next one."""


class _Case(NamedTuple):
    """Keys that hold for files whose name matches."""

    files: re.Pattern[str]
    tree: Mapping[str, Any]


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
            where: the mapping file or the command line, for messages.
            file_format: name of a reader; None for what the mapping says, or else each file looks like.
            isometric_scaling: see `assembly.trial_of`.
            overrides: goes before the mapping file, for every file.

        Raises:
            UserError: an unknown format, or ``per_file`` that cannot be used.
        """
        rest = dict(tree)
        self._format = file_format or rest.pop("format", None)
        rest.pop("format", None)
        if self._format is not None and self._format not in READERS:
            raise UserError(f"{where}: format is '{self._format}'{suggest(str(self._format), READERS)}")
        self._cases = _cases(rest.pop("per_file", []), where)
        self._tree, self._where, self._overrides = rest, where, overrides or {}
        self.isometric_scaling = isometric_scaling
        self._mappings: dict[tuple[str, tuple[int, ...]], tuple[ImportMapping, str]] = {}
        self._preparations: dict[tuple[Path, str, str], FoundF0 | None] = {}
        if not self._cases and self._format is not None:
            self._mapping(READERS[self._format], ())

    def prepare(self, path: Path) -> Prepared:
        """What a file needs to be read.

        Raises:
            UserError: it cannot be read, is of no known format, or its F0 cannot be found.
            MappingError: the mapping does not fit its format.
        """
        reader = reader_for(path, self._format)
        matching = tuple(i for i, case in enumerate(self._cases) if case.files.search(name_of(path)))
        mapping, digest = self._mapping(reader, matching)
        if mapping.f0_at_pca is not None:
            f0, note = self._f0(path, reader, mapping, digest, mapping.f0_at_pca)
            mapping = replace(mapping, f0=f0, f0_note=note)
            digest = hashlib.sha256(f"{digest} {f0.value!r} {note}".encode()).hexdigest()
        return Prepared(path, reader, mapping, digest)

    def _f0(self, path: Path, reader: Reader, mapping: ImportMapping, digest: str, pca: float) -> FoundF0:
        folder, suffix = path.resolve().parent, path.suffix.lower()
        key = (folder, suffix, digest)
        if key not in self._preparations:
            _make_room(self._preparations)
            self._preparations[key] = isometric_f0(folder, suffix, reader, mapping, pca)
        found = self._preparations[key]
        if found is None:
            raise UserError(
                f"{path}: no {suffix} file in its folder has an isometric force at pCa {pca:g}, so F0 is not known; "
                "add that trial, or give f0 in the mapping or by --f0"
            )
        return found

    def _mapping(self, reader: Reader, matching: tuple[int, ...]) -> tuple[ImportMapping, str]:
        key = (reader.name, matching)
        if key not in self._mappings:
            tree = merged(reader.defaults, self._tree)
            for i in matching:
                tree = merged(tree, self._cases[i].tree)
            tree = merged(tree, self._overrides)
            told = json.dumps([VERSION, reader.name, self.isometric_scaling, _with_text_keys(tree)], sort_keys=True)
            try:
                made = build_mapping(tree, self._where, reader.kind)
                _check_format(made, reader)
            except UserError as problem:
                raise MappingError(str(problem)) from None
            _make_room(self._mappings)
            self._mappings[key] = made, hashlib.sha256(told.encode()).hexdigest()
        return self._mappings[key]


def _check_format(made: ImportMapping, reader: Reader) -> None:
    """What only tables have."""
    told = {"columns.trial": made.trial_column, "decimal": made.decimal, "columns.time.rate": made.rate_hz}
    unused = next((key for key, value in told.items() if value is not None), None)
    if unused is not None and reader.name != "csv":
        raise UserError(f"{made.where}: {unused} is for tables (csv), the file is {reader.name}; leave it out")


def _with_text_keys(tree: object) -> object:
    """A tree as JSON takes it: YAML has keys and values that are numbers or dates."""
    if isinstance(tree, Mapping):
        return {str(key): _with_text_keys(value) for key, value in tree.items()}
    if isinstance(tree, list):
        return [_with_text_keys(value) for value in tree]
    return str(tree)


def _make_room(kept: dict[Any, Any]) -> None:
    if len(kept) >= _KEPT:
        kept.clear()


def _cases(told: object, where: str) -> tuple[_Case, ...]:
    if not isinstance(told, list):
        raise UserError(f"{where}: per_file is {told!r}; needed is a list of keys, each with 'files'")
    cases = []
    for i, each in enumerate(told, 1):
        tree = dict(subtree(each, f"per_file, entry {i},", where))
        text = text_at(tree, "files", f"{where}: per_file, entry {i}", needed="give a regular expression of file names")
        del tree["files"]
        nested = next((key for key in ("per_file", "format") if key in tree), None)
        if nested is not None:
            raise UserError(f"{where}: per_file, entry {i} has {nested}; that holds for all files")
        try:
            cases.append(_Case(re.compile(text), tree))
        except re.error as problem:
            raise UserError(f"{where}: per_file, entry {i}: '{text}' is no regular expression: {problem}") from problem
    return tuple(cases)
