"""From messages to numbers: names, stamps, bounds, calcium by stamp."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

from xb_muscle_ros.node.calcium import CalciumHistory
from xb_muscle_ros.node.names import Names
from xb_muscle_ros.node.rules import (
    LENGTH_CHANGE_L0,
    NO_STAMP,
    Counts,
    follows,
    impossible_length,
    inside,
    length_change_l0,
    out_of_order,
    outside,
    went_back,
)


def test_names_find_the_fibre_and_report_others_once() -> None:
    """An empty list of names stands for the fibre itself."""
    names = Names(["a"])
    everything = names.places([], 1, "position")
    assert (everything.fibres.tolist(), everything.values) == ([0], None)
    found = names.places(["b", "a"], 2, "position")
    assert found.values is not None
    assert (found.fibres.tolist(), found.values.tolist(), found.new) == ([0], [1], ["b"])
    assert names.places(["b"], 1, "position").fibres.size == 0
    assert names.places(["b", "a", "c", "b"], 4, "position").new == ["c"]
    assert names.places(["b", "c"], 2, "position").new == []


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1.1, -0.1])
def test_values_outside_are_refused(value: float) -> None:
    """Value and range are named; of an array each is looked at."""
    assert not inside(value, (0.0, 1.0))
    assert inside(np.array([value, 0.5]), (0.0, 1.0)).tolist() == [False, True]
    assert re.search(r"not finite|allowed is 0 to 1 µM", str(outside(value, (0.0, 1.0), "calcium", "µM")))


def test_length_change_is_that_of_a_trial() -> None:
    """The same bits as `Trial.length_change_l0`."""
    assert length_change_l0(0.0213, 0.0199) == 0.0213 / 0.0199 - 1.0
    assert not inside(length_change_l0(0.05, 0.0199), LENGTH_CHANGE_L0)
    assert "allowed is -0.5 to 0.5 L0" in str(impossible_length(0.05, 0.0199))


def test_stamps_ascend_but_not_by_hours() -> None:
    """A jump from a clock that starts at zero to one that counts from 1970 is a mistake."""
    late = 1_700_000_000_000_000_000
    for stamp, last, good in ((5, NO_STAMP, True), (6, 5, True), (5, 5, False), (4, 5, False), (late, 5, False)):
        assert follows(stamp, last) == good
        assert follows(stamp, np.array([last, stamp - 1])).tolist() == [good, True]
    for stamp in (5, 4):
        assert "came after" in str(out_of_order(stamp, 5, "length"))
    assert "send stamps of one clock" in str(out_of_order(late, 5, "length"))


def test_calcium_holds_from_its_stamp_on() -> None:
    """The newest value not later than the question; the future may already be known."""
    history = CalciumHistory()
    assert history.at(100) is None
    history.add(10, 1.0)
    history.add(20, 2.0)
    history.add(30, 3.0)
    assert history.at(9) is None
    assert [history.at(t) for t in (10, 19, 20, 29, 30, 99)] == [1.0, 1.0, 2.0, 2.0, 3.0, 3.0]
    assert history.last_stamp == 30


def test_calcium_can_be_cut_where_time_goes_back() -> None:
    """Values from a stamp on go; older ones stay."""
    history = CalciumHistory()
    for stamp in (10, 20, 30):
        history.add(stamp, 0.1 * stamp)
    history.cut(20)
    assert history.kept() == ((10, 1.0),)
    history.cut(0)
    assert history.kept() == ()
    assert history.last_stamp == NO_STAMP


def test_time_goes_back_by_more_than_messages_overtake_each_other() -> None:
    """A tenth of a second."""
    assert not went_back(0, NO_STAMP)
    assert not went_back(900_000_000, 1_000_000_000)
    assert went_back(899_999_999, 1_000_000_000)
    assert went_back(0, np.array([NO_STAMP, 10**9])).tolist() == [False, True]
    assert not went_back(2_000_000_000, 1_000_000_000)


def test_calcium_history_is_bounded_and_keeps_the_newest() -> None:
    """Calcium may run for hours before the first length comes."""
    history = CalciumHistory()
    for stamp in range(100_000):
        history.add(stamp, float(stamp))
    assert len(history._kept) <= 1024
    assert history.full
    assert history.at(99_999) == 99_999.0
    assert not history.full


def test_counts_tell_what_is_new() -> None:
    """Since the last look."""
    counts = Counts()
    counts["a"] += 2
    assert counts.new() == 2
    assert counts.new() == 0
    counts["b"] += 1
    assert counts.new() == 1
