"""MCAP bags in rosbag2's layout, written many messages at once.

The writer of `rosbags` with some things made to fit. rosbag2 numbers the files of a bag. The YAML writer within
`rosbags` wraps long lines in ways that add or lose spaces, in the metadata file and in its copy within the MCAP file;
here nothing is wrapped. Messages come as rows of bytes and go into chunks together, and chunks have checksums.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Mapping, Sequence
from io import BytesIO
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from mcap.opcode import Opcode
from rosbags.interfaces import Connection
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.rosbag2.enums import CompressionMode
from rosbags.rosbag2.storage_mcap import McapWriter

from xb_muscle_ros import fast_yaml
from xb_muscle_ros.trials.rows import Bytes, Ints, put_rows
from xb_muscle_ros.trials.stamps import Stamps

# Whose message definitions and type hashes the bags hold.
ROS_DISTRO = "jazzy"
# A chunk ends with the message that takes it beyond this, bytes.
_CHUNK_BYTES = 1 << 20
_RECORD = struct.Struct("<BQ")
_MESSAGE = struct.Struct("<HIQQ")
HEAD_BYTES = _RECORD.size + _MESSAGE.size
"""Of a message record, before the message's own bytes."""


class Part(NamedTuple):
    """Messages of one topic and one size.

    Attributes:
        connection: of the topic.
        stamps_ns: shape (messages,), ascending, ns; log time and publish time.
        rows: shape (messages, `HEAD_BYTES` + size): room for the record's head, then the message's own bytes. The head
            is filled in when they are written.
    """

    connection: Connection
    stamps_ns: Stamps
    rows: Bytes


class _Mcap(McapWriter):
    def __init__(self, path: Path, compression: CompressionMode) -> None:
        super().__init__(path, compression)
        self._facts: dict[str, str] = {}
        self._index: dict[int, list[Ints]] = {}

    def begin(self, name: str, facts: dict[str, str]) -> None:
        self.path = self.path.rename(self.path.parent / f"{name}_0.mcap")
        self._facts = facts

    def write(self, connection: Connection, timestamp: int, data: bytes | memoryview) -> None:
        offset = self.chunk.bio.tell()
        length = _MESSAGE.size + len(data)
        head = _RECORD.pack(Opcode.MESSAGE, length) + _MESSAGE.pack(connection.id, 0, timestamp, timestamp)
        self.chunk.bio.write(head)
        self.chunk.bio.write(data)
        self._count(connection.id, timestamp, timestamp, np.array([[timestamp, offset]]))
        if self.chunk.bio.tell() > _CHUNK_BYTES:
            self.close_chunk()

    def put(self, parts: Sequence[Part], order: Ints) -> None:
        """Write the messages of all parts in an order that keeps that of each part."""
        for part in parts:
            _fill_heads(part)
        which = np.repeat(np.arange(len(parts)), [len(part.rows) for part in parts])[order]
        ends = np.cumsum(np.array([part.rows.shape[1] for part in parts])[which])
        taken = [0] * len(parts)
        first = begin = 0
        while first < which.size:
            room = begin + _CHUNK_BYTES - self.chunk.bio.tell()
            last = min(int(np.searchsorted(ends, room, side="right")) + 1, which.size)
            chunk = np.empty(int(ends[last - 1]) - begin, dtype=np.uint8)
            starts = np.concatenate(([0], ends[first : last - 1] - begin))
            for i in dict.fromkeys(which[first:last].tolist()):
                at, part = starts[which[first:last] == i], parts[i]
                its = slice(taken[i], taken[i] + at.size)
                put_rows(chunk, at, part.rows[its])
                stamps = part.stamps_ns[its]
                entries = np.column_stack((stamps, at + self.chunk.bio.tell()))
                self._count(part.connection.id, int(stamps[0]), int(stamps[-1]), entries)
                taken[i] = its.stop
            self.chunk.bio.write(chunk.data)
            first, begin = last, int(ends[last - 1])
            if self.chunk.bio.tell() > _CHUNK_BYTES:
                self.close_chunk()

    def _count(self, channel: int, first_ns: int, last_ns: int, entries: Ints) -> None:
        """Take messages into index (times in ns, and where in the chunk) and statistics."""
        self._index.setdefault(channel, []).append(entries)
        self.channel_stats[channel] += len(entries)
        for of in (self, self.chunk):
            of.message_start_time = min(of.message_start_time, first_ns)
            of.message_end_time = max(of.message_end_time, last_ns)

    def close_chunk(self) -> None:
        """Write the chunk, the index of its messages, and keep what tells where they are."""
        records = self.chunk.bio.getvalue()
        compressed = self.compressor(records)
        times = struct.pack("<QQ", self.chunk.message_start_time, self.chunk.message_end_time)
        name = struct.pack("<I", len(self.compression)) + self.compression.encode()
        start = self.bio.tell()
        checked = struct.pack("<QI", len(records), zlib.crc32(records))
        self._record(Opcode.CHUNK, times + checked + name + struct.pack("<Q", len(compressed)), compressed)
        end = self.bio.tell()
        offsets = b""
        for channel, found in self._index.items():
            offsets += struct.pack("<HQ", channel, self.bio.tell())
            entries = np.concatenate(found).astype("<u8").tobytes()
            self._record(Opcode.MESSAGE_INDEX, struct.pack("<HI", channel, len(entries)), entries)
        where = struct.pack("<QQI", start, end - start, len(offsets)) + offsets
        sizes = struct.pack("<QQ", len(compressed), len(records))
        kept = BytesIO()
        kept.write(times + where + struct.pack("<Q", self.bio.tell() - end) + name + sizes)
        self.chunks.append(kept)
        self.chunk = type(self.chunk)(2**63 - 1, 0, BytesIO(), self.chunk.msgs)
        self._index = {}

    def _record(self, opcode: Opcode, head: bytes, content: bytes) -> None:
        self.bio.write(_RECORD.pack(opcode, len(head) + len(content)) + head)
        self.bio.write(content)

    def close(self, version: int, metadata: str) -> None:
        super().close(version, _with_facts(metadata, self._facts))


def _fill_heads(part: Part) -> None:
    """Write the heads of message records."""
    size = part.rows.shape[1]
    head = _RECORD.pack(Opcode.MESSAGE, size - _RECORD.size) + _MESSAGE.pack(part.connection.id, 0, 0, 0)
    part.rows[:, :HEAD_BYTES] = np.frombuffer(head, np.uint8)
    times = part.stamps_ns.astype("<u8").view(np.uint8).reshape(-1, 8)
    part.rows[:, HEAD_BYTES - 16 : HEAD_BYTES - 8] = times
    part.rows[:, HEAD_BYTES - 8 : HEAD_BYTES] = times


class BagWriter(Writer):
    """Writes an MCAP bag of rosbag2's version 9 to a folder that does not exist yet.

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
        self._mcap.begin(self._name, self._facts)

    @property
    def _mcap(self) -> _Mcap:
        assert isinstance(self.storage, _Mcap)  # from STORAGE_PLUGINS
        return self.storage

    def put(self, parts: Sequence[Part], order: Ints) -> None:
        """Write messages of several topics.

        Args:
            parts: of each topic at most one.
            order: which message comes when, counted through the parts one after another; keeps that of each part.
        """
        self._mcap.put(parts, order)
        for part in parts:
            self.counts[part.connection.id] += len(part.rows)
            if len(part.rows):
                self.min_timestamp = min(self.min_timestamp, int(part.stamps_ns[0]))
                self.max_timestamp = max(self.max_timestamp, int(part.stamps_ns[-1]))

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
