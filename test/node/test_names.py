"""Names of many fibres in the messages of one node."""

from __future__ import annotations

import pytest
from many_fibres import NAMES

from xb_muscle_ros.node.names import Names, enumerated, front
from xb_muscle_ros.node.rules import Refusal


def test_names_find_their_places() -> None:
    """In any order, some or all, none for all; strangers are news once; of a name that comes twice the first counts."""
    names = Names(NAMES)
    everyone = names.places([], 3, "position")
    assert (everyone.fibres.tolist(), everyone.values, everyone.new) == ([0, 1, 2], None, [])
    for _ in range(2):
        found = names.places(["back", "left"], 2, "position")
        assert (found.fibres.tolist(), found.values) == ([2, 0], None)
    found = names.places(["ghost", "right", "right"], 3, "position")
    assert found.values is not None
    assert (found.fibres.tolist(), found.values.tolist(), found.new) == ([1], [1], ["ghost"])
    assert names.places(["ghost", "right", "right"], 3, "position").new == []
    assert names.places(["ghost"], 1, "position").new == []
    assert names.places([], 3, "position").fibres.tolist() == [0, 1, 2]
    for wrong, values in ((["left"], 2), ([], 2), ([], 1), (["left", "right"], 1)):
        with pytest.raises(Refusal, match="send one per name"):
            names.places(wrong, values, "position")


@pytest.mark.parametrize(("names", "values"), [([], 0), ([], 2), (["a"], 0), (["a"], 2), (["a", "b"], 1)])
def test_as_many_values_as_names(names: list[str], values: int) -> None:
    """Anything else is ambiguous."""
    with pytest.raises(Refusal, match="send one per name"):
        Names(["a"]).places(names, values, "position")


def test_a_sender_that_makes_up_names_does_not_fill_the_memory() -> None:
    """Reported they are still."""
    names = Names(["a"])
    for k in range(2000):
        assert names.places([f"n{k}"], 1, "position").new == [f"n{k}"]
    assert len(names._strangers) <= 1000


def test_one_fibre_needs_no_name() -> None:
    """Of many some are named."""
    assert front(["left"], [0]) == ""
    assert front(NAMES, [2, 0]) == "back, left: "


def test_what_is_said_of_names_has_an_end() -> None:
    assert enumerated(["x" * 1000]) == "x" * 100 + "…"


def test_no_names_stand_for_all() -> None:
    with pytest.raises(Refusal, match="0 values in position for no names, which stand for all 3 fibres; send one per"):
        Names(["a", "b", "c"]).places([], 0, "position")
