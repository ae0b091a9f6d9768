"""Records as plain data, for tasks that go to other processes and for journals; and back, by their type hints."""

from __future__ import annotations

import dataclasses
import functools
import types
import typing
from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

import numpy as np

T = TypeVar("T")


def to_plain(record: Any) -> dict[str, Any]:
    """A dataclass, named tuple or mapping by its fields, as Python's JSON can hold it: arrays become nested lists."""
    fields: Mapping[str, Any]
    if dataclasses.is_dataclass(record):
        fields = {field.name: getattr(record, field.name) for field in dataclasses.fields(record) if field.init}
    else:
        fields = record if isinstance(record, Mapping) else record._asdict()
    return {name: _plain(value) for name, value in fields.items()}


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, Mapping) or _is_record(value):
        return to_plain(value)
    return [_plain(each) for each in value] if isinstance(value, (list, tuple)) else value


def from_plain(kind: type[T], row: Mapping[str, Any]) -> T:
    """A dataclass or named tuple from what `to_plain` made of it; numbers are the same to the last bit.

    Fields may be of such kinds themselves, arrays of one dimension or of any where they are not empty, tuples,
    sequences and mappings of texts to these, each or None. A field that is of its kind already stays as it is.
    """
    made: T = _made(kind, row)
    return made


def _made(hint: Any, value: Any) -> Any:
    """A value as its type hint wants it."""
    origin, inner = typing.get_origin(hint), typing.get_args(hint)
    if origin in (types.UnionType, typing.Union):
        (only,) = (each for each in inner if each is not types.NoneType)
        return None if value is None else _made(only, value)
    if origin is np.ndarray:
        return np.array(value, dtype=typing.get_args(inner[1])[0])
    if origin is tuple:
        return tuple(map(_made, inner if inner[-1] is not ... else inner[:1] * len(value), value))
    if origin in (list, Sequence):
        return [_made(inner[0], each) for each in value]
    if origin in (dict, Mapping):
        return {key: _made(inner[1], each) for key, each in value.items()}
    if not _is_record(hint) or isinstance(value, hint):
        return value
    hints = _hints(hint)
    return hint(**{name: _made(hints[name], each) for name, each in value.items()})


def _is_record(value: Any) -> bool:
    """Whether it is a dataclass or a named tuple, or an instance of one."""
    return dataclasses.is_dataclass(value) or hasattr(value, "_asdict")


_hints = functools.cache(typing.get_type_hints)
