"""Writing a trial as an MCAP bag in rosbag2's layout."""

from __future__ import annotations

import os
import shutil
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.rosbag2.enums import CompressionMode
from rosbags.rosbag2.storage_mcap import McapWriter

from xb_muscle_ros import fast_yaml
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials import ros_types
from xb_muscle_ros.trials.bag_files import check_replaceable
from xb_muscle_ros.trials.custom_data import facts_to_custom_data
from xb_muscle_ros.trials.simulated import MOMENTS, Simulated
from xb_muscle_ros.trials.stamps import not_after, to_ns
from xb_muscle_ros.trials.trial import Array, Trial

# Whose message definitions and type hashes the bags hold.
ROS_DISTRO = "jazzy"


class _Series(NamedTuple):
    """Messages of one topic: stamps in ns, names, and arrays of shape (messages, names) by their field."""

    topic: str
    stamps_ns: list[int]
    names: list[str]
    fields: dict[str, Array]

    def message(self, i: int) -> bytes:
        """One of them, serialized."""
        values = {field: array[i] for field, array in self.fields.items()}
        return ros_types.joint_state(self.stamps_ns[i], self.names, **values)


def write_trial(
    path: Path, trial: Trial, simulated: Simulated | None = None, more: Mapping[str, str] | None = None
) -> None:
    """Write a trial, and with it what a model answered, as a bag folder.

    The folder appears whole or not at all; an older bag of that name is replaced.

    Args:
        path: the bag folder; it gets ``metadata.yaml`` and ``<name>_0.mcap``.
        trial: at least one length and one calcium sample.
        simulated: force and moments to write beside it.
        more: strings to keep in the bag's ``custom_data`` beside the trial's facts.

    Raises:
        UserError: the path holds something that is not a bag, or the trial cannot be a bag (empty, non-finite,
            times negative or not increasing by at least 1 ns).
    """
    path = Path(path)
    check_replaceable(path)
    series = _series(trial, simulated, str(path))
    custom_data = {**(more or {}), **facts_to_custom_data(trial.facts)}
    temporary = path.parent / f".{path.name}.{os.getpid()}.tmp"
    old = path.parent / f".{path.name}.{os.getpid()}.old"
    shutil.rmtree(temporary, ignore_errors=True)  # of a run that was killed
    try:
        _write(temporary, path.name, series, custom_data)
        if path.exists():
            path.rename(old)
        try:
            temporary.rename(path)
        except BaseException:
            if old.exists():
                old.rename(path)
            raise
    except OSError as problem:
        raise UserError(f"bag {path} cannot be written: {problem.strerror or problem}") from problem
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
        shutil.rmtree(old, ignore_errors=True)


def _write(folder: Path, name: str, series: list[_Series], custom_data: dict[str, str]) -> None:
    with BagWriter(folder, name, custom_data) as writer:
        connections = [
            writer.add_connection(
                each.topic,
                ros_types.JOINT_STATE,
                typestore=ros_types.typestore(),
                offered_qos_profiles=ros_types.qos(each.topic),
            )
            for each in series
        ]
        order = sorted((stamp, s, i) for s, each in enumerate(series) for i, stamp in enumerate(each.stamps_ns))
        for stamp, s, i in order:
            writer.write(connections[s], stamp, series[s].message(i))


def _series(trial: Trial, simulated: Simulated | None, where: str) -> list[_Series]:
    """The trial's topics in the order of `ros_types.TOPICS`."""
    fibre = [trial.facts.fibre]
    if not trial.facts.fibre:
        raise UserError(f"bag {where}: the trial's fibre has no name; give it one")

    def series(topic: str, time_s: Array, names: list[str], **fields: Array) -> _Series:
        columns = {field: values.reshape(len(values), len(names)) for field, values in fields.items()}
        stamps = _stamps(time_s, tuple(column for values in columns.values() for column in values.T), topic, where)
        return _Series(topic, stamps, names, columns)

    found = [
        series(ros_types.CALCIUM, trial.calcium_time_s, fibre, position=trial.calcium_um),
        series(ros_types.LENGTH, trial.time_s, fibre, position=trial.length_m),
    ]
    if trial.force_time_s.size and trial.force_is_measured:
        found.append(series(ros_types.MEASURED_FORCE, trial.force_time_s, fibre, effort=trial.force_n))
    if simulated is not None:
        of_fibre = {"position": simulated.ce_length_m, "velocity": simulated.ce_velocity_m_per_s}
        found.append(series(ros_types.FORCE, simulated.time_s, fibre, effort=simulated.force_n, **of_fibre))
        moments = np.column_stack([simulated.moments[name] for name in MOMENTS])
        names = [f"{fibre[0]}/{name}" for name in MOMENTS]
        found.append(series(ros_types.MOMENTS, simulated.time_s, names, position=moments))
    return found


