"""A bag that is written while messages come, and that can be read up to its last moments if the writer is killed.

Chunks are small and reach the system at once, and ``metadata.yaml`` with the trial's facts is there from the beginning.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from rosbags.interfaces import Connection, Qos

from xb_muscle_ros import fast_yaml
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials import ros_types
from xb_muscle_ros.trials.bag_files import METADATA
from xb_muscle_ros.trials.bag_writer import ROS_DISTRO, BagWriter


class LiveBag:
    """An MCAP bag in the making.

    Attributes:
        path: the folder.
        counts: messages so far, by topic.
    """

    def __init__(self, path: Path, facts: Mapping[str, str]) -> None:
        """Make the folder and begin its file.

        Args:
            path: a folder that does not exist yet.
            facts: the bag's ``custom_data``.

        Raises:
            UserError: it cannot be made.
        """
        self.path = path
        self.counts: dict[str, int] = {}
        self._connections: dict[str, Connection] = {}
        self._unsaved = 0
        try:
            self._writer = BagWriter(path, path.name, facts)
            self._writer.open()
            (path / METADATA).write_text(_beginning(path.name, facts), encoding="utf-8")
        except OSError as problem:
            raise UserError(f"bag {path} cannot be written: {problem.strerror or problem}") from problem

    def add(self, topic: str, message_type: str, qos: Sequence[Qos] = ()) -> None:
        """Begin a topic; nothing where it is there already.

        Raises:
            UserError: the definition of the type is not known.
        """
        if topic in self._connections:
            return
        try:
            self._connections[topic] = self._writer.add_connection(
                topic, message_type, typestore=ros_types.typestore(), offered_qos_profiles=qos or ros_types.qos(topic)
            )
        except KeyError:
            raise UserError(
                f"topic {topic} is of type {message_type}, whose definition is not among those of ROS 2 Jazzy; leave "
                "it out"
            ) from None
        self.counts[topic] = 0

    def write(self, topic: str, stamp_ns: int, message: bytes) -> None:
        """Take a message.

        Args:
            topic: one that was added.
            stamp_ns: when it was heard, ns.
            message: serialized.

        Raises:
            UserError: it cannot be written; what was saved before stays.
        """
        with self._told():
            self._writer.write(self._connections[topic], stamp_ns, message)
        self.counts[topic] += 1
        self._unsaved += 1

    def save(self) -> None:
        """End the chunk and hand it to the system: what came before outlives this process.

        Raises:
            UserError: see `write`.
        """
        if not self._unsaved:
            return
        storage: Any = self._writer.storage
        with self._told():
            storage.close_chunk()
            storage.bio.flush()
        self._unsaved = 0

    def close(self) -> None:
        """End the file and write the metadata.

        Raises:
            UserError: see `write`.
        """
        self.save()
        with self._told():
            self._writer.close()

    @contextlib.contextmanager
    def _told(self) -> Iterator[None]:
        """Make one line of what the system says."""
        try:
            yield
        except OSError as problem:
            raise UserError(
                f"bag {self.path} cannot be written any more: {problem.strerror or problem}; what was saved before can "
                "be read"
            ) from problem


def _beginning(name: str, facts: Mapping[str, str]) -> str:
    """Metadata of a bag that is not finished: no message is counted yet."""
    nothing = {"nanoseconds_since_epoch": 0}
    file = f"{name}_0.mcap"
    information: dict[str, Any] = {
        "version": 9,
        "storage_identifier": "mcap",
        "duration": {"nanoseconds": 0},
        "starting_time": nothing,
        "message_count": 0,
        "topics_with_message_count": [],
        "compression_format": "",
        "compression_mode": "",
        "relative_file_paths": [file],
        "files": [
            {"path": file, "starting_time": dict(nothing), "duration": {"nanoseconds": 0}, "message_count": 0},
        ],
        "custom_data": dict(facts),
        "ros_distro": ROS_DISTRO,
    }
    return fast_yaml.dump({"rosbag2_bagfile_information": information})
