"""Columns of many messages are what a library reads of each; files of many messages are what its readers expect."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader

from xb_muscle_ros.trials import bag_topics, bag_writing, ros_types
from xb_muscle_ros.trials.bag_contents import BagContents
from xb_muscle_ros.trials.bag_topics import Topics
from xb_muscle_ros.trials.bag_writer import BagWriter
from xb_muscle_ros.trials.bags import Simulated, read_simulated, read_trial, write_trial
from xb_muscle_ros.trials.joint_columns import UnusualError, names_of, picked
from xb_muscle_ros.trials.mcap_records import read_recording
from xb_muscle_ros.trials.messages import Messages
from xb_muscle_ros.trials.simulated import MOMENTS
from xb_muscle_ros.trials.trial import Trial, TrialFacts

TOPIC = "/t"
FIELDS = ("position", "velocity", "effort")
NUMBERS = st.floats(allow_nan=False, allow_infinity=False)
NAMES = st.lists(st.text(st.characters(exclude_categories=("Cs",)), max_size=9), min_size=1, max_size=4, unique=True)


@st.composite
def kinds(draw: st.DrawFn) -> tuple[list[str], tuple[bool, bool, bool]]:
    """Names, and which of the fields a publisher fills."""
    return draw(NAMES), (True, draw(st.booleans()), draw(st.booleans()))


@st.composite
def topics(draw: st.DrawFn) -> tuple[list[tuple[int, bytes]], list[str]]:
    """Messages of one to three publishers in any order, by log times that may step back; and all names."""
    publishers = draw(st.lists(kinds(), min_size=1, max_size=3))
    sent = []
    for k in range(draw(st.integers(1, 12))):
        names, filled = draw(st.sampled_from(publishers))
        fields = {
            field: np.array(draw(st.lists(NUMBERS, min_size=len(names), max_size=len(names))))
            for field, full in zip(FIELDS, filled, strict=True)
            if full
        }
        stamp = 10**9 * k + draw(st.integers(0, 10**9 - 1))
        sent.append((draw(st.integers(0, 2**63)), ros_types.joint_state(stamp, names, **fields)))
    return sent, [name for names, _ in publishers for name in names]


def _topic(sent: list[tuple[int, bytes]], cuts: list[int]) -> Topics:
    """Messages as two files would have them, taken one by one, and some together."""
    whole = Messages(TOPIC)
    for part in (sent[: cuts[0]], sent[cuts[0] :]):
        messages = Messages(TOPIC)
        for log_ns, data in part:
            messages.add(log_ns, data)
        whole.extend(messages)
    types, encodings = {TOPIC: ros_types.JOINT_STATE}, {TOPIC: "cdr"}
    return Topics(BagContents(Path("bag"), types, encodings, {}, {TOPIC: whole}, None, ()))


def _slowly(monkeypatch: pytest.MonkeyPatch) -> None:
    def unusual(*_: object, **__: object) -> None:
        raise UnusualError

    monkeypatch.setattr(bag_topics, "picked", unusual)
    monkeypatch.setattr(bag_topics, "names_of", unusual)


def _found(topic: Topics, names: list[str]) -> list[object]:
    """All that is said of a topic: names, samples of each, or why there are none."""
    said: list[object] = []
    for field in (("position",), ("position", "effort"), ("velocity",)):
        for name in names:
            try:
                said.append((topic.names(TOPIC), *topic.samples(TOPIC, field, name)))
            except Exception as error:
                said.append((type(error), str(error)))
    return said


@settings(max_examples=60, deadline=None)
@given(made=topics(), cut=st.integers(0, 12))
def test_columns_are_what_the_slow_way_reads(made: tuple[list[tuple[int, bytes]], list[str]], cut: int) -> None:
    sent, names = made
    fast = _found(_topic(sent, [cut]), names)
    with pytest.MonkeyPatch.context() as patch:
        _slowly(patch)
        slow = _found(_topic(sent, [cut]), names)
    for ours, theirs in zip(fast, slow, strict=True):
        assert len(ours) == len(theirs)
        for one, other in zip(ours, theirs, strict=True):
            if isinstance(one, np.ndarray):
                assert one.tobytes() == other.tobytes()
            else:
                assert one == other


@settings(max_examples=60, deadline=None)
@given(made=topics(), cut=st.integers(0, 12))
def test_messages_come_back_in_both_orders(made: tuple[list[tuple[int, bytes]], list[str]], cut: int) -> None:
    sent, _ = made
    messages = _topic(sent, [cut]).bag.messages[TOPIC]
    assert len(messages) == len(sent)
    assert [(each.log_time_ns, each.data) for each in messages.as_filed()] == sent
    assert [(each.log_time_ns, each.data) for each in messages] == sorted(sent, key=lambda one: one[0])
    assert messages.log_times().tolist() == [log_ns for log_ns, _ in sent]


def test_two_publishers_are_columns_too() -> None:
    """Names of one size within one block, which differ; and a third of another size."""
    sent = []
    for i in range(30):
        names = (["left"], ["knee"], ["left", "hip"])[i % 3]
        sent.append((i, ros_types.joint_state(10 * i, names, position=np.arange(len(names)) + float(i))))
    messages = _topic(sent, [11]).bag.messages[TOPIC]
    assert names_of(messages) == ["left", "knee", "hip"]
    found = picked(messages, lambda names: [("position", names.index("left"))] if "left" in names else None, 1)
    assert found.stamps_ns.tolist() == [10 * i for i in range(30) if i % 3 != 1]
    assert found.values[:, 0].tolist() == [float(i) for i in range(30) if i % 3 != 1]
    assert list(found.places) == [i for i in range(30) if i % 3 != 1]


def test_another_byte_order_is_read_as_well() -> None:
    def big_endian(stamp_s: int, value: float) -> bytes:
        head = struct.pack(">iI", stamp_s, 0) + struct.pack(">I", 1) + b"\0" + b"\0\0\0" + struct.pack(">I", 1)
        name = struct.pack(">I", 2) + b"f\0" + b"\0\0"
        numbers = struct.pack(">I", 1) + b"\0" * (-(len(head + name) + 4) % 8) + struct.pack(">d", value)
        return b"\0\0\0\0" + head + name + numbers + struct.pack(">II", 0, 0)

    topic = _topic([(i, big_endian(i + 1, 0.5 * i)) for i in range(3)], [3])
    found = topic.samples(TOPIC, ("position",), "f")
    assert found.time_s.tolist() == [1.0, 2.0, 3.0]
    assert found.values[:, 0].tolist() == [0.0, 0.5, 1.0]


def _recorded(samples: int) -> tuple[Trial, Simulated]:
    """Series of different rates, of which some stamps meet, over more than a chunk."""
    random = np.random.default_rng(2)
    time_s = np.arange(samples) / 10_000
    calcium_s = np.array([0.0, 0.05, 0.05017])
    force_s = time_s[::3] + 3e-5
    facts = TrialFacts("fibre µ", "t", reference_length_m=0.5)
    values = random.standard_normal((9, samples))
    trial = Trial(facts, time_s, values[0], calcium_s, np.ones(3), force_s, values[1][: force_s.size])
    moments = dict(zip(MOMENTS, values[3:], strict=True))
    return trial, Simulated(time_s, values[0], values[1], values[2], moments)


def test_many_chunks_are_what_other_readers_expect(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bag_writing, "_AT_ONCE", 1000)  # parts end within and beside chunks
    trial, simulated = _recorded(9000)
    write_trial(tmp_path / "bag", trial, simulated)
    with AnyReader([tmp_path / "bag"]) as reader:
        theirs = [(each.topic, log_ns, bytes(data)) for each, log_ns, data in reader.messages()]
        counts = {each.topic: each.msgcount for each in reader.connections}
    sizes = {
        ros_types.CALCIUM: 3, ros_types.LENGTH: 9000, ros_types.MEASURED_FORCE: 3000, ros_types.FORCE: 9000,
        ros_types.MOMENTS: 9000,
    }  # fmt: skip
    assert counts == sizes
    order = {topic: i for i, topic in enumerate(ros_types.TOPICS)}
    assert [one[:2] for one in theirs] == sorted((one[:2] for one in theirs), key=lambda one: (one[1], order[one[0]]))
    lengths = [data for topic, _, data in theirs if topic == ros_types.LENGTH]
    stamps = [log_ns for topic, log_ns, _ in theirs if topic == ros_types.LENGTH]
    one_by_one = [
        ros_types.joint_state(stamp, ["fibre µ"], position=trial.length_m[i : i + 1]) for i, stamp in enumerate(stamps)
    ]
    assert lengths == one_by_one
    with (tmp_path / "bag" / "bag_0.mcap").open("rb") as file:
        strict = make_reader(file, validate_crcs=True)
        summary = strict.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        assert summary.statistics.message_count == sum(sizes.values())
        assert len(summary.chunk_indexes) == summary.statistics.chunk_count > 3
        assert [(c.topic, m.log_time, m.data) for _, c, m in strict.iter_messages()] == theirs
        # By the index of a chunk alone.
        middle = summary.chunk_indexes[1].message_start_time
        later = [m.data for _, _, m in strict.iter_messages(topics=[ros_types.LENGTH], starting_at=middle)]
        assert later == [data for data, stamp in zip(lengths, stamps, strict=True) if stamp >= middle]
    found, answer = read_trial(tmp_path / "bag"), read_simulated(tmp_path / "bag")
    assert found.length_m.tobytes() == trial.length_m.tobytes()
    assert found.force_n.tobytes() == trial.force_n.tobytes()
    assert answer is not None
    assert all(answer.moments[name].tobytes() == simulated.moments[name].tobytes() for name in MOMENTS)


def test_a_changed_byte_in_a_chunk_is_seen(tmp_path: Path) -> None:
    trial, _ = _recorded(9000)
    write_trial(tmp_path / "bag", trial)
    file = tmp_path / "bag" / "bag_0.mcap"
    data = bytearray(file.read_bytes())
    data[len(data) // 2] ^= 0x10
    file.write_bytes(data)
    assert read_recording(file).damage == "damaged, a chunk's checksum is wrong"


def test_a_file_is_read_in_windows(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from xb_muscle_ros.trials import mcap_records

    trial, simulated = _recorded(2000)
    write_trial(tmp_path / "bag", trial, simulated)
    file = tmp_path / "bag" / "bag_0.mcap"
    whole = {topic: list(messages) for topic, messages in read_recording(file).messages.items()}
    for window in (9, 100, 5000):
        monkeypatch.setattr(mcap_records, "_WINDOW", window)
        found = read_recording(file)
        assert found.damage is None
        assert {topic: list(messages) for topic, messages in found.messages.items()} == whole


def test_single_messages_are_written_too(tmp_path: Path) -> None:
    stamps = [5, 3, 9]
    with BagWriter(tmp_path / "bag", "bag", {"key": "value"}) as writer:
        topic = writer.add_connection(TOPIC, ros_types.JOINT_STATE, typestore=ros_types.typestore())
        sent = [ros_types.joint_state(stamp, ["f"], position=np.array([0.1 * stamp])) for stamp in stamps]
        for stamp, data in zip(stamps, sent, strict=True):
            writer.write(topic, stamp, data)
    (found,) = read_recording(tmp_path / "bag" / "bag_0.mcap").messages.values()
    assert [(each.log_time_ns, each.data) for each in found.as_filed()] == list(zip(stamps, sent, strict=True))
    with AnyReader([tmp_path / "bag"]) as reader:
        assert (reader.start_time, reader.end_time, reader.message_count) == (3, 10, 3)
