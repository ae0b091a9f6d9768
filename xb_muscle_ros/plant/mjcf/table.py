"""Which fibre each muscle of a model is made of: a table of a default, of groups by name pattern, and of muscles."""

from __future__ import annotations

import fnmatch
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

import yaml

from xb_muscle_ros import fast_yaml
from xb_muscle_ros.errors import UserError, suggest

_SECTIONS = ("default", "groups", "muscles")
_KEYS = ("fibre", "model", "method", "parameters", "tendon")
TENDONS = ("rigid", "elastic")


@dataclass(frozen=True)
class Choice:
    """What one muscle is made of.

    Attributes:
        fibre: name or file, see `load_fibre`.
        model: parameter set; the force-length relations are added to it.
        method: see `load_fibre`; None: the file's.
        tendon: one of `TENDONS`.
        parameters: other values of the model's parameters, by name.
    """

    fibre: str = "18Dec2017a"
    model: str = "3state_coop_slack"
    method: str | None = None
    tendon: str = "rigid"
    parameters: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))

    @property
    def key(self) -> tuple[object, ...]:
        """What tells apart fibres that differ in more than their muscle's geometry."""
        return self.fibre, self.model, self.method, tuple(sorted(self.parameters.items()))


Table = Mapping[str, Any] | str | Path | None


def choices(table: Table, muscles: Sequence[str]) -> list[Choice]:
    """One choice for each muscle: the default, changed by each group that it belongs to in turn, then by its own entry.

    Args:
        table: YAML file, the mapping that one holds, or None for `Choice`'s defaults.
        muscles: names.

    Raises:
        UserError: the file cannot be read, a key, muscle or pattern that is not known, or a value of the wrong kind.
    """
    where, tree = _read(table)
    _check_keys(where, tree, _SECTIONS)
    default = _changed(Choice(), tree.get("default") or {}, f"{where}, default")
    chosen = dict.fromkeys(muscles, default)
    for section, names, entry in _entries(where, tree, muscles):
        for name in names:
            chosen[name] = _changed(chosen[name], entry, section)
    return list(chosen.values())


def _read(table: Table) -> tuple[str, Mapping[str, Any]]:
    """What messages call the table, and its content."""
    if table is None or isinstance(table, Mapping):
        return "table", table or {}
    where = f"table {table}"
    if not isinstance(table, (str, Path)):
        raise UserError(f"table is of type {type(table).__name__}; needed is a YAML file or the mapping that one holds")
    try:
        tree = fast_yaml.load(Path(table).read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:  # not UTF-8, or a path that no file can have
        raise UserError(f"{where} cannot be read: {error}") from error
    except yaml.YAMLError as error:
        raise UserError(f"{where} is not valid YAML: {error}; mend the line it names") from error
    if tree is not None and not isinstance(tree, Mapping):
        raise UserError(f"{where} holds a {type(tree).__name__}; needed are the keys {', '.join(_SECTIONS)}")
    return where, tree or {}


def _entries(
    where: str, tree: Mapping[str, Any], muscles: Sequence[str]
) -> Iterator[tuple[str, list[str], Mapping[str, Any]]]:
    """What messages call an entry, whom it concerns, and what it says: groups in the table's order, then muscles."""
    for pattern, entry in _section(where, tree, "groups").items():
        matching = fnmatch.filter(muscles, str(pattern))
        if not matching:
            raise UserError(
                f"{where}: group '{pattern}' matches none of the {len(muscles)} muscles{suggest(str(pattern), muscles)}"
            )
        yield f"{where}, group {pattern}", matching, entry
    for name, entry in _section(where, tree, "muscles").items():
        if name not in muscles:
            raise UserError(f"{where}: the model has no muscle '{name}'{suggest(str(name), muscles)}")
        yield f"{where}, muscle {name}", [name], entry


def _section(where: str, tree: Mapping[str, Any], name: str) -> Mapping[Any, Any]:
    found = tree.get(name) or {}
    if not isinstance(found, Mapping):
        raise UserError(f"{where}: '{name}' is {found!r}; needed are entries of {', '.join(_KEYS)} by name")
    return found


def _changed(choice: Choice, entry: Any, where: str) -> Choice:
    if not isinstance(entry, Mapping):
        raise UserError(f"{where} is {entry!r}; needed are some of the keys {', '.join(_KEYS)}")
    _check_keys(where, entry, _KEYS)
    given = {key: entry[key] for key in _KEYS if entry.get(key) is not None}
    parameters = given.pop("parameters", {})
    if not isinstance(parameters, Mapping):
        raise UserError(f"{where}: parameters are {parameters!r}; needed are values by name, for example {{f: 95.0}}")
    for key, value in given.items():
        if not isinstance(value, (str, Path)):
            raise UserError(f"{where}: {key} is {value!r}; needed is text")
    if given.get("tendon", choice.tendon) not in TENDONS:
        raise UserError(f"{where}: tendon '{given['tendon']}' is not known; allowed are {' and '.join(TENDONS)}")
    merged = MappingProxyType({**choice.parameters, **parameters})
    return replace(choice, **{key: str(value) for key, value in given.items()}, parameters=merged)


def _check_keys(where: str, tree: Mapping[str, Any], known: Sequence[str]) -> None:
    for key in tree:
        if key not in known:
            raise UserError(f"{where}: key '{key}' is not known{suggest(str(key), known)}")
