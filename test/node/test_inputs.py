"""From messages to numbers: names, stamps, bounds, calcium by stamp."""

from __future__ import annotations

import math

import pytest

from xb_muscle_ros.node.inputs import (
    CalciumHistory,
    Counts,
    Names,
    Refusal,
    Scale,
    after,
    checked,
    length_change_l0,
    went_back,
)


def test_names_find_the_fibre_and_report_others_once() -> None:
    """An empty list of names stands for the fibre itself."""
    names = Names("a")
    assert names.index([], 1, "position") == 0
    assert names.index(["b", "a"], 2, "position") == 1
    assert names.index(["b"], 1, "position") is None
    assert names.news(["b", "a", "c", "b"]) == ["b", "c"]
    assert names.news(["b", "c"]) == []


@pytest.mark.parametrize(("names", "values"), [([], 0), ([], 2), (["a"], 0), (["a"], 2), (["a", "b"], 1)])
def test_as_many_values_as_names(names: list[str], values: int) -> None:
    """Anything else is ambiguous."""
    with pytest.raises(Refusal, match="send one per name"):
        Names("a").index(names, values, "position")


def test_a_sender_that_makes_up_names_does_not_fill_the_memory() -> None:
    """Reported they are still."""
    names = Names("a")
    for k in range(2000):
        assert names.news([f"n{k}"]) == [f"n{k}"]
    assert len(names._strangers._seen) <= 1000


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, 1.1, -0.1])
def test_checked_refuses(value: float) -> None:
    """Value and range are named."""
    with pytest.raises(Refusal, match=r"not finite|allowed is 0 to 1 µM"):
        checked(value, (0.0, 1.0), "calcium", "µM")


def test_length_change_is_that_of_a_trial() -> None:
    """The same bits as `Trial.length_change_l0`."""
    assert length_change_l0(0.0213, Scale(0.0199, 1.0)) == 0.0213 / 0.0199 - 1.0
    with pytest.raises(Refusal, match=r"allowed is -0\.5 to 0\.5 L0"):
        length_change_l0(0.05, Scale(0.0199, 1.0))


def test_stamps_ascend_but_not_by_hours() -> None:
    """A jump from a clock that starts at zero to one that counts from 1970 is a mistake."""
    assert after(5, None, "length") == 5
    assert after(6, 5, "length") == 6
    for stamp in (5, 4):
        with pytest.raises(Refusal, match="came after"):
            after(stamp, 5, "length")
    with pytest.raises(Refusal, match="send stamps of one clock"):
        after(1_700_000_000_000_000_000, 5, "length")


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
    assert history.last_stamp is None


def test_time_goes_back_by_more_than_messages_overtake_each_other() -> None:
    """A tenth of a second."""
    assert not went_back(0, None)
    assert not went_back(900_000_000, 1_000_000_000)
    assert went_back(899_999_999, 1_000_000_000)
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
