"""Bags of others opened: MCAP as `replay` opens them, SQLite by the `rosbags` library."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials import ros_types
from xb_muscle_ros.trials.bag_contents import open_bag
from xb_muscle_ros.trials.bag_files import METADATA
from xb_muscle_ros.trials.bag_messages import AnyMessage, decoded
from xb_muscle_ros.trials.readers.base import begin_of

SQLITE = b"SQLite format 3\x00"


class ForeignBag(NamedTuple):
    """Some topics of a bag.

    Attributes:
        topics: names of all topics of the bag.
        counts: number of messages of each wanted topic.
        messages: of the wanted topics, each topic in order of log time.
        flaws: what is wrong with the bag and was lived with.
    """

    topics: tuple[str, ...]
    counts: Mapping[str, int]
    messages: Iterable[AnyMessage]
    flaws: tuple[str, ...]


def open_foreign(path: Path, wanted: Collection[str]) -> ForeignBag:
    """Open the wanted topics of a bag.

    Raises:
        UserError: the bag cannot be read; iterating raises it where a message cannot.
    """
    if _is_sqlite(path):
        return _sqlite(path, wanted)
    bag = open_bag(path, wanted)
    counts = {topic: len(bag.messages.get(topic, ())) for topic in wanted}
    return ForeignBag(tuple(bag.types), counts, decoded(bag), bag.flaws)


def _is_sqlite(path: Path) -> bool:
    """Whether a file or a bag folder is of SQLite: by its begin, or by its files' names."""
    if path.is_dir():
        told = path / METADATA
        named = told.is_file() and b"storage_identifier: sqlite3" in told.read_bytes()
        return not any(path.glob("*.mcap")) and (named or any(path.glob("*.db3")))
    return path.suffix.lower() == ".db3" or begin_of(path, len(SQLITE)) == SQLITE


def _sqlite(path: Path, wanted: Collection[str]) -> ForeignBag:
    from rosbags.highlevel import AnyReader

    if path.is_dir() and not (path / METADATA).is_file():
        raise UserError(f"bag {path} has no {METADATA}; make it anew with ros2 bag reindex {path} sqlite3")
    try:
        with AnyReader([path], default_typestore=ros_types.typestore()) as reader:
            topics = tuple(dict.fromkeys(connection.topic for connection in reader.connections))
            counts = {topic: reader.topics[topic].msgcount for topic in wanted if topic in topics}
    except Exception as problem:  # the library passes on what its parsers trip over
        raise _unreadable(path, problem) from problem
    return ForeignBag(topics, counts, _sqlite_messages(path, wanted), ())


def _sqlite_messages(path: Path, wanted: Collection[str]) -> Iterator[AnyMessage]:
    from rosbags.highlevel import AnyReader

    try:
        with AnyReader([path], default_typestore=ros_types.typestore()) as reader:
            used = [connection for connection in reader.connections if connection.topic in wanted]
            for connection, log_ns, data in reader.messages(connections=used):
                yield AnyMessage(connection.topic, log_ns, reader.deserialize(data, connection.msgtype))
    except UserError:  # of what is done with the messages
        raise
    except Exception as problem:
        raise _unreadable(path, problem) from problem


def _unreadable(path: Path, problem: Exception) -> UserError:
    return UserError(f"bag {path} cannot be read: {problem}; record or convert it again")
