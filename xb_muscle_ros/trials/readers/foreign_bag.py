"""Bags of others opened: MCAP as `replay` opens them, SQLite by the `rosbags` library."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials import ros_types
from xb_muscle_ros.trials.bag_contents import open_bag
from xb_muscle_ros.trials.bag_files import METADATA
from xb_muscle_ros.trials.bag_messages import AnyMessage, decoded
from xb_muscle_ros.trials.readers.base import begin_of

if TYPE_CHECKING:
    from rosbags.highlevel import AnyReader

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
    return path.suffix.lower() == ".db3" or begin_of(path).startswith(SQLITE)


def sqlite_parts(folder: Path) -> list[Path]:
    """The files of a split SQLite bag without metadata, in order: one name with the numbers 0, 1, 2, ...; or none."""
    found = {file.stem.rpartition("_")[2]: file for file in folder.glob("*.db3")}
    names = {file.stem.rpartition("_")[0] for file in folder.glob("*.db3")}
    if (folder / METADATA).is_file() or len(names) != 1 or set(found) != {str(i) for i in range(len(found))}:
        return []
    return [found[str(i)] for i in range(len(found))]


def _sqlite(path: Path, wanted: Collection[str]) -> ForeignBag:
    files = [path]
    flaws: tuple[str, ...] = ()
    if path.is_dir() and not (path / METADATA).is_file():
        files, flaws = sqlite_parts(path), (f"{METADATA} is missing",)
        if not files:
            raise UserError(f"bag {path} has no {METADATA}; make it anew with ros2 bag reindex {path} sqlite3")
    topics: dict[str, None] = {}
    counts = dict.fromkeys(wanted, 0)
    for file in files:
        with _opened(path, file) as reader:
            topics.update(dict.fromkeys(connection.topic for connection in reader.connections))
            for topic in set(wanted) & set(reader.topics):
                counts[topic] += reader.topics[topic].msgcount
    return ForeignBag(tuple(topics), counts, _sqlite_messages(path, files, wanted), flaws)


def _sqlite_messages(path: Path, files: list[Path], wanted: Collection[str]) -> Iterator[AnyMessage]:
    for file in files:
        with _opened(path, file) as reader:
            used = [connection for connection in reader.connections if connection.topic in wanted]
            for connection, log_ns, data in reader.messages(connections=used) if used else ():
                yield AnyMessage(connection.topic, log_ns, reader.deserialize(data, connection.msgtype))


@contextmanager
def _opened(path: Path, file: Path) -> Iterator[AnyReader]:
    from rosbags.highlevel import AnyReader

    try:
        with AnyReader([file], default_typestore=ros_types.typestore()) as reader:
            yield reader
    except UserError:  # of what is done with the messages
        raise
    except Exception as problem:  # the library passes on what its parsers trip over
        raise UserError(f"bag {path} cannot be read: {problem}; record or convert it again") from problem
