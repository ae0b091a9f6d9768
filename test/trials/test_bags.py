"""Bags: what is written is read, bit for bit, and lies as rosbag2 wants it."""

from __future__ import annotations

import dataclasses
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from rosbags.rosbag2 import Reader

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials import ros_types
from xb_muscle_ros.trials.bags import Simulated, read_simulated, read_trial, write_trial
from xb_muscle_ros.trials.simulated import MOMENTS
from xb_muscle_ros.trials.stamps import to_ns, to_s
from xb_muscle_ros.trials.trial import Phase, Trial, TrialFacts

FINITE = st.floats(allow_nan=False, allow_infinity=False)
LINE = st.text(st.characters(exclude_categories=("Cc", "Cs", "Zl", "Zp")))
POSITIVE = st.floats(min_value=5e-324, allow_infinity=False)


def _same_bits(a: np.ndarray, b: np.ndarray) -> bool:
    return a.shape == b.shape and a.tobytes() == b.tobytes()


@st.composite
def trials(draw: st.DrawFn) -> Trial:
    """Any trial a bag can hold: stamps on the ns grid within 26 days, finite numbers, any text."""

    def series(smallest: int) -> tuple[np.ndarray, np.ndarray]:
        stamps = draw(st.lists(st.integers(0, 2 * 10**15), min_size=smallest, max_size=6, unique=True))
        values = draw(st.lists(FINITE, min_size=len(stamps), max_size=len(stamps)))
        return np.array(sorted(stamps)) / 1e9, np.array(values)

    optional = st.none() | FINITE
    phases = draw(st.lists(st.tuples(st.text(), FINITE, FINITE), max_size=3))
    facts = TrialFacts(
        fibre=draw(LINE.filter(bool)),
        trial=draw(LINE),
        pca=draw(optional),
        amplitude_l0=draw(optional),
        recovery_s=draw(optional),
        reference_length_m=draw(POSITIVE),
        f0_n=draw(POSITIVE),
        phases=tuple(Phase(name, min(a, b), max(a, b)) for name, a, b in phases),
        source=draw(LINE),
    )
    return Trial(facts, *series(1), *series(1), *series(0))


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(trials())
def test_round_trip_is_bit_exact(made: Trial) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "bag"
        write_trial(path, made)
        read = read_trial(path)
        (path / "metadata.yaml").unlink()
        assert read_trial(path).facts == made.facts  # from the copy in the file
    assert read.facts == made.facts
    assert read.warnings == ()
    for name in ("time_s", "length_m", "calcium_time_s", "calcium_um", "force_time_s", "force_n"):
        assert _same_bits(getattr(read, name), getattr(made, name)), name


@settings(deadline=None)
@given(st.integers(0, 2 * 10**15))
def test_a_stamp_survives_the_trip_through_seconds(stamp_ns: int) -> None:
    assert to_ns(to_s(np.array([stamp_ns])))[0] == stamp_ns


def test_simulated_comes_back(tmp_path: Path, trial: Trial, simulated: Simulated) -> None:
    write_trial(tmp_path / "bag", trial, simulated)
    read = read_simulated(tmp_path / "bag")
    assert read is not None
    for name in ("time_s", "force_n", "ce_length_m", "ce_velocity_m_per_s"):
        assert _same_bits(getattr(read, name), getattr(simulated, name)), name
    for name in MOMENTS:
        assert _same_bits(read.moments[name], simulated.moments[name]), name


def test_a_bag_without_simulation_has_none(tmp_path: Path, trial: Trial) -> None:
    write_trial(tmp_path / "bag", trial)
    assert read_simulated(tmp_path / "bag") is None


