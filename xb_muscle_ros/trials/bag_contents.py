"""A bag opened: the messages of its files, its ``custom_data``, and what was wrong with it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials import fast_yaml
from xb_muscle_ros.trials.bag_files import METADATA, mcap_files
from xb_muscle_ros.trials.mcap_records import Message, read_recording


@dataclass(frozen=True)
class BagContents:
    """What a bag holds.

    Attributes:
        path: the bag, as given.
        types: message type of each topic.
        encodings: message encoding of each topic.
        messages: messages of each topic that has any, in the order of the files.
        custom_data: the bag's strings; None where they are lost.
        flaws: what is wrong with the bag and was lived with.
    """

    path: Path
    types: dict[str, str]
    encodings: dict[str, str]
    messages: dict[str, list[Message]]
    custom_data: dict[str, str] | None
    flaws: tuple[str, ...]


def open_bag(path: Path) -> BagContents:
    """Read a bag folder or a single ``.mcap`` file; damaged ones as far as they go.

    Raises:
        UserError: it does not exist, is no MCAP bag, or holds no message.
    """
    if not path.exists():
        raise UserError(f"bag {path} does not exist; give a bag folder or an .mcap file")
    information, flaws = _information(path)
    files = _files(path, information)
    types: dict[str, str] = {}
    encodings: dict[str, str] = {}
    messages: dict[str, list[Message]] = {}
    for file in files:
        try:
            recording = read_recording(file)
        except ValueError as problem:
            raise UserError(f"bag {path}: {file.name} is no MCAP file: {problem}; record the bag again") from None
        except OSError as problem:
            raise UserError(f"bag {path}: {file.name} cannot be read: {problem.strerror}") from problem
        types.update(recording.types)
        encodings.update(recording.encodings)
        for message in recording.messages:
            messages.setdefault(message.topic, []).append(message)
        if recording.damage:
            flaws.append(f"{file.name} is {recording.damage}")
        if information is None:
            information = _parsed(recording.metadata.get("rosbag2", {}).get("serialized_metadata", ""))
    if not messages:
        why = "; ".join(flaws) or "it holds no message"
        raise UserError(f"bag {path} is empty: {why}; record it again")
    return BagContents(path, types, encodings, messages, _custom_data(information), tuple(flaws))


def _information(path: Path) -> tuple[dict[str, Any] | None, list[str]]:
    """Metadata from ``metadata.yaml``, or None, and what is wrong with that."""
    file = (path if path.is_dir() else path.parent) / METADATA
    if not file.is_file():
        return None, [f"{METADATA} is missing"] if path.is_dir() else []
    try:
        information = _parsed(file.read_bytes().decode())
    except (OSError, UnicodeDecodeError):
        information = None
    if path.is_file():  # a bag's neighbour tells nothing about this file
        listed = information is not None and path.name in _listed(information)
        return (information if listed else None), []
    return information, [] if information is not None else [f"{METADATA} cannot be read"]


def _parsed(text: str) -> dict[str, Any] | None:
    """The bag information of a metadata text, every scalar as the text it is; None if it has none."""
    try:
        loaded = fast_yaml.load_text(text)  # scalars stay text, so a trial named 1_0 keeps its name
    except (yaml.YAMLError, ValueError):
        return None
    if isinstance(loaded, dict):
        loaded = loaded.get("rosbag2_bagfile_information", loaded)
    return loaded if isinstance(loaded, dict) and "storage_identifier" in loaded else None


def _listed(information: dict[str, Any]) -> list[str]:
    paths = information.get("relative_file_paths")
    return [Path(str(p)).name for p in paths] if isinstance(paths, list) else []


def _files(path: Path, information: dict[str, Any] | None) -> list[Path]:
    if path.is_file():
        return [path]
    if information is not None:
        storage = information["storage_identifier"]
        if storage != "mcap":
            raise UserError(f"bag {path} is stored as '{storage}'; allowed is mcap; convert it with ros2 bag convert")
        if information.get("compression_mode", "").upper() not in ("", "NONE", "STORAGE"):
            raise UserError(
                f"bag {path} has compression mode '{information['compression_mode']}'; allowed is the compression "
                "within MCAP; convert it with ros2 bag convert"
            )
        listed = [path / name for name in _listed(information)]
        there = [file for file in listed if file.is_file()]
        if there and len(there) == len(listed):
            return there
    files = mcap_files(path)
    if not files:
        raise UserError(f"bag {path} is empty: it has no .mcap file; give a recorded bag")
    return files


def _custom_data(information: dict[str, Any] | None) -> dict[str, str] | None:
    if information is None:
        return None
    data = information.get("custom_data")
    return {str(k): str(v) for k, v in data.items()} if isinstance(data, dict) else {}