def _stamps(time_s: Array, columns: tuple[Array, ...], topic: str, where: str) -> list[int]:
    """Stamps of a topic in ns, after looking at everything that would make the bag unreadable."""
    if time_s.ndim != 1 or time_s.size == 0:
        raise UserError(f"bag {where}: no samples for {topic}; at least one is needed")
    for values in (time_s, *columns):
        if values.shape != time_s.shape:
            raise UserError(f"bag {where}: {topic} has {values.size} values at {time_s.size} times; one each is needed")
        bad = np.flatnonzero(~np.isfinite(values))
        if bad.size:
            raise UserError(f"bag {where}: {topic}, sample {bad[0]} is {values[bad[0]]}; allowed are finite numbers")
    if time_s[0] < 0.0 or time_s[-1] * 1e9 > ros_types.LAST_STAMP_NS:
        raise UserError(
            f"bag {where}: {topic} runs from {time_s[0]:.9g} to {time_s[-1]:.9g} s; a message stamp goes from 0 to "
            f"{ros_types.LAST_STAMP_NS // 10**9} s; shift the times"
        )
    stamps = to_ns(time_s)
    for i in not_after(stamps)[:1].tolist():
        raise UserError(
            f"bag {where}: {topic}, sample {i} at {time_s[i]:.9f} s does not come after {time_s[i - 1]:.9f} s; "
            "stamps have to increase by at least 1 ns"
        )
    return [int(stamp) for stamp in stamps]


class _Mcap(McapWriter):
    def __init__(self, path: Path, compression: CompressionMode) -> None:
        super().__init__(path, compression)
        self._facts: dict[str, str] = {}

    def begin(self, name: str, facts: dict[str, str]) -> None:
        self.path = self.path.rename(self.path.parent / f"{name}_0.mcap")
        self._facts = facts

    def close(self, version: int, metadata: str) -> None:
        super().close(version, _with_facts(metadata, self._facts))


class BagWriter(Writer):
    """Writes an MCAP bag of rosbag2's version 9 to a folder that does not exist yet.

    The writer of `rosbags` with three things made to fit: the MCAP file's name, ``custom_data`` and ``ros_distro``.
    rosbag2 numbers the files of a bag. And the YAML writer within `rosbags` wraps long lines in ways that add or lose
    spaces, in the metadata file and in its copy within the MCAP file; here nothing is wrapped.

    Args:
        folder: the folder to make.
        name: the bag's name, which may differ from that of the folder.
        facts: the bag's ``custom_data``.
    """

    STORAGE_PLUGINS = MappingProxyType({StoragePlugin.MCAP: _Mcap})

    def __init__(self, folder: Path, name: str, facts: Mapping[str, str]) -> None:
        super().__init__(folder, version=9, storage_plugin=StoragePlugin.MCAP)
        self._name = name
        self._facts = dict(facts)

    def open(self) -> None:
        """Make the folder and open the file."""
        super().open()
        assert isinstance(self.storage, _Mcap)  # from STORAGE_PLUGINS
        self.storage.begin(self._name, self._facts)

    def close(self) -> None:
        """Write the metadata and close the file."""
        super().close()
        text = self.metapath.read_text(encoding="utf-8")
        self.metapath.write_text(_with_facts(text, self._facts), encoding="utf-8")


def _with_facts(text: str, facts: dict[str, str]) -> str:
    """The metadata with ``custom_data`` and ``ros_distro`` put in, every value on one line."""
    tree: dict[str, Any] = fast_yaml.load(text)
    tree.get("rosbag2_bagfile_information", tree).update(custom_data=facts, ros_distro=ROS_DISTRO)
    return fast_yaml.dump(tree)
