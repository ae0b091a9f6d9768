"""A diagnosis to JSON and back, by the fields and type hints of its dataclasses: keys are the fields' names."""

from __future__ import annotations

import dataclasses
import enum
import math
import types
import typing
from collections.abc import Collection, Mapping
from types import MappingProxyType
from typing import Any, TypeVar

import numpy as np

from xb_muscle_ros.diagnose.result import FORMAT, Diagnosis
from xb_muscle_ros.errors import UserError

T = TypeVar("T")

_AGAIN = "run xb_muscle diagnose again"
# Keys of former formats under today's names.
_RENAMED: Mapping[int, Mapping[str, str]] = MappingProxyType(
    {
        2: {
            "explained_share": "explained_fraction", "share_of_mismatch": "ablation_loss", "remaining": "residual",
            "where": "places", "nuisances": "nuisance_parameters", "noise_from": "noise_source", "how": "glossary",
            "explained": "explained_fraction", "others": "other_scalings",
        },
    }
)  # fmt: skip
_READ = tuple(_RENAMED)
# Objects whose keys are no fields.
_PLAIN = ("how", "augmented", "map_before", "map_after", "others")


def to_json(d: Diagnosis) -> dict[str, Any]:
    """Plain data: enums by value, tuples as lists, null for what is not finite."""
    row = _encoded(d)
    if not isinstance(row, dict):
        raise TypeError(f"{type(d).__name__} is no record")
    return row


def from_json(row: object, where: str = "diagnosis.json") -> Diagnosis:
    """The diagnosis that `to_json` made plain.

    Keys that are no fields are passed over: files hold the summary as well. Null stands for NaN where a number has to
    be.

    Args:
        where: the file, for messages.

    Raises:
        UserError: a file of another version, a key that is missing, a value of another type.
    """
    if not isinstance(row, Mapping):
        raise UserError(f"{where} holds a {type(row).__name__}; give a file that xb_muscle diagnose wrote")
    version = row.get("format_version")
    if version is None and "version" in row:
        raise UserError(f"{where} was made by an older version (format {row['version']}); {_AGAIN}")
    if version in _READ:
        row = {**renamed(row, _RENAMED[version], _PLAIN), "format_version": FORMAT}
    elif version != FORMAT:
        known = " and ".join(map(str, (*_READ, FORMAT)))
        raise UserError(f"{where}: format_version is {version!r}, this version reads {known}; {_AGAIN}")
    return _record(Diagnosis, row, where)


def renamed(value: Any, names: Mapping[str, str], plain: Collection[str] = ()) -> Any:
    """What a file of a former format holds, under the keys of the present one.

    Args:
        names: present keys by former ones.
        plain: keys whose values have keys that are no fields.
    """
    if isinstance(value, list):
        return [renamed(one, names, plain) for one in value]
    if not isinstance(value, Mapping):
        return value
    return {names.get(key, key): one if key in plain else renamed(one, names, plain) for key, one in value.items()}


def _encoded(value: object) -> object:
    if isinstance(value, np.generic):
        value = value.item()
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {f.name: _encoded(getattr(value, f.name)) for f in dataclasses.fields(value)}
    if isinstance(value, enum.Enum):
        return value.value
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(key): _encoded(inner) for key, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return [_encoded(inner) for inner in value]
    if value is None or isinstance(value, (str, int)):
        return value
    raise TypeError(f"a {type(value).__name__} has no place in a diagnosis")


def _record(kind: type[T], row: object, where: str) -> T:
    if not isinstance(row, Mapping):
        raise _wrong(where, row, "an object")
    given: dict[str, Any] = {}
    hints = typing.get_type_hints(kind)
    for field in dataclasses.fields(kind):  # type: ignore[arg-type]  # every record is a dataclass
        if field.name in row:
            given[field.name] = _decoded(hints[field.name], row[field.name], f"{where}: {field.name}")
        elif field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING:
            raise UserError(f"{where}: {field.name} is missing; {_AGAIN}")
    return kind(**given)


def _decoded(hint: Any, value: object, where: str) -> object:
    """A value as its type hint wants it."""
    origin, inner = typing.get_origin(hint), typing.get_args(hint)
    if origin in (types.UnionType, typing.Union):
        (kind,) = (k for k in inner if k is not type(None))
        return None if value is None else _decoded(kind, value, where)
    if origin is tuple:
        return _tuple(inner, value, where)
    if origin is dict:
        if not isinstance(value, Mapping):
            raise _wrong(where, value, "an object")
        return {str(key): _decoded(inner[1], one, f"{where}.{key}") for key, one in value.items()}
    if dataclasses.is_dataclass(hint) and isinstance(hint, type):
        return _record(hint, value, where)
    if issubclass(hint, enum.Enum):
        try:
            return hint(value)
        except ValueError as error:
            raise _wrong(where, value, "one of " + ", ".join(str(member.value) for member in hint)) from error
    if hint is float and value is None:
        return math.nan
    if not isinstance(value, _ACCEPTED[hint]) or (isinstance(value, bool) and hint is not bool):
        raise _wrong(where, value, _WANTED[hint])
    return hint(value)


_ACCEPTED: dict[type, tuple[type, ...]] = {float: (int, float), str: (str,), int: (int,), bool: (bool,)}
_WANTED = {float: "a number", str: "text", int: "a whole number", bool: "true or false"}


def _tuple(inner: tuple[Any, ...], value: object, where: str) -> tuple[object, ...]:
    if not isinstance(value, list):
        raise _wrong(where, value, "a list")
    if inner[-1] is Ellipsis:
        inner = (inner[0],) * len(value)
    if len(value) != len(inner):
        raise _wrong(where, value, f"a list of {len(inner)}")
    return tuple(_decoded(k, one, f"{where}[{i}]") for i, (k, one) in enumerate(zip(inner, value, strict=True)))


def _wrong(where: str, value: object, wanted: str) -> UserError:
    shown = repr(value)
    return UserError(f"{where} is {shown if len(shown) < 60 else shown[:57] + '...'}; it has to be {wanted}; {_AGAIN}")
