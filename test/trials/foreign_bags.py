"""Bags as others record them, of trials of our own: other order, other files, other facts."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import yaml
from mcap.writer import CompressionType, Writer

from xb_muscle_ros.trials import ros_types
from xb_muscle_ros.trials.completing import Known
from xb_muscle_ros.trials.custom_data import facts_to_custom_data
from xb_muscle_ros.trials.protocol import StretchShortenStretch
from xb_muscle_ros.trials.ros_types import CALCIUM, FORCE, LENGTH, MEASURED_FORCE, joint_state
from xb_muscle_ros.trials.stamps import to_ns
from xb_muscle_ros.trials.study import Study, read_study
from xb_muscle_ros.trials.trial import Array, Trial

EPOCH_NS = 1_700_000_000_000_000_000
# Facts that a bag of others has not.
BARE = ("phases", "amplitude_l0", "recovery_s", "pca", "reference_length_m", "f0_n", "fibre", "trial", "source")


class Logged(NamedTuple):
    """A message as a recorder has it."""

    topic: str
    log_time_ns: int
    data: bytes


def messages(
    trial: Trial,
    others: Mapping[str, float] | None = None,
    apart: bool = False,
    force_topic: str = MEASURED_FORCE,
    begin_ns: int = 0,
) -> list[Logged]:
    """A trial's messages in the order of time.

    Args:
        trial: with or without force.
        others: further fibres, with a factor on lengths and forces; named before the trial's own.
        apart: every fibre in messages of its own, in place of arrays.
        force_topic: of the force.
        begin_ns: added to the stamps.
    """
    names = {**(others or {}), trial.facts.fibre: 1.0}
    sent: list[Logged] = []

    def add(topic: str, time_s: Array, values: Array, factors: bool) -> None:
        effort = topic in (MEASURED_FORCE, FORCE)
        for stamp, value in zip(to_ns(time_s).tolist(), values.tolist(), strict=True):
            groups = [[name] for name in names] if apart else [list(names)]
            for group in groups:
                row = np.array([value * (names[name] if factors else 1.0) for name in group])
                data = joint_state(stamp + begin_ns, group, **{"effort" if effort else "position": row})
                sent.append(Logged(topic, stamp + begin_ns, data))

    add(CALCIUM, trial.calcium_time_s, trial.calcium_um, False)
    add(LENGTH, trial.time_s, trial.length_m, True)
    if trial.force_time_s.size:
        add(force_topic, trial.force_time_s, trial.force_n, True)
    return sorted(sent, key=lambda one: one.log_time_ns)


def write_mcap(file: Path, logged: Sequence[Logged], custom_data: Mapping[str, str] | None = None) -> None:
    """One MCAP file with messages in the order given; facts go into the recorder's copy of the metadata."""
    file.parent.mkdir(parents=True, exist_ok=True)
    with file.open("wb") as stream:
        writer = Writer(stream, compression=CompressionType.NONE, chunk_size=1 << 14)
        writer.start(profile="ros2", library="test")
        text, _ = ros_types.typestore().generate_msgdef(ros_types.JOINT_STATE, ros_version=2)
        schema = writer.register_schema(ros_types.JOINT_STATE, "ros2msg", text.encode())
        channels = {
            topic: writer.register_channel(topic, "cdr", schema) for topic in dict.fromkeys(one.topic for one in logged)
        }
        for one in logged:
            writer.add_message(channels[one.topic], one.log_time_ns, one.data, one.log_time_ns)
        if custom_data is not None:
            writer.add_metadata("rosbag2", {"serialized_metadata": _metadata([file.name], custom_data)})
        writer.finish()


def write_folder(
    folder: Path,
    parts: Sequence[Sequence[Logged]],
    custom_data: Mapping[str, str] | None,
    listed: Sequence[int] | None = None,
) -> Path:
    """A bag folder of numbered files.

    Args:
        folder: the bag; its name begins the names of the files.
        parts: messages of each file.
        custom_data: facts in ``metadata.yaml``; None for null.
        listed: order of the files in ``metadata.yaml``; empty for no such file.
    """
    names = [f"{folder.name}_{i}.mcap" for i in range(len(parts))]
    for name, part in zip(names, parts, strict=True):
        write_mcap(folder / name, part)
    order = range(len(parts)) if listed is None else listed
    if order:
        (folder / "metadata.yaml").write_text(_metadata([names[i] for i in order], custom_data))
    return folder


def facts_of(trial: Trial, without: Sequence[str] = ()) -> dict[str, str]:
    """A trial's facts as strings, some left out."""
    return {key: value for key, value in facts_to_custom_data(trial.facts).items() if key not in without}


def _metadata(files: Sequence[str], custom_data: Mapping[str, str] | None) -> str:
    information = {
        "version": 9,
        "storage_identifier": "mcap",
        "compression_mode": "",
        "relative_file_paths": list(files),
        "custom_data": None if custom_data is None else dict(custom_data),
    }
    return yaml.safe_dump({"rosbag2_bagfile_information": json.loads(json.dumps(information))})


def recording(amplitude_l0: float = 0.0383, recovery_s: float = 0.1, rate_hz: float = 500.0) -> Trial:
    """A trial of the paper's protocol whose force follows length."""
    trial = StretchShortenStretch(amplitude_l0, recovery_s, lead_s=0.15).trial("ankle", 6.1, rate_hz)
    return dataclasses.replace(trial, force_time_s=trial.time_s, force_n=0.5 + 5.0 * trial.length_change_l0)


def study(bag: Path, known: Known | None = None, **options: str) -> Study:
    """Read a bag as a command does; of fibre ``ankle`` where no other is asked for."""
    return read_study([bag], options.pop("fibre", "ankle"), known or Known(), **options)


def same_samples(found: Trial, made: Trial) -> bool:
    """Whether two trials hold equal samples."""
    names = ("time_s", "length_m", "calcium_um", "force_time_s", "force_n")
    return all(np.array_equal(getattr(found, name), getattr(made, name)) for name in names)
