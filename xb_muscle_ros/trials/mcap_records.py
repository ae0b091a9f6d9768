"""Messages of an MCAP file, read from its begin record by record.

A recorder that was stopped hard leaves a file without its end: no index, perhaps half a chunk. Readers that begin
with the index give nothing then; this one gives every message that is whole, and says where and how the file ends.
The layout is that of the MCAP specification; records with text are decoded by the `mcap` library. Messages that follow
each other are taken together: one by one they would take seconds where a recording has a million.
"""

from __future__ import annotations

import os
import struct
import zlib
from collections.abc import Container, Generator, Iterator
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import BinaryIO, NamedTuple

import lz4.frame  # type: ignore[import-untyped]  # it ships no types
import numpy as np
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Metadata, Schema

from xb_muscle_ros.trials.messages import LOG_BYTES, Bytes, Ints, Messages
from xb_muscle_ros.trials.rows import rows_of

MAGIC = b"\x89MCAP0\r\n"
_RECORD = struct.Struct("<BQ")
_MESSAGE = struct.Struct("<HIQQ")
_CHUNK = struct.Struct("<QQQII")
# Where a message record has its log time.
_LOG_AT = slice(6, 6 + LOG_BYTES)
# So much of a file is read at once, or one record where that is longer, bytes.
_WINDOW = 1 << 22


class _Run(NamedTuple):
    """Message records that follow each other: where each begins within the data, and where the last ends."""

    data: memoryview
    starts: list[int]
    end: int


@dataclass
class Recording:
    """What a file holds.

    Attributes:
        types: message type of each topic; a topic without schema has the type ''.
        encodings: encoding of each topic's messages, ``cdr`` in ROS 2.
        definitions: format (``ros2msg`` or ``ros2idl``) and text of each message type that the file describes.
        messages: of each topic that has any.
        metadata: named maps of strings; rosbag2 keeps a copy of its metadata in ``rosbag2``.
        damage: where and how the file ends too early; None for a whole file.
    """

    types: dict[str, str] = field(default_factory=dict)
    encodings: dict[str, str] = field(default_factory=dict)
    definitions: dict[str, tuple[str, str]] = field(default_factory=dict)
    messages: dict[str, Messages] = field(default_factory=dict)
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    damage: str | None = None


class _CutError(Exception):
    """The file ends here and should not."""


class _DamageError(Exception):
    """The file cannot be read beyond this point, for the reason given."""


def read_recording(path: Path, topics: Container[str] | None = None) -> Recording:
    """Read an MCAP file, whole or not.

    Args:
        topics: messages of these alone are kept; None for all.

    Raises:
        OSError: the file cannot be opened.
        ValueError: the file is no MCAP file.
    """
    with path.open("rb") as file:
        size = os.fstat(file.fileno()).st_size
        if file.read(len(MAGIC)) != MAGIC[:size]:
            raise ValueError("it does not begin like an MCAP file")
        recording = Recording()
        try:
            _read(file, size, recording, topics)
        except _CutError:
            recording.damage = f"cut short after {size} bytes"
        except _DamageError as damage:
            recording.damage = f"damaged, {damage}"
    return recording


def _read(file: BinaryIO, size: int, recording: Recording, topics: Container[str] | None) -> None:
    schemas: dict[int, str] = {}
    channels: dict[int, str] = {}
    for opcode, content in _records(file, size):
        if opcode == Opcode.FOOTER:
            return
        try:
            if isinstance(content, _Run):
                _take(content, channels, recording.messages, topics)
            elif opcode == Opcode.SCHEMA:
                schema = Schema.read(_stream(content))
                schemas[schema.id] = schema.name
                if schema.data:
                    text = bytes(schema.data).decode(errors="replace")
                    recording.definitions[schema.name] = (schema.encoding, text)
            elif opcode == Opcode.CHANNEL:
                described = Channel.read(_stream(content))
                channels[described.id] = described.topic
                recording.types[described.topic] = schemas.get(described.schema_id, "")
                recording.encodings[described.topic] = described.message_encoding
            elif opcode == Opcode.METADATA:
                named = Metadata.read(_stream(content))
                recording.metadata[named.name] = named.metadata
        except (struct.error, UnicodeDecodeError, McapError) as problem:
            raise _DamageError(f"a record cannot be read ({problem})") from problem
    raise _CutError


