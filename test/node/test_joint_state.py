"""Serialized JointStates: what is read of bytes is what ROS reads of them, and what is written it can read."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

pytest.importorskip("rclpy")

from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import JointState

from xb_muscle_ros.node import traffic
from xb_muscle_ros.node.joint_state import Alike, Joints
from xb_muscle_ros.trials.joint_layout import FIELDS, Layout
from xb_muscle_ros.trials.ros_types import joint_state

TEXTS = st.text(st.characters(codec="utf-8", exclude_characters="\0"), max_size=9)
NUMBERS = st.lists(st.floats(allow_nan=True, allow_infinity=True), max_size=5)
STAMPS = st.tuples(st.integers(-(2**31), 2**31 - 1), st.integers(0, 2**32 - 1))
MESSAGES = st.builds(
    lambda stamp, frame, names, position, velocity, effort: _message(stamp, frame, names, position, velocity, effort),
    STAMPS,
    TEXTS,
    st.lists(TEXTS, max_size=5),
    NUMBERS,
    NUMBERS,
    NUMBERS,
)


def _message(stamp: Any, frame: str, names: Any, position: Any, velocity: Any, effort: Any) -> JointState:
    message = JointState(name=names, position=position, velocity=velocity, effort=effort)
    message.header.frame_id = frame
    message.header.stamp.sec, message.header.stamp.nanosec = stamp
    return message


def same(found: Joints, wanted: Joints) -> bool:
    pairs = zip(found[2:], wanted[2:], strict=True)
    return found[:2] == wanted[:2] and all(a.tobytes() == b.tobytes() for a, b in pairs)


def big_endian(data: bytes) -> bytes:
    """The same message as a big-endian machine would send it."""
    layout = Layout.of(data)
    assert layout is not None
    turned = bytearray(data)
    turned[:2] = b"\x00\x00"
    # After the origin: size and text of the frame, number of names, size and text of each, three counts.
    texts = {2, *(5 + 2 * k for k in range(len(layout.names)))}
    words = [(4, 4), (8, 4), *((begin, 4) for k, (begin, _) in enumerate(layout.fixed) if k > 0 and k not in texts)]
    for numbers in (layout.position, layout.velocity, layout.effort):
        words += [(numbers.begin + 8 * k, 8) for k in range(numbers.size)]
    for begin, size in words:
        turned[begin : begin + size] = turned[begin : begin + size][::-1]
    return bytes(turned)


def scribbled(data: bytes, value: int) -> bytes:
    """The same message with something else in its padding."""
    layout = Layout.of(data)
    assert layout is not None
    kept = np.zeros(len(data), dtype=bool)
    kept[4:12] = True
    for begin, end in layout.fixed:
        kept[begin:end] = True
    for numbers in (layout.position, layout.velocity, layout.effort):
        kept[numbers.begin : numbers.begin + 8 * numbers.size] = True
    return np.where(kept, np.frombuffer(data, np.uint8), np.uint8(value)).tobytes()


@settings(max_examples=200, deadline=None)
@given(st.lists(st.tuples(MESSAGES, st.integers(0, 2), st.integers(0, 255)), min_size=1, max_size=6))
def test_bytes_say_what_ros_reads_of_them(stream: list[tuple[JointState, int, int]]) -> None:
    """Whatever follows whatever, each message some times with other numbers, and with anything in its padding."""
    reader = traffic.Reader()
    for message, again, padding in stream:
        for k in range(again + 1):
            message.position = [value + k for value in message.position]
            data = scribbled(serialize_message(message), padding + k & 255)
            found = reader(data)
            assert same(found, Joints.of(deserialize_message(data, JointState)))


@settings(max_examples=100, deadline=None)
@given(MESSAGES)
def test_a_layout_is_found_in_whatever_ros_sends(message: JointState) -> None:
    """Where it says things are; a message that is cut off has none."""
    data = serialize_message(message)
    layout = Layout.of(data)
    assert layout is not None
    assert layout.names == tuple(message.name)
    assert [getattr(layout, f).of(data).tobytes() for f in FIELDS] == [getattr(message, f).tobytes() for f in FIELDS]
    assert Layout.of(data[: layout.fixed[-1][1] - 1]) is None


@settings(max_examples=100, deadline=None)
@given(MESSAGES)
def test_big_endian_bytes_are_left_to_ros(message: JointState) -> None:
    """Which reads them; of little-endian ones with the same names it makes no difference."""
    data = serialize_message(message)
    turned = big_endian(data)
    reader = traffic.Reader()
    wanted = Joints.of(message)
    assert Layout.of(turned) is None
    for one in (turned, data, data, turned):
        assert same(reader(one), wanted)


def test_only_the_same_names_and_counts_are_alike() -> None:
    """A bit elsewhere than in stamp, numbers or padding makes another message."""
    data = serialize_message(JointState(name=["left", "right"], position=[1.0, 2.0], effort=[3.0, 4.0]))
    layout = Layout.of(data)
    assert layout is not None
    alike = Alike(layout, data)
    fixed = {at for begin, end in layout.fixed for at in range(begin, end)}
    for at in range(len(data)):
        other = bytearray(data)
        other[at] ^= 1
        assert alike(bytes(other)) is (at not in fixed), at
    assert not alike(data + b"\0")


def test_names_stay_one_object_while_they_are_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    """And a message is made once for many of the kind."""
    made: list[bytes] = []

    def counted(data: bytes, kind: Any) -> Any:
        made.append(data)
        return deserialize_message(data, kind)

    monkeypatch.setattr(traffic, "deserialize_message", counted)
    reader = traffic.Reader()
    first, *later = (reader(serialize_message(JointState(name=["a"], position=[float(k)]))) for k in range(9))
    assert len(made) == 1
    assert [joints.position.tolist() for joints in later] == [[float(k)] for k in range(1, 9)]
    assert len({id(joints.names) for joints in later}) == 1
    assert first.names == later[0].names


def test_senders_that_take_turns_are_all_known(monkeypatch: pytest.MonkeyPatch) -> None:
    """Up to eight; of more the oldest is read whole again, and none is ever read wrongly."""
    made: list[bytes] = []

    def counted(data: bytes, kind: Any) -> Any:
        made.append(data)
        return deserialize_message(data, kind)

    monkeypatch.setattr(traffic, "deserialize_message", counted)
    reader = traffic.Reader()
    for count, wholes in ((8, 8), (9, 1 + 4 * 9)):
        made.clear()
        for k in range(5 * count):
            message = JointState(name=[f"fibre {k % count}"], position=[float(k)])
            assert same(reader(serialize_message(message)), Joints.of(message))
        assert len(made) == wholes


@pytest.mark.parametrize("as_bytes", [True, False])
@settings(max_examples=50, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(TEXTS, min_size=1, max_size=5), st.integers(1, 3), st.integers(0, 2**60))
def test_what_is_put_in_place_is_sent(as_bytes: bool, names: list[str], fields: int, stamp_ns: int) -> None:
    """As bytes and as a message."""
    sent: list[Any] = []
    outlet = traffic.Outlet(SimpleNamespace(publish=sent.append), names, len(names), FIELDS[:fields], as_bytes)
    values = np.arange(len(names)) + 0.5
    for scale in (1.0, math.nan, -3.0):
        for k, field in enumerate(FIELDS[:fields]):
            getattr(outlet, field)[:] = scale * values + k
        outlet.publish(stamp_ns)
        assert isinstance(sent[-1], bytes if as_bytes else JointState)
        found = Joints.of(deserialize_message(sent[-1], JointState) if as_bytes else sent[-1])
        empty = np.empty(0)
        wanted = [scale * values + k if k < fields else empty for k in range(len(FIELDS))]
        assert same(found, Joints(stamp_ns, tuple(names), *wanted))
        assert all(getattr(outlet, field).flags.aligned for field in FIELDS)


def test_unknown_middleware_gets_whole_messages_and_a_word(monkeypatch: pytest.MonkeyPatch, notes: Any) -> None:
    """Bytes are for what they were tried with."""
    assert traffic.as_bytes(notes)
    monkeypatch.setattr(traffic, "get_rmw_implementation_identifier", lambda: "rmw_other_cpp")
    assert not traffic.as_bytes(notes)
    assert notes.lines == [
        "info rmw_other_cpp: messages are read and written whole; bytes, faster, were tried with Fast DDS only"
    ]
    heard: list[Joints] = []
    traffic.hearing(heard.append, False)(JointState(name=["a"], position=[2.0]))
    assert (heard[0].names, heard[0].position.tolist()) == (("a",), [2.0])


def test_what_follows_a_message_is_nobodys() -> None:
    message = JointState(name=["a"], position=[1.0, 2.0])
    data = joint_state(0, ["a"], position=np.array([1.0, 2.0]))
    layout = Layout.of(data + bytes(range(8)))
    assert layout is not None
    assert layout.trimmed(data + bytes(range(8))) == data
    # rclpy makes more bytes than it fills.
    made = serialize_message(message)
    found = Layout.of(made)
    assert found is not None
    assert len(found.trimmed(made)) == len(data)
    assert deserialize_message(found.trimmed(made), JointState) == message
