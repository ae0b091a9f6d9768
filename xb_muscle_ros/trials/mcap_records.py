"""Messages of an MCAP file, read from its begin record by record.

A recorder that was stopped hard leaves a file without its end: no index, perhaps half a chunk. Readers that begin
with the index give nothing then; this one gives every message that is whole, and says where and how the file ends.
The layout is that of the MCAP specification; records with text are decoded by the `mcap` library.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Container, Iterator
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import NamedTuple

import lz4.frame  # type: ignore[import-untyped]  # it ships no types
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Metadata, Schema

MAGIC = b"\x89MCAP0\r\n"
_RECORD = struct.Struct("<BQ")
_MESSAGE = struct.Struct("<HIQQ")
_CHUNK = struct.Struct("<QQQII")


class Message(NamedTuple):
    """One message: where it was published, when it was logged (ns), and its bytes."""

    topic: str
    log_time_ns: int
    data: bytes


@dataclass
class Recording:
    """What a file holds.

    Attributes:
        types: message type of each topic; a topic without schema has the type ''.
        encodings: encoding of each topic's messages, ``cdr`` in ROS 2.
        definitions: format (``ros2msg`` or ``ros2idl``) and text of each message type that the file describes.
        messages: in the order of the file.
        metadata: named maps of strings; rosbag2 keeps a copy of its metadata in ``rosbag2``.
        damage: where and how the file ends too early; None for a whole file.
    """

    types: dict[str, str] = field(default_factory=dict)
    encodings: dict[str, str] = field(default_factory=dict)
    definitions: dict[str, tuple[str, str]] = field(default_factory=dict)
    messages: list[Message] = field(default_factory=list)
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
    data = path.read_bytes()
    if data[: len(MAGIC)] != MAGIC[: len(data)]:
        raise ValueError("it does not begin like an MCAP file")
    recording = Recording()
    schemas: dict[int, str] = {}
    channels: dict[int, str] = {}
    try:
        for opcode, content in _records(memoryview(data), len(MAGIC)):
            if opcode == Opcode.FOOTER:
                break
            try:
                if opcode == Opcode.MESSAGE:
                    channel, _, log_time_ns, _ = _MESSAGE.unpack_from(content)
                    if channel not in channels:
                        raise _DamageError(f"a message belongs to channel {channel}, which the file does not describe")
                    if topics is None or channels[channel] in topics:
                        message = Message(channels[channel], log_time_ns, bytes(content[_MESSAGE.size :]))
                        recording.messages.append(message)
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
        else:
            raise _CutError
    except _CutError:
        recording.damage = f"cut short after {len(data)} bytes"
    except _DamageError as damage:
        recording.damage = f"damaged, {damage}"
    return recording


def _records(data: memoryview, position: int) -> Iterator[tuple[int, memoryview]]:
    """Whole records as (opcode, content); in place of a chunk those within it, as far as they are there."""
    while position < len(data):
        if position + _RECORD.size > len(data):
            raise _CutError
        opcode, length = _RECORD.unpack_from(data, position)
        if opcode == 0:
            raise _DamageError(f"there is no record where one should be, at byte {position}")
        position += _RECORD.size
        content = data[position : position + length]
        whole = len(content) == length
        if opcode == Opcode.CHUNK:
            yield from _records(memoryview(_chunk(content, whole)), 0)
        elif whole:
            yield opcode, content
        if not whole:
            raise _CutError
        position += length


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
