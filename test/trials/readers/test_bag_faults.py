"""Bags of others with faults: clocks, gaps, other senders, cut and split files, settings that do not fit."""

from __future__ import annotations

import shutil
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from xb_muscle_ros.trials import ros_types
from xb_muscle_ros.trials.importing import Failed, Imported, find_recordings, import_recordings
from xb_muscle_ros.trials.readers.settings import ImportSettings
from xb_muscle_ros.trials.trial import Trial

BEGIN_S = 1_700_000_000
COUNT = 400
STORE = get_typestore(Stores.ROS2_JAZZY)
STORE.register(get_types_from_msg("std_msgs/Header header\nfloat64 newton", "lab_msgs/msg/Load"))


def joints(stamp_s: float, **angles: float) -> Any:
    """A JointState without effort."""
    message = STORE.types["sensor_msgs/msg/JointState"]
    empty = np.empty(0)
    return message(
        header=header(stamp_s),
        name=list(angles),
        position=np.array(list(angles.values())),
        velocity=empty,
        effort=empty,
    )


def load(stamp_s: float, newton: float) -> Any:
    return STORE.types["lab_msgs/msg/Load"](header=header(stamp_s), newton=newton)


def header(stamp_s: float) -> Any:
    stamp_ns = BEGIN_S * 10**9 + round(stamp_s * 1e9) if stamp_s >= 0 else 0
    stamp = STORE.types["builtin_interfaces/msg/Time"](sec=stamp_ns // 10**9, nanosec=stamp_ns % 10**9)
    return STORE.types["std_msgs/msg/Header"](stamp=stamp, frame_id="")


def write(
    path: Path, rows: Iterable[tuple[str, float, Any]], storage: StoragePlugin = StoragePlugin.MCAP, split: int = 0
) -> Path:
    """A bag of (topic, log time in s, message); with ``split``, a folder of files without metadata."""
    parts = [list(rows)] if not split else [list(rows)[:split], list(rows)[split:]]
    for i, part in enumerate(parts):
        folder = path if not split else path.parent / f"part{i}"
        with Writer(folder, version=9, storage_plugin=storage) as writer:
            connections: dict[str, Any] = {}
            for topic, log_s, message in part:
                kind = message.__msgtype__
                if topic not in connections:
                    connections[topic] = writer.add_connection(topic, kind, typestore=STORE)
                log_ns = BEGIN_S * 10**9 + round(log_s * 1e9)
                writer.write(connections[topic], log_ns, STORE.serialize_cdr(message, kind))
        if split:
            path.mkdir(exist_ok=True)
            file = next(each for each in folder.iterdir() if each.suffix in (".mcap", ".db3"))
            file.rename(path / f"rig_{i}{file.suffix}")
            shutil.rmtree(folder)
    return path


def rig(count: int = COUNT) -> list[tuple[str, float, Any]]:
    """Length and force at 1 kHz; a length of 30 mm that is stretched by 1 mm from 0.2 to 0.25 s."""
    rows: list[tuple[str, float, Any]] = []
    for i in range(count):
        t = i / 1000
        rows.append(("/joints", t, joints(t, ankle=float(np.interp(t, [0.2, 0.25], [0.030, 0.031])))))
        rows.append(("/load", t, load(t, 0.3)))
    return rows


def tree(**columns: Any) -> dict[str, Any]:
    length = {"topic": "/joints", "field": "position[ankle]", "unit": "m"}
    force = {"topic": "/load", "field": "newton", "unit": "N"}
    return {"fibre": "gm", "f0": "1 N", "pca": 6.1, "columns": {"length": length, "force": force, **columns}}


def run(path: Path, tmp_path: Path, keys: dict[str, Any] | None = None) -> list[Imported | Failed]:
    made = import_recordings(find_recordings([path]), ImportSettings(keys or tree(), "here"), tmp_path / "bags")
    return [event for event in made if isinstance(event, (Imported, Failed))]


def trial(path: Path, tmp_path: Path, keys: dict[str, Any] | None = None) -> Trial:
    (event,) = run(path, tmp_path, keys)
    assert isinstance(event, Imported), event.why
    return event.trial


def refusal(path: Path, tmp_path: Path, keys: dict[str, Any] | None = None) -> str:
    (event,) = run(path, tmp_path, keys)
    assert isinstance(event, Failed)
    assert "\n" not in event.why
    return event.why


@pytest.mark.parametrize("storage", list(StoragePlugin))
@pytest.mark.parametrize("topic", ["/joints", "/load"])
def test_stamps_that_step_back_are_refused_before_anything_is_looked_up(
    tmp_path: Path, storage: StoragePlugin, topic: str
) -> None:
    rows = [
        (
            name,
            t,
            message if name != topic or t < 0.2 else type(message)(**{**vars(message), "header": header(t - 0.15)}),
        )
        for name, t, message in rig()
        if t > 0.0
    ]
    why = refusal(write(tmp_path / "rig", rows, storage), tmp_path)
    assert f"{topic}, message 199: its header stamp, {BEGIN_S}.050000000 s" in why
    assert f"does not come after {BEGIN_S}.199000000 s of message 198" in why


def test_stamps_that_are_not_set_are_told(tmp_path: Path) -> None:
    rows = [("/joints", i / 1000, joints(-1.0, ankle=0.03)) for i in range(50)]
    keys = tree()
    del keys["columns"]["force"], keys["f0"]
    assert "leaves the stamps unset; use 'columns: {time: {stamp: log}}'" in refusal(
        write(tmp_path / "rig", rows), tmp_path, keys
    )


def test_lost_samples_are_named_with_their_time(tmp_path: Path) -> None:
    path = write(tmp_path / "rig", [row for row in rig() if not 0.0995 < row[1] < 0.3495])
    why = refusal(path, tmp_path)
    assert "message 100, header stamp of /joints: samples are missing from 0.099 to 0.35 s (0.251 s)" in why
    allowed = tree(time={"stamp": "header", "largest_step": "0.3 s"})
    assert "and changes by 0.0333 L0 within; record it again or cut the trial there" in refusal(path, tmp_path, allowed)
    still = write(tmp_path / "still", [row for row in rig(800) if not 0.2995 < row[1] < 0.5495])
    assert trial(still, tmp_path, allowed).time_s.size == 550


def test_lost_forces_are_named_too(tmp_path: Path) -> None:
    path = write(tmp_path / "rig", [row for row in rig() if row[0] == "/joints" or not 0.0995 < row[1] < 0.1495])
    (warning,) = trial(path, tmp_path).warnings
    assert "/load newton: samples are missing from 0.099 to 0.15 s" in warning


@pytest.mark.parametrize("storage", list(StoragePlugin))
def test_messages_of_other_joints_are_skipped_and_counted(tmp_path: Path, storage: StoragePlugin) -> None:
    wheel = [("/joints", i / 1000 + 2e-4, joints(i / 1000 + 2e-4, wheel=9.0)) for i in range(COUNT)]
    path = write(tmp_path / "rig", sorted([*rig(), *wheel], key=lambda row: row[1]), storage)
    found = trial(path, tmp_path)
    assert found.time_s.size == COUNT
    assert found.length_m.max() == pytest.approx(0.031)
    (warning,) = found.warnings
    assert "400 of 800 messages on /joints have no joint 'ankle' and are skipped; they name wheel" in warning


def test_an_index_that_picks_one_joint_now_and_another_then_is_refused(tmp_path: Path) -> None:
    wheel = [("/joints", i / 1000 + 2e-4, joints(i / 1000 + 2e-4, wheel=0.03)) for i in range(COUNT)]
    path = write(tmp_path / "rig", sorted([*rig(), *wheel], key=lambda row: row[1]))
    keys = tree(length={"topic": "/joints", "field": "position[0]", "unit": "m"})
    why = refusal(path, tmp_path, keys)
    assert "message 1, position[0] is of joint 'wheel', earlier ones of 'ankle'; name the joint" in why


def test_an_empty_array_is_called_so(tmp_path: Path) -> None:
    keys = tree(force={"topic": "/joints", "field": "effort[ankle]", "unit": "N"})
    assert "message 0, effort[ankle]: effort is empty" in refusal(write(tmp_path / "rig", rig()), tmp_path, keys)


def test_whole_messages_of_a_cut_file_are_imported(tmp_path: Path) -> None:
    path = write(tmp_path / "rig", rig())
    file = next(path.glob("*.mcap"))
    file.write_bytes(file.read_bytes()[: int(0.6 * file.stat().st_size)])
    found = trial(path, tmp_path)
    assert 50 < found.time_s.size < COUNT
    assert found.length_m[:200] == pytest.approx(0.03)
    assert any(f"{file.name} is cut short" in warning for warning in found.warnings)


def test_quality_of_service_in_the_metadata_is_of_no_account(tmp_path: Path) -> None:
    path = write(tmp_path / "rig", rig())
    file = path / "metadata.yaml"
    text = file.read_text()
    changed = text.replace("offered_qos_profiles: []", "offered_qos_profiles: [{history: keep_last, depth: 1}]")
    file.write_text(changed)
    assert changed != text
    assert trial(path, tmp_path).time_s.size == COUNT


@pytest.mark.parametrize("storage", list(StoragePlugin))
def test_a_split_bag_without_metadata_is_one_trial(tmp_path: Path, storage: StoragePlugin) -> None:
    path = write(tmp_path / "split", rig(), storage, split=COUNT)
    found = trial(path, tmp_path)
    assert (found.facts.trial, found.time_s.size) == ("split", COUNT)
    assert any("metadata.yaml is missing" in warning for warning in found.warnings)
    one = trial(next(path.glob("rig_1.*")), tmp_path)
    assert one.time_s.size == COUNT // 2
    assert any(f"looks like one part of several; give the folder {path}" in warning for warning in one.warnings)


def test_a_table_beside_the_files_of_a_bag_is_not_overlooked(tmp_path: Path) -> None:
    path = write(tmp_path / "split", rig(), split=COUNT)
    (path / "more.csv").write_text("t,l\n0,1\n")
    assert find_recordings([path]) == [path, path / "more.csv"]
    assert find_recordings([tmp_path]) == [path, path / "more.csv"]


def test_sqlite_files_that_are_no_parts_say_what_to_do(tmp_path: Path) -> None:
    path = write(tmp_path / "split", rig(), StoragePlugin.SQLITE3, split=COUNT)
    (path / "rig_0.db3").rename(path / "rig_7.db3")
    settings = ImportSettings({**tree(), "format": "bag"}, "here")
    (event, _) = import_recordings([path], settings, tmp_path / "bags")
    assert isinstance(event, Failed)
    assert "make it anew with ros2 bag reindex" in event.why


@pytest.mark.parametrize("size", [0, 100])
def test_a_file_cut_before_its_first_message_is_empty(tmp_path: Path, size: int) -> None:
    path = write(tmp_path / "rig", rig())
    file = next(path.glob("*.mcap"))
    file.write_bytes(file.read_bytes()[:size])
    assert f"is empty: {file.name} is cut short after {size} bytes" in refusal(path, tmp_path)


def test_forces_of_another_clock_are_refused(tmp_path: Path) -> None:
    rows = [(topic, t, message if topic == "/joints" else load(86400 + t, 0.3)) for topic, t, message in rig()]
    why = refusal(write(tmp_path / "rig", rows), tmp_path)
    assert "force begins at 86400 s, after the lengths have ended at 0.399 s" in why


def test_a_message_that_cannot_be_decoded_is_named(raw_bag: Any, tmp_path: Path) -> None:
    path = raw_bag([(ros_types.LENGTH, 10**9, b"\x00\x01\x00\x00")])
    why = refusal(path, tmp_path, {"fibre": "f", "pca": 6.0})
    assert "/muscle/length, message 0 cannot be decoded" in why