def test_metadata_is_what_rosbag2_writes(tmp_path: Path, trial: Trial, simulated: Simulated) -> None:
    write_trial(tmp_path / "bag", trial, simulated)
    assert sorted(f.name for f in (tmp_path / "bag").iterdir()) == ["bag_0.mcap", "metadata.yaml"]
    info = yaml.safe_load((tmp_path / "bag" / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    assert info["version"] == 9
    assert info["storage_identifier"] == "mcap"
    assert info["relative_file_paths"] == ["bag_0.mcap"]
    assert info["starting_time"]["nanoseconds_since_epoch"] == 0
    assert info["duration"]["nanoseconds"] == 4_000_000
    assert info["message_count"] == 22
    topics = {t["topic_metadata"]["name"]: t for t in info["topics_with_message_count"]}
    assert {name: t["message_count"] for name, t in topics.items()} == {
        "/muscle/calcium": 2,
        "/muscle/length": 5,
        "/muscle/measured_force": 5,
        "/muscle/force": 5,
        "/muscle/moments": 5,
    }
    for name, topic in topics.items():
        metadata = topic["topic_metadata"]
        assert metadata["type"] == "sensor_msgs/msg/JointState"
        assert metadata["serialization_format"] == "cdr"
        assert metadata["type_description_hash"].startswith("RIHS01_")
        assert len(metadata["type_description_hash"]) == len("RIHS01_") + 64
        (profile,) = metadata["offered_qos_profiles"]
        assert profile["reliability"] == "reliable"
        assert profile["history"] == "keep_last"
        assert profile["durability"] == ("transient_local" if name == "/muscle/calcium" else "volatile")
    assert info["ros_distro"] == "jazzy"
    assert info["custom_data"]["pca"] == "6.1"
    assert info["custom_data"]["amplitude_l0"] == "0.0383"
    assert all(isinstance(value, str) for value in info["custom_data"].values())


def test_another_reader_sees_stamps_fields_and_order(tmp_path: Path, trial: Trial, simulated: Simulated) -> None:
    write_trial(tmp_path / "bag", trial, simulated)
    seen = []
    with Reader(tmp_path / "bag") as reader:
        for connection, log_time_ns, data in reader.messages():
            message = ros_types.typestore().deserialize_cdr(data, connection.msgtype)
            stamp_ns = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
            assert stamp_ns == log_time_ns
            assert message.header.frame_id == ""
            seen.append((log_time_ns, connection.topic, message))
    at_2_ms = [(topic, message) for stamp, topic, message in seen if stamp == 2_000_000]
    names = ["/muscle/calcium", "/muscle/length", "/muscle/measured_force", "/muscle/force", "/muscle/moments"]
    assert [topic for topic, _ in at_2_ms] == names
    assert [stamp for stamp, _, _ in seen] == sorted(stamp for stamp, _, _ in seen)
    calcium, length, measured, force, moments = (message for _, message in at_2_ms)
    assert (calcium.name, list(calcium.position)) == (["18Dec2017a"], [31.622776601683793])
    assert list(length.position) == [trial.length_m[2]]
    assert (list(measured.effort), len(measured.position)) == ([1.2e-4], 0)
    assert (list(force.effort), list(force.position), list(force.velocity)) == ([2.002], [3.002], [4.002])
    assert moments.name == [f"18Dec2017a/{m}" for m in ("q0", "q1", "q2", "n_on", "drx", "r")]
    assert list(moments.position) == [10.002, 20.002, 30.002, 40.002, 50.002, 60.002]


def test_stamps_are_exact_to_the_ns(tmp_path: Path, trial: Trial) -> None:
    time_s = np.array([0.1, 0.100000001, 3.000000007])
    made = dataclasses.replace(trial, time_s=time_s, length_m=np.ones(3))
    write_trial(tmp_path / "bag", made)
    with Reader(tmp_path / "bag") as reader:
        connections = [c for c in reader.connections if c.topic == "/muscle/length"]
        assert [stamp for _, stamp, _ in reader.messages(connections)] == [100_000_000, 100_000_001, 3_000_000_007]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"time_s": np.array([0.0, 0.002, 0.001, 0.003, 0.004])}, ["/muscle/length", "sample 2", "0.001"]),
        ({"time_s": np.array([0.0, 0.001, 0.001 + 1e-13, 0.003, 0.004])}, ["/muscle/length", "sample 2", "1 ns"]),
        ({"time_s": np.array([-0.001, 0.001, 0.002, 0.003, 0.004])}, ["/muscle/length", "-0.001", "shift"]),
        ({"length_m": np.array([1.0, np.nan, 1.0, 1.0, 1.0])}, ["/muscle/length", "sample 1", "nan"]),
        ({"force_n": np.array([1.0, 1.0, 1.0, 1.0, np.inf])}, ["/muscle/measured_force", "sample 4", "inf"]),
        ({"calcium_um": np.array([1.0])}, ["/muscle/calcium", "1 values at 2 times"]),
        ({"calcium_time_s": np.empty(0), "calcium_um": np.empty(0)}, ["no samples", "/muscle/calcium"]),
        ({"time_s": np.empty(0), "length_m": np.empty(0)}, ["no samples", "/muscle/length"]),
    ],
)
def test_a_trial_that_no_bag_can_hold_is_refused(
    tmp_path: Path, trial: Trial, change: dict[str, np.ndarray], words: list[str]
) -> None:
    with pytest.raises(UserError) as refused:
        write_trial(tmp_path / "bag", dataclasses.replace(trial, **change))
    for word in ["bag", *words]:
        assert word in str(refused.value)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "text", ["a'\"b  " * 40, "\u00e9  \U00010000\\ud800\"' " * 20, " - : # {x} [y] & * ! | > % @ `", "yes", "1_0"]
)
def test_long_and_odd_text_survives(tmp_path: Path, trial: Trial, text: str) -> None:
    phases = (Phase(text, 0.0, 0.004),)
    facts = dataclasses.replace(trial.facts, source=text, trial=text, phases=phases)
    write_trial(tmp_path / "bag", dataclasses.replace(trial, facts=facts))
    assert read_trial(tmp_path / "bag").facts == facts
    (tmp_path / "bag" / "metadata.yaml").unlink()
    assert read_trial(tmp_path / "bag").facts == facts


