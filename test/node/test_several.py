"""Names of many fibres in the messages of one node."""

from __future__ import annotations

import pytest
from many_fibres import NAMES

from xb_muscle_ros.node.inputs import Refusal
from xb_muscle_ros.node.several import NamesOfMany


def test_names_find_their_places() -> None:
    """In any order, some or all, none for all; strangers are news once; of a name that comes twice the first counts."""
    names = NamesOfMany(NAMES)
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
