"""Bags of others: topics and fields, MCAP and SQLite."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials import ros_types
from xb_muscle_ros.trials.bags import read_trial, write_trial
from xb_muscle_ros.trials.readers.assembly import trial_of
from xb_muscle_ros.trials.readers.settings import ImportSettings
from xb_muscle_ros.trials.trial import Trial, TrialFacts

BEGIN_NS = 1_716_800_000_123_456_789
TIME_S = np.arange(300) / 1000
STRAIN = np.interp(TIME_S, [0.0, 0.1, 0.18, 0.3], [0.0, 0.0, 0.04, 0.04])
FORCE_S = np.arange(-20, 1100) / 4000  # another clock: 4 kHz, 5 ms earlier
STORE = get_typestore(Stores.ROS2_JAZZY)
STORE.register(get_types_from_msg("float64 level\nfloat64[] more", "lab_msgs/msg/Stimulus"))


def _stamp(time_s: float) -> Any:
    stamp_ns = BEGIN_NS + round(time_s * 1e9)
    return STORE.types["builtin_interfaces/msg/Time"](sec=stamp_ns // 10**9, nanosec=stamp_ns % 10**9)


def _header(time_s: float) -> Any:
    return STORE.types["std_msgs/msg/Header"](stamp=_stamp(time_s), frame_id="")


def _messages() -> list[tuple[str, str, float, Any]]:
    """Topic, type, time in s and message of a recording of a rig: legs with two joints, a load cell, a stimulator."""
    joint, wrench, vector, force, stimulus = (
        STORE.types[name]
        for name in (
            "sensor_msgs/msg/JointState",
            "geometry_msgs/msg/WrenchStamped",
            "geometry_msgs/msg/Vector3",
            "geometry_msgs/msg/Wrench",
            "lab_msgs/msg/Stimulus",
        )
    )
    none = np.empty(0)
    zero = vector(x=0.0, y=0.0, z=0.0)
    made: list[tuple[str, str, float, Any]] = []
    for t, s in zip(TIME_S.tolist(), STRAIN.tolist(), strict=True):
        position = np.array([7.0, 20.0 * (1 + s)])
        state = joint(header=_header(t), name=["hip", "ankle"], position=position, velocity=none, effort=none)
        made.append(("/leg/joints", "sensor_msgs/msg/JointState", t, state))
    for t in FORCE_S.tolist():
        f = float(np.interp(t, TIME_S, 3.0 * (0.4 + 5 * STRAIN)))
        load = wrench(header=_header(t), wrench=force(force=vector(x=0.0, y=0.0, z=f), torque=zero))
        made.append(("/load_cell", "geometry_msgs/msg/WrenchStamped", t, load))
    for t in (-0.5, 0.05, 0.055, 0.15):
        level = float(t in (0.05,))
        made.append(("/stimulus", "lab_msgs/msg/Stimulus", t, stimulus(level=level, more=np.array([0.0, 2 * level]))))
    return made


@pytest.fixture(scope="module", params=[StoragePlugin.MCAP, StoragePlugin.SQLITE3], ids=["mcap", "sqlite"])
def rig(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("bags") / "rig_1"
    with Writer(path, version=9, storage_plugin=request.param) as writer:
        connections = {}
        for topic, kind, time_s, message in sorted(_messages(), key=lambda m: m[2]):
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=STORE)
            # It arrives 10 ms after it was measured.
            stamp_ns = BEGIN_NS + round((time_s + 0.01) * 1e9)
            writer.write(connections[topic], stamp_ns, STORE.serialize_cdr(message, kind))
    return path


def tree(**more: Any) -> dict[str, Any]:
    columns = {
        "length": {"topic": "/leg/joints", "field": "position[ankle]", "unit": "mm"},
        "force": {"topic": "/load_cell", "field": "wrench.force.z", "unit": "N"},
        **more.pop("columns", {}),
    }
    return {"fibre": "gm", "f0": "3 N", "pca": 6.1, "columns": columns, **more}


def read(path: Path, keys: dict[str, Any]) -> Trial:
    prepared = ImportSettings(keys, "here").prepare(path)
    (pending,) = prepared.reader.trials(path, prepared.mapping)
    return trial_of(pending.read(), prepared.mapping, path)


def test_topics_and_fields_become_a_trial(rig: Path) -> None:
    trial = read(rig, tree())
    facts = trial.facts
    assert (facts.fibre, facts.trial, facts.pca, facts.f0_n) == ("gm", "rig_1", 6.1, 3.0)
    assert facts.reference_length_m == pytest.approx(0.02)
    assert trial.time_s == pytest.approx(TIME_S)
    assert trial.length_change_l0 == pytest.approx(STRAIN, abs=1e-9)
    assert trial.force_time_s == pytest.approx(FORCE_S[20:])
    assert trial.measured_f0 == pytest.approx(np.interp(FORCE_S[20:], TIME_S, 0.4 + 5 * STRAIN))
    assert [phase.name for phase in facts.phases] == ["isometric", "test_stretch", "hold"]
    assert f"time 0 is stamp {BEGIN_NS} ns (2024-05-27T08:53:20.123+00:00)" in facts.source
    early, ends = trial.warnings
    assert "20 messages on /load_cell come before the first length; they are left out" in early
    assert "/load_cell wrench.force.z: force is there from 0 to 0.27475 s, length from 0 to 0.299 s" in ends


def test_a_file_of_the_bag_alone_will_do(rig: Path, tmp_path: Path) -> None:
    (file,) = (each for each in rig.iterdir() if each.suffix in (".mcap", ".db3"))
    shutil.copy(file, tmp_path / f"alone{file.suffix}")
    if file.suffix == ".db3":  # older recorders keep no definition of the types within it
        keys = tree(columns={"force": {"topic": "/load_cell", "field": "wrench.force.z", "unit": "N"}})
    else:
        keys = tree()
    trial = read(tmp_path / f"alone{file.suffix}", keys)
    assert trial.facts.trial == "alone"
    assert trial.time_s == pytest.approx(TIME_S)


def test_times_may_be_those_of_the_recorder(rig: Path) -> None:
    trial = read(rig, tree(columns={"time": {"stamp": "log"}}))
    assert trial.time_s == pytest.approx(TIME_S, abs=1e-9)
    assert f"time 0 is stamp {BEGIN_NS + 10_000_000} ns" in trial.facts.source


def test_a_topic_tells_when_there_is_stimulation(rig: Path) -> None:
    keys = tree(
        columns={"stimulation": {"topic": "/stimulus", "field": "more[1]", "unit": "V"}, "time": {"stamp": "log"}},
        activation={"rest": "0.05 uM", "tetanus": "8 uM", "rise": "10 ms", "decay": "10 ms"},
    )
    del keys["pca"]
    trial = read(rig, keys)
    assert "stimulated 0.05 to 0.055 s" in trial.facts.source
    assert trial.calcium_um[0] == 0.05
    assert np.max(trial.calcium_um) == pytest.approx(8 - 7.95 * np.exp(-0.5), rel=1e-2)


def test_our_own_topics_are_the_default(tmp_path: Path) -> None:
    trial = Trial(
        facts=TrialFacts("f1", "t1"),
        time_s=TIME_S,
        length_m=0.02 * (1 + STRAIN),
        calcium_time_s=[0.0, 0.1],
        calcium_um=[0.1, 0.2],
    )
    write_trial(tmp_path / "recorded", trial)
    calcium = {"topic": ros_types.CALCIUM, "field": "position[0]", "unit": "uM"}
    keys = {"fibre": "f1", "reference_length": "20 mm", "columns": {"calcium": calcium}}
    read_back = read(tmp_path / "recorded", keys)
    assert read_back.length_change_l0 == pytest.approx(STRAIN, abs=1e-9)
    assert read_back.calcium_um.tolist() == [0.1, 0.2]
    assert read_back.calcium_time_s == pytest.approx([0.0, 0.1])
    write_trial(tmp_path / "again", read_back)
    assert read_trial(tmp_path / "again").facts == read_back.facts


@pytest.mark.slow
@pytest.mark.parametrize(
    ("length", "words"),
    [
        ({"topic": "/nowhere"}, "has no topic /nowhere; its topics: /leg/joints, /load_cell, /stimulus"),
        (
            {"field": "position[knee]"},
            "position[knee]: there is no joint 'knee' in any of 300 messages; joints there: hip, ankle",
        ),
        ({"field": "position[2]"}, "message 0, position[2]: there is no value 2"),
        ({"field": "angle[0]"}, "there is no angle; fields: header, name, position, velocity, effort"),
        ({"field": "position"}, "message 0, position is a ndarray; needed is a number"),
        ({"field": "position[0"}, "field 'position[0' is no path such as position[0]"),
        ({"topic": "/stimulus", "field": "level", "unit": "mm"}, "message 0 has no header; use 'columns: {time"),
        ({"unit": "m"}, "L0 is 20 m; fibres have 1e-05 to 0.7 m; is m its unit?"),
    ],
)
def test_mistakes_are_told_in_one_line(rig: Path, length: dict[str, str], words: str) -> None:
    keys = tree()
    keys["columns"]["length"].update(length)
    with pytest.raises(UserError) as refused:
        read(rig, keys)
    assert words in str(refused.value)
    assert "rig_1" in str(refused.value)


def test_a_bag_that_cannot_be_read_is_refused(rig: Path, tmp_path: Path) -> None:
    for name, words in (("no.mcap", "is no MCAP file: .*; record the bag again"), ("no.db3", "cannot be read: .*;")):
        (tmp_path / name).write_bytes(b"no bag at all")
        with pytest.raises(UserError, match=f"bag .*{name}.* {words}"):
            read(tmp_path / name, tree())
    folder = tmp_path / "bag"
    shutil.copytree(rig, folder)
    next(each for each in folder.iterdir() if each.suffix in (".mcap", ".db3")).unlink()
    with pytest.raises(UserError, match=r"bag .*(cannot be read: |has no \.mcap file)"):
        read(folder, tree())


def test_values_that_are_not_finite_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "nan"
    joint = STORE.types["sensor_msgs/msg/JointState"]
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connection = writer.add_connection("/leg/joints", "sensor_msgs/msg/JointState", typestore=STORE)
        for i in range(10):
            value = np.array([0.0, np.nan if 3 <= i < 6 else 20.0])
            state = joint(
                header=_header(i / 1000), name=["a", "ankle"], position=value, velocity=value[:0], effort=value[:0]
            )
            data = STORE.serialize_cdr(state, "sensor_msgs/msg/JointState")
            writer.write(connection, BEGIN_NS + i * 10**6, data)
    keys = tree()
    del keys["columns"]["force"], keys["f0"]
    with pytest.raises(UserError, match=r"message 3, /leg/joints position\[ankle\] is nan \(a run of 3\)"):
        read(path, keys)