def test_text_of_more_than_a_line_is_refused(tmp_path: Path, trial: Trial) -> None:
    facts = dataclasses.replace(trial.facts, source="one\ntwo")
    with pytest.raises(UserError, match=r"source holds the control character '\\n'"):
        write_trial(tmp_path / "bag", dataclasses.replace(trial, facts=facts))
    assert list(tmp_path.iterdir()) == []


def test_an_older_bag_is_replaced_and_nothing_is_left_over(tmp_path: Path, trial: Trial) -> None:
    write_trial(tmp_path / "bag", trial)
    write_trial(tmp_path / "bag", dataclasses.replace(trial, length_m=np.full(5, 2.0)))
    assert read_trial(tmp_path / "bag").length_m.tolist() == [2.0] * 5
    assert [f.name for f in tmp_path.iterdir()] == ["bag"]


def test_a_place_that_cannot_be_written_is_named(tmp_path: Path, trial: Trial) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(UserError, match=r"file.bag cannot be written"):
        write_trial(tmp_path / "file" / "bag", trial)


def test_another_folder_is_not_overwritten(tmp_path: Path, trial: Trial) -> None:
    (tmp_path / "thesis").mkdir()
    (tmp_path / "thesis" / "chapter1.tex").write_text("years of work")
    with pytest.raises(UserError, match=r"thesis.*chapter1\.tex"):
        write_trial(tmp_path / "thesis", trial)
    assert (tmp_path / "thesis" / "chapter1.tex").read_text() == "years of work"


def test_a_file_is_not_overwritten(tmp_path: Path, trial: Trial) -> None:
    (tmp_path / "notes").write_text("keep")
    with pytest.raises(UserError, match="notes"):
        write_trial(tmp_path / "notes", trial)
    assert (tmp_path / "notes").read_text() == "keep"


def _messages(samples: dict[str, list[tuple[int, bytes]]]) -> list[tuple[str, int, bytes]]:
    return sorted(((topic, t, data) for topic, each in samples.items() for t, data in each), key=lambda m: m[1])


def _position(t: int, value: float, name: str = "f") -> tuple[int, bytes]:
    return t, ros_types.joint_state(t, [name], position=np.array([value]))


GOOD = {"/muscle/calcium": [_position(0, 1.0)], "/muscle/length": [_position(0, 1.0), _position(1_000_000, 1.1)]}
EMPTY = (500_000, ros_types.joint_state(500_000, ["f"]))
NAMELESS = (500_000, ros_types.joint_state(500_000, [], position=np.array([1.0])))