def _take(run: _Run, channels: dict[int, str], found: dict[str, Messages], topics: Container[str] | None) -> None:
    """Put messages to those of their topics, up to the first that is none."""
    buffer = np.frombuffer(run.data, np.uint8)
    starts = np.array(run.starts, dtype=np.int64) + _RECORD.size
    sizes = np.diff(starts, append=run.end + _RECORD.size) - _RECORD.size
    short = np.flatnonzero(sizes < _MESSAGE.size)
    count = int(short[0]) if short.size else starts.size
    numbers = np.concatenate([rows_of(buffer, starts[:count], 2)]).view("<u2")[:, 0].astype(np.int64)
    unknown = np.flatnonzero(~np.isin(numbers, list(channels)))
    count = int(unknown[0]) if unknown.size else count
    _take_known(buffer, starts[:count], sizes[:count], numbers[:count], channels, found, topics)
    if unknown.size:
        raise _DamageError(f"a message belongs to channel {numbers[count]}, which the file does not describe")
    if short.size:
        begin = int(starts[count])
        _MESSAGE.unpack_from(run.data[begin : begin + int(sizes[count])])


def _take_known(
    buffer: Bytes, starts: Ints, sizes: Ints, numbers: Ints, channels: dict[int, str],
    found: dict[str, Messages], topics: Container[str] | None,
) -> None:  # fmt: skip
    for topic in dict.fromkeys(channels[number] for number in dict.fromkeys(numbers.tolist())):
        if topics is not None and topic not in topics:
            continue
        of_topic = np.isin(numbers, [number for number, its in channels.items() if its == topic])
        begins, lengths = starts[of_topic], sizes[of_topic]
        groups: list[tuple[Ints | None, Bytes]] = []
        for size in dict.fromkeys(lengths.tolist()):
            places = np.flatnonzero(lengths == size)
            records = rows_of(buffer, begins[places], size)
            rows = np.concatenate((records[:, _LOG_AT], records[:, _MESSAGE.size :]), axis=1)
            groups.append((None if places.size == lengths.size else places, rows))
        found.setdefault(topic, Messages(topic)).add_batch(groups)


def _records(file: BinaryIO, size: int) -> Iterator[tuple[int, memoryview | _Run]]:
    """Whole records of a file, in place of a chunk those within it, as far as they are there."""
    position, window = len(MAGIC), _WINDOW
    while position < size:
        file.seek(position)
        data = memoryview(file.read(min(window, size - position)))
        done = yield from _whole(data, position, position + len(data) >= size)
        position += done
        # A record that is longer than what was read is read whole.
        window = _WINDOW if done else max(_WINDOW, _RECORD.size + _RECORD.unpack_from(data)[1])


def _whole(data: memoryview, at: int, ends: bool) -> Generator[tuple[int, memoryview | _Run], None, int]:
    """Whole records of a part; messages that follow each other come together.

    Args:
        at: where the part begins, for messages.
        ends: nothing comes after it, so that a record that is not whole is cut.

    Returns:
        where the first record begins that is not whole.
    """
    position, size, starts = 0, len(data), list[int]()
    unpack, head, message = _RECORD.unpack_from, _RECORD.size, int(Opcode.MESSAGE)
    while position + head <= size:
        opcode, length = unpack(data, position)
        end = position + head + length
        if opcode == message and end <= size:
            starts.append(position)
            position = end
            continue
        if starts:
            yield message, _Run(data, starts, position)
            starts = []
        if opcode == 0:
            raise _DamageError(f"there is no record where one should be, at byte {at + position}")
        whole = end <= size
        if not whole and not ends:
            return position
        content = data[position + head : end]
        if opcode == Opcode.CHUNK:
            yield from _whole(memoryview(_chunk(content, whole)), 0, True)
        elif whole:
            yield opcode, content
        if not whole:
            raise _CutError
        position = end
    if starts:
        yield message, _Run(data, starts, position)
    if ends and position < size:
        raise _CutError
    return position


def _chunk(content: memoryview, whole: bool) -> bytes | memoryview:
    """The records within a chunk, decompressed as far as they are there."""
    try:
        *_, crc, name_length = _CHUNK.unpack_from(content)
        start = _CHUNK.size + name_length + 8
        compression = bytes(content[_CHUNK.size : _CHUNK.size + name_length]).decode()
        if start > len(content):
            raise _CutError
        records = _decompress(bytes(content[start:]), compression) if compression else content[start:]
    except (struct.error, UnicodeDecodeError, zstandard.ZstdError, RuntimeError) as problem:
        raise _DamageError(f"a chunk cannot be read ({problem})") from problem
    if whole and crc and zlib.crc32(records) != crc:
        raise _DamageError("a chunk's checksum is wrong")
    return records


def _decompress(data: bytes, compression: str) -> bytes:
    # The streaming decompressors give what is there of a cut chunk; the others give nothing.
    if compression == "zstd":
        return zstandard.ZstdDecompressor().decompressobj().decompress(data)
    if compression == "lz4":
        return bytes(lz4.frame.LZ4FrameDecompressor().decompress(data))
    raise _DamageError(f"a chunk is compressed with '{compression}'; known are zstd and lz4")


def _stream(content: memoryview) -> ReadDataStream:
    return ReadDataStream(BytesIO(bytes(content)))
