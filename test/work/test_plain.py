"""Records as plain data and back."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import pytest

from xb_muscle_ros.trials.trial import Array
from xb_muscle_ros.work.plain import from_plain, to_plain


class Pair(NamedTuple):
    value: float
    ends: list[tuple[float, float]]
    seen: npt.NDArray[np.bool_]


@dataclass
class Whole:
    name: str
    pairs: tuple[Pair, ...]
    by_name: Mapping[str, Pair]
    rows: Sequence[Sequence[float]]
    table: Array
    span: tuple[float, int] | None = None
    nothing: Pair | None = None
    kept: dict[str, int] = field(default_factory=dict, init=False)


def back(whole: Whole) -> Whole:
    return from_plain(Whole, json.loads(json.dumps(to_plain(whole))))


def made(**more: Any) -> Whole:
    one = Pair(0.1 + 0.2, [(1.0 / 3.0, math.inf)], np.array([True, False]))
    return Whole("a", (one, one._replace(value=-math.inf)), {"b": one}, [[1.0], []], np.eye(2) / 3.0, **more)


def test_records_come_back_to_the_last_bit() -> None:
    whole = made(span=(1e-300, 3))
    again = back(whole)
    assert (again.name, again.span, again.nothing, again.rows) == ("a", (1e-300, 3), None, [[1.0], []])
    assert np.array_equal(again.table, whole.table)
    for there, here in zip((*again.pairs, again.by_name["b"]), (*whole.pairs, whole.by_name["b"]), strict=True):
        assert isinstance(there, Pair)
        assert there[:2] == here[:2]
        assert there.seen.dtype == np.bool_
        assert np.array_equal(there.seen, here.seen)


def test_what_a_record_remembers_stays_behind() -> None:
    whole = made()
    whole.kept["a"] = 1
    assert "kept" not in to_plain(whole)
    assert back(whole).kept == {}


def test_a_field_of_its_kind_stays_as_it_is() -> None:
    one = made().pairs[0]
    assert from_plain(Whole, {**to_plain(made()), "nothing": one}).nothing is one


def test_a_field_that_is_none_is_an_error() -> None:
    with pytest.raises(KeyError, match="colour"):
        from_plain(Pair, {"colour": 1.0})
