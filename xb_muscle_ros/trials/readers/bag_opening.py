"""Bags of others opened, MCAP or SQLite: a folder, a file, or the parts of a split bag."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

from rosbags.interfaces import MessageDefinitionFormat

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials import ros_types
from xb_muscle_ros.trials.bag_contents import BagContents, open_bag
from xb_muscle_ros.trials.bag_files import METADATA
from xb_muscle_ros.trials.messages import Messages
from xb_muscle_ros.trials.readers.base import begin_of

SQLITE = b"SQLite format 3\x00"
_FORMATS = {MessageDefinitionFormat.MSG: "ros2msg", MessageDefinitionFormat.IDL: "ros2idl"}


def open_any(path: Path, wanted: Collection[str]) -> BagContents:
    """Open a bag; messages of the wanted topics alone are kept.

    Raises:
        UserError: it cannot be read.
    """
    return _sqlite(path, wanted) if _is_sqlite(path) else open_bag(path, wanted)


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


def _sqlite(path: Path, wanted: Collection[str]) -> BagContents:
    from rosbags.highlevel import AnyReader

    files = [path]
    flaws: tuple[str, ...] = ()
    if path.is_dir() and not (path / METADATA).is_file():
        files, flaws = sqlite_parts(path), (f"{METADATA} is missing",)
        if not files:
            raise UserError(f"bag {path} has no {METADATA}; make it anew with ros2 bag reindex {path} sqlite3")
    bag = BagContents(path, {}, {}, {}, {}, None, flaws)
    for file in files:
        try:
            with AnyReader([file], default_typestore=ros_types.typestore()) as reader:
                for each in reader.connections:
                    bag.types[each.topic], bag.encodings[each.topic] = each.msgtype, "cdr"
                    if each.msgdef.format in _FORMATS:
                        bag.definitions[each.msgtype] = (_FORMATS[each.msgdef.format], each.msgdef.data)
                used = [each for each in reader.connections if each.topic in wanted]
                for connection, log_ns, data in reader.messages(connections=used) if used else ():
                    bag.messages.setdefault(connection.topic, Messages(connection.topic)).add(log_ns, bytes(data))
        except Exception as problem:  # the library passes on what its parsers trip over
            raise UserError(f"bag {path} cannot be read: {problem}; record or convert it again") from problem
    return bag
