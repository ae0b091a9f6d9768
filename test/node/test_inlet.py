"""The callbacks, without ROS: what is taken, what is refused, and how often one hears of it."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.node.inlet import Inlet
from xb_muscle_ros.node.joint_state import Joints
from xb_muscle_ros.node.rules import Refusal, Trouble

FIBRES = ["left", "right", "back"]


def message(position: Any, name: Any = (), velocity: Any = ()) -> Any:
    header = SimpleNamespace(stamp=SimpleNamespace(sec=1, nanosec=5))
    return Joints.of(
        SimpleNamespace(header=header, name=list(name), position=list(position), velocity=list(velocity), effort=[])
    )


class Taken:
    """Keeps what it is given; refuses stamps or fails where it is told to."""

    def __init__(self) -> None:
        self.length: list[Any] = []
        self.calcium: list[Any] = []
        self.error: Refusal | UserError | None = None

    def take_length(self, stamp: int, *values: Any) -> Any:
        self.length.append((stamp, *(v.tolist() if isinstance(v, np.ndarray) else v for v in values)))
        return [] if self.error is None else [Trouble(int(values[0][-1]) // 2, self.error)]

    def take_calcium(self, stamp: int, *values: Any) -> Any:
        self.calcium.append((stamp, *(v.tolist() if isinstance(v, np.ndarray) else v for v in values)))
        return []


@pytest.fixture
def taken() -> Taken:
    return Taken()


@pytest.fixture
def one(taken: Taken, notes: Any) -> Inlet:
    inlet = Inlet(["left"], taken, notes)
    inlet.open = True
    return inlet


@pytest.fixture
def many(taken: Taken, notes: Any) -> Inlet:
    inlet = Inlet(FIBRES, taken, notes)
    inlet.open = True
    return inlet


def test_one_takes_its_own_value(one: Inlet, taken: Taken) -> None:
    one.take_length(message([0.1, 0.2], ["right", "left"], [0.0, 3.0]))
    one.take_calcium(message([5.0]))
    assert taken.length == [(1_000_000_005, [0], [0.2], [3.0])]
    assert taken.calcium == [(1_000_000_005, [0], [5.0])]
    assert one.last_length_s is not None


def test_many_take_theirs_in_their_order(many: Inlet, taken: Taken) -> None:
    many.take_length(message([0.3, 0.1], ["back", "left"]))
    many.take_calcium(message([5.0, 6.0, 7.0]))
    assert taken.length == [(1_000_000_005, [2, 0], [0.3, 0.1], None)]
    assert taken.calcium == [(1_000_000_005, [0, 1, 2], [5.0, 6.0, 7.0])]


@pytest.mark.parametrize("which", ["one", "many"])
def test_closed_doors_take_nothing(request: pytest.FixtureRequest, taken: Taken, which: str) -> None:
    inlet = request.getfixturevalue(which)
    inlet.open = False
    inlet.take_length(message([math.nan] * 9))
    inlet.take_calcium(message([math.nan] * 9))
    assert (taken.length, taken.calcium, inlet.refused) == ([], [], {})


@pytest.mark.parametrize("which", ["one", "many"])
def test_each_reason_is_heard_of_once(request: pytest.FixtureRequest, taken: Taken, notes: Any, which: str) -> None:
    """And counted each time."""
    inlet = request.getfixturevalue(which)
    values = [0.1] if which == "one" else [0.1, 0.2, 0.3]
    for _ in range(3):
        inlet.take_length(message([*values, 0.4]))
        inlet.take_length(message(values, velocity=[0.0, 0.0]))
        inlet.take_calcium(message([-1.0, *values[1:]]))
    assert inlet.refused == {"wrong array size": 6, "out of range": 3}
    size, calcium = notes.lines
    assert size.startswith("warning length refused (wrong array size, 1 so far): wrong array size: ")
    whose = "" if which == "one" else " of left"
    assert calcium.startswith(
        f"warning calcium{whose} refused (out of range, 1 so far): out of range: calcium is -1 µM"
    )
    assert taken.length == []
    assert len(taken.calcium) == (0 if which == "one" else 3)


@pytest.mark.parametrize("which", ["one", "many"])
def test_velocity_that_is_no_number(request: pytest.FixtureRequest, taken: Taken, which: str) -> None:
    inlet = request.getfixturevalue(which)
    inlet.take_length(message([0.1, 0.2], ["left", "right"], [math.nan, 1.0]))
    assert inlet.refused == {"not finite": 1}
    assert taken.length == ([] if which == "one" else [(1_000_000_005, [1], [0.2], [1.0])])


@pytest.mark.parametrize("which", ["one", "many"])
def test_strangers_are_news_once(request: pytest.FixtureRequest, notes: Any, which: str) -> None:
    inlet = request.getfixturevalue(which)
    for _ in range(2):
        inlet.take_length(message([0.1, 0.2, 0.3, 0.4, 0.5], ["left", *"abcd"]))
    assert inlet.ignored_names == 4
    here = "fibre left" if which == "one" else "fibres left, right, back"
    assert notes.lines == [f"warning names ignored: a, b, c and 1 more; this node has {here}"]


@pytest.mark.parametrize("which", ["one", "many"])
def test_what_stops_is_an_error_each_time(request: pytest.FixtureRequest, taken: Taken, notes: Any, which: str) -> None:
    inlet = request.getfixturevalue(which)
    taken.error = UserError("state q2 is -1")
    for _ in range(2):
        inlet.take_length(message([0.1] if which == "one" else [0.1, 0.2, 0.3]))
    whose = "" if which == "one" else "right "
    assert notes.lines == [f"error {whose}stopped: state q2 is -1; call ~/reset to start again"] * 2
    assert inlet.refused == {}


@pytest.mark.parametrize("which", ["one", "many"])
def test_what_is_refused_stays_known_until_something_is_taken(
    request: pytest.FixtureRequest, taken: Taken, which: str
) -> None:
    """By topic, and by fibre where there are many; each refusal is counted."""
    inlet = request.getfixturevalue(which)
    name = "left" if which == "many" else ""
    for _ in range(3):
        inlet.take_calcium(message([-1.0], ["left"]))
    assert [*inlet.refusing] == [("calcium", name)]
    assert inlet.refusing["calcium", name].times == 3
    assert "out of range: calcium is -1 µM; allowed is 0 to 10000 µM" in inlet.refusing["calcium", name].text
    inlet.take_length(message([1.0], ["left"]))
    assert [*inlet.refusing] == [("calcium", name)]
    inlet.take_calcium(message([1.0], ["left"]))
    assert not inlet.refusing


def test_another_fibre_does_not_clear_what_is_refused_of_one(many: Inlet) -> None:
    """A message of which a part is refused for good is news as well."""
    many.take_calcium(message([-1.0, 1.0], ["left", "right"]))
    many.take_calcium(message([1.0], ["right"]))
    assert [*many.refusing] == [("calcium", "left")]


def test_calcium_that_comes_twice_is_no_refusal(one: Inlet, taken: Taken) -> None:
    """Once as kept, once as sent; a stamp that is old for another reason is."""
    one.take_calcium(message([1.0], ["left"]), latched=True)

    def refuse(stamp: int, *values: Any) -> Any:
        return [Trouble(0, Refusal("stamp not after the last", "so it is"))]

    taken.take_calcium = refuse
    one.take_calcium(message([1.0], ["left"]))
    one.take_calcium(message([2.0], ["left"]), latched=True)
    assert not one.refused
    one.forget()
    one.take_calcium(message([1.0], ["left"]))
    assert one.refused == {"stamp not after the last": 1}


def test_numbers_of_a_publisher_tell_of_losses() -> None:
    """However the executor hands them over; not across publishers, and not while nobody listens."""
    import inspect

    from xb_muscle_ros.node.arrivals import Arrivals

    heard: list[Any] = []
    arrivals = Arrivals(heard.append)
    # rclpy asks in this way whether information is wanted.
    with pytest.raises(TypeError):
        inspect.signature(arrivals).bind(object())
    inspect.signature(arrivals).bind(object(), object())

    def come(number: int | None) -> None:
        arrivals("a", {"publication_sequence_number": number})

    come(5)
    come(9)
    arrivals.counting = True
    come(10)
    arrivals(("b", {"publication_sequence_number": 13}))
    assert (arrivals.lost, heard) == (2, ["a", "a", "a", "b"])
    arrivals.matched(SimpleNamespace(current_count=1))
    come(1)
    come(2)
    assert arrivals.told() == "2"
    arrivals.matched(SimpleNamespace(current_count=2))
    come(900)
    come(3)
    come(901)
    assert arrivals.told() == "2, not counted while 2 publish"
    come(None)
    assert arrivals.told() == "not known with this middleware"


def test_what_cannot_be_read_is_counted_and_over_with_the_next_good_message(one: Inlet, notes: Any) -> None:
    one.refuse("length", Refusal("not readable", "3 bytes"))
    assert one.refused["not readable"] == 1
    assert list(one.refusing) == [("length", "")]
    one.take_length(message([1.0]))
    assert not one.refusing
    one.open = False
    one.refuse("length", Refusal("not readable", "3 bytes"))
    assert one.refused["not readable"] == 1
