"""A bag opened: the messages of its files, decoded on demand, its ``custom_data``, and what was wrong with it."""

from __future__ import annotations

import struct
from collections.abc import Container, Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import yaml
from rosbags.interfaces.typing import Typesdict
from rosbags.serde import SerdeError
from rosbags.typesys import Stores, TypesysError, get_types_from_idl, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from xb_muscle_ros import fast_yaml
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials import ros_types
from xb_muscle_ros.trials.bag_files import METADATA, mcap_files
from xb_muscle_ros.trials.joint_layout import Layout
from xb_muscle_ros.trials.mcap_records import Recording, read_recording
from xb_muscle_ros.trials.messages import Message, Messages

_IDL_BEGIN = "=" * 80 + "\n"


@dataclass(frozen=True)
class BagContents:
    """What a bag holds.

    Attributes:
        types: message type of each topic, of those without messages too.
        encodings: message encoding of each topic.
        definitions: format and text of each message type that the bag describes.
        messages: messages of each topic that has any, over all files.
        custom_data: the bag's strings; None where they are lost.
        flaws: what is wrong with the bag and was lived with.
    """

    path: Path
    types: dict[str, str]
    encodings: dict[str, str]
    definitions: dict[str, tuple[str, str]]
    messages: dict[str, Messages]
    custom_data: dict[str, str] | None
    flaws: tuple[str, ...]

    @property
    def flaws_text(self) -> str:
        """The flaws in brackets after a blank; empty without any."""
        return f" ({'; '.join(self.flaws)})" if self.flaws else ""


def open_bag(path: Path, topics: Container[str] | None = None) -> BagContents:
    """Read a bag folder or a single ``.mcap`` file; damaged ones as far as they go.

    Recorders write messages as they come; a file may be sorted otherwise, and a list of files too. The log time tells
    the order. Quality of service plays no part.

    Args:
        topics: messages of these alone are kept; None for all.

    Raises:
        UserError: it does not exist, is no MCAP bag, or holds no message.
    """
    if not path.exists():
        raise UserError(f"bag {path} does not exist; give a bag folder or an .mcap file")
    information, flaws = _information(path)
    files, missing = _files(path, information)
    flaws += missing
    bag = BagContents(path, {}, {}, {}, {}, None, ())
    copies: list[tuple[str, dict[str, Any]]] = []
    for file in files:
        recording = _recording(path, file, topics)
        bag.types.update(recording.types)
        bag.encodings.update(recording.encodings)
        bag.definitions.update(recording.definitions)
        for topic, messages in recording.messages.items():
            bag.messages.setdefault(topic, Messages(topic)).extend(messages)
        if recording.damage:
            flaws.append(f"{file.name} is {recording.damage}")
        copy = _parsed(recording.metadata.get("rosbag2", {}).get("serialized_metadata", ""))
        if copy is not None:
            copies.append((file.name, copy))
    if not bag.messages and topics is None:
        why = "; ".join(flaws) or "it holds no message"
        raise UserError(f"bag {path} is empty: {why}; record it again")
    custom_data, note = _custom_data(information, copies)
    return replace(bag, custom_data=custom_data, flaws=(*flaws, *note))


def _recording(bag: Path, file: Path, topics: Container[str] | None) -> Recording:
    try:
        return read_recording(file, topics)
    except ValueError as problem:
        raise UserError(f"bag {bag}: {file.name} is no MCAP file: {problem}; record the bag again") from None
    except OSError as problem:
        raise UserError(f"bag {bag}: {file.name} cannot be read: {problem.strerror}") from problem


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


def _files(path: Path, information: dict[str, Any] | None) -> tuple[list[Path], list[str]]:
    """The bag's files, and what is wrong with the list of them."""
    flaws: list[str] = []
    if path.is_file():
        return [path], flaws
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
            others = [file.name for file in mcap_files(path) if file not in there]
            if others:
                flaws.append(f"{METADATA} does not list {', '.join(others)}, which is left out")
            return there, flaws
        flaws += [f"{file.name}, which {METADATA} lists, is missing" for file in listed if file not in there]
    files = mcap_files(path)
    if not files:
        raise UserError(f"bag {path} is empty: it has no .mcap file; give a recorded bag")
    return files, flaws


def _custom_data(
    information: dict[str, Any] | None, copies: list[tuple[str, dict[str, Any]]]
) -> tuple[dict[str, str] | None, list[str]]:
    """Facts from ``metadata.yaml``, or where it has none (tools that make it anew lose them) from a copy in a file."""
    facts = _strings(information)
    if facts:
        return facts, []
    for name, copy in copies:
        kept = _strings(copy)
        if kept:
            return kept, [f"{METADATA} has lost its custom_data; the copy within {name} is used"] if information else []
    return (None if information is None and not copies else {}), []


def _strings(information: dict[str, Any] | None) -> dict[str, str]:
    data = None if information is None else information.get("custom_data")
    return {str(key): str(value) for key, value in data.items()} if isinstance(data, dict) else {}


class AnyMessage(NamedTuple):
    """A message of any type: its topic, when it was logged (ns), and what it holds."""

    topic: str
    log_time_ns: int
    message: Any


def decoded(bag: BagContents, topic: str, messages: Iterable[Message], store: Typestore) -> Iterator[AnyMessage]:
    """Messages of a topic, by the types of a store.

    Raises:
        UserError: the store does not have the type, or a message is not of it.
    """
    kind = bag.types[topic]
    if bag.encodings[topic] != "cdr" or kind not in store.fielddefs:
        raise UserError(
            f"bag {bag.path}: {topic} is {kind or 'of no known type'} ({bag.encodings[topic]}), which the bag does "
            "not describe; record or convert it again"
        )
    for i, each in enumerate(messages):
        try:
            yield AnyMessage(topic, each.log_time_ns, _deserialized(each.data, kind, store))
        except (SerdeError, struct.error, ValueError, IndexError) as problem:
            raise UserError(f"bag {bag.path}: {topic}, message {i} cannot be decoded: {problem}") from problem


def _deserialized(data: bytes, kind: str, store: Typestore) -> Any:
    try:
        return store.deserialize_cdr(data, kind)
    except SerdeError:
        layout = Layout.of(data) if kind == ros_types.JOINT_STATE else None
        if layout is None or layout.end == len(data):
            raise
        return store.deserialize_cdr(layout.trimmed(data), kind)


def all_decoded(bag: BagContents) -> Iterator[AnyMessage]:
    """All messages of a bag, topic by topic in the order of log time.

    Types are those that the bag describes, and the standard ones of ROS 2 Jazzy.

    Raises:
        UserError: see `decoded`.
    """
    store = _typestore(bag)
    for topic, messages in bag.messages.items():
        yield from decoded(bag, topic, messages, store)


def _typestore(bag: BagContents) -> Typestore:
    described: Typesdict = {}
    for kind in {bag.types[topic] for topic in bag.messages}:
        if kind not in bag.definitions:
            continue
        encoding, text = bag.definitions[kind]
        try:
            if encoding == "ros2msg":
                described.update(get_types_from_msg(text, kind))
            elif encoding == "ros2idl":
                for part in text.split(_IDL_BEGIN):
                    body = part.partition("\n")[2] if part.startswith("IDL: ") else part
                    described.update(get_types_from_idl(body) if body.strip() else {})
        except TypesysError as problem:
            raise UserError(f"bag {bag.path}: the description of {kind} cannot be read: {problem}") from problem
    store = get_typestore(Stores.EMPTY)
    store.register({**ros_types.typestore().fielddefs, **described})
    return store