@pytest.mark.parametrize(
    ("samples", "words"),
    [
        ({"/muscle/calcium": GOOD["/muscle/calcium"]}, ["/muscle/length", "topics there: /muscle/calcium"]),
        ({"/muscle/length": GOOD["/muscle/length"]}, ["/muscle/calcium", "topics there: /muscle/length"]),
        ({**GOOD, "/muscle/calcium": [EMPTY]}, ["/muscle/calcium", "message 0", "0.000500000 s", "empty position"]),
        ({**GOOD, "/muscle/length": [_position(0, 1.0), NAMELESS]}, ["/muscle/length", "message 1", "empty name"]),
        ({**GOOD, "/muscle/length": [_position(0, 1.0), _position(9, np.nan)]}, ["/muscle/length", "message 1", "nan"]),
        ({**GOOD, "/muscle/calcium": [_position(0, np.inf)]}, ["/muscle/calcium", "message 0", "inf"]),
        ({**GOOD, "/muscle/length": [_position(0, 1.0), _position(9, 1.0, "g")]}, ["of fibres 'f', 'g'"]),
        ({**GOOD, "/muscle/measured_force": [_position(7, 1.0)]}, ["/muscle/measured_force", "empty effort"]),
        ({**GOOD, "/muscle/length": [(0, b"\x00\x01")]}, ["/muscle/length", "message 0", "decoded"]),
    ],
)
def test_a_bag_of_another_kind_is_refused_by_name(
    raw_bag: Callable[..., Path], samples: dict[str, list[tuple[int, bytes]]], words: list[str]
) -> None:
    path = raw_bag(_messages(samples))
    with pytest.raises(UserError) as refused:
        read_trial(path)
    for word in [str(path), *words]:
        assert word in str(refused.value)


def test_stamps_that_go_back_are_refused(raw_bag: Callable[..., Path]) -> None:
    stamps = [0, 2_000_000, 1_000_000]
    length = [("/muscle/length", i, _position(stamp, 1.0)[1]) for i, stamp in enumerate(stamps)]
    path = raw_bag([("/muscle/calcium", 0, _position(0, 1.0)[1]), *length])
    with pytest.raises(UserError, match=r"/muscle/length, message 2 at t = 0\.001000000 s does not come after"):
        read_trial(path)


def test_equal_stamps_are_refused(raw_bag: Callable[..., Path]) -> None:
    length = [("/muscle/length", 0, _position(5, 1.0)[1])] * 2
    with pytest.raises(UserError, match=r"/muscle/length, message 1 at t = 0\.000000005 s does not come after"):
        read_trial(raw_bag([("/muscle/calcium", 0, _position(0, 1.0)[1]), *length]))


def test_another_message_type_is_refused(raw_bag: Callable[..., Path]) -> None:
    message = ros_types.typestore().types["std_msgs/msg/Float64"](data=1.0)
    data = bytes(ros_types.typestore().serialize_cdr(message, "std_msgs/msg/Float64"))
    path = raw_bag(
        [*_messages({"/muscle/calcium": GOOD["/muscle/calcium"]}), ("/muscle/length", 0, data)],
        {"/muscle/length": "std_msgs/msg/Float64"},
    )
    with pytest.raises(UserError, match=r"/muscle/length is std_msgs/msg/Float64.*sensor_msgs/msg/JointState"):
        read_trial(path)


def test_an_empty_bag_is_refused(raw_bag: Callable[..., Path]) -> None:
    with pytest.raises(UserError, match=r"raw is empty"):
        read_trial(raw_bag([]))


def test_a_foreign_fibre_name_is_pointed_out(tmp_path: Path, trial: Trial) -> None:
    write_trial(tmp_path / "bag", trial)
    text = (tmp_path / "bag" / "metadata.yaml").read_text()
    (tmp_path / "bag" / "metadata.yaml").write_text(text.replace("fibre: 18Dec2017a", "fibre: other"))
    read = read_trial(tmp_path / "bag")
    assert read.facts.fibre == "other"
    (warning,) = read.warnings
    assert "'18Dec2017a'" in warning
    assert "'other'" in warning


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("pca: '6.1'", "pca: high", "custom_data pca is 'high'"),
        ("pca: '6.1'", "pca: nan", "custom_data pca is 'nan'"),
        ("f0_n: '0.0007'", "f0_n: '-1'", "custom_data f0_n is -1.0; allowed are numbers above 0"),
        ('"name": "isometric"', '"nom": "isometric"', "custom_data phases cannot be read"),
        ("storage_identifier: mcap", "storage_identifier: sqlite3", "stored as 'sqlite3'"),
        ("compression_mode: ''", "compression_mode: message", "compression mode 'message'"),
    ],
)
def test_metadata_that_cannot_be_used_is_refused(tmp_path: Path, trial: Trial, old: str, new: str, words: str) -> None:
    write_trial(tmp_path / "bag", trial)
    file = tmp_path / "bag" / "metadata.yaml"
    text = file.read_text()
    assert text.count(old) == 1
    file.write_text(text.replace(old, new))
    with pytest.raises(UserError, match=words):
        read_trial(tmp_path / "bag")
