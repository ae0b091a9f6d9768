"""Axon binary files, written by the places that Axon's description gives to the fields of their headers."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import NamedTuple

import numpy as np

BLOCK = 512
RANGE_V, RESOLUTION = 10.0, 32768
GAP_FREE, EPISODIC, VARIABLE = 3, 5, 1
ABF1_BLOCKS = 12


class Input(NamedTuple):
    """A channel: the number of the input, its name, its unit as bytes, its scale (V per unit) and its offset (unit)."""

    number: int
    name: str
    unit: bytes
    scale: float
    offset: float = 0.0


def unit_per_count(channel: Input) -> float:
    """What one count of the converter is, in the channel's unit."""
    return RANGE_V / RESOLUTION / channel.scale


def abf1(
    path: Path,
    inputs: list[Input],
    counts: np.ndarray,
    step_us: float,
    sweeps: int = 1,
    mode: int = EPISODIC,
    tags: tuple[tuple[int, str], ...] = (),
) -> Path:
    """Write ABF1.

    Args:
        counts: of the converter, shape (samples of all sweeps, channels).
        step_us: between the samples of a channel, us.
        tags: time, in samples of all channels, and text.
    """
    data = bytearray(ABF1_BLOCKS * BLOCK)

    def put(kind: str, at: int, *values: object) -> None:
        struct.pack_into(f"<{kind}", data, at, *values)

    samples = counts.astype("<i2").tobytes()
    blocks = -(-len(samples) // BLOCK)
    put("4sf", 0, b"ABF ", 1.83)
    put("hihi", 8, mode, counts.size, 0, sweeps)
    put("ii", 20, 20260314, 3600 * 10 + 60 * 5)
    put("iii", 40, ABF1_BLOCKS, ABF1_BLOCKS + blocks if tags else 0, len(tags))
    put("h", 100, 0)
    put("hf", 120, len(inputs), step_us / len(inputs))
    put("i", 138, counts.size // sweeps)
    put("ffi", 244, RANGE_V, RANGE_V, RESOLUTION)
    put("56s", 310, b"fibre 7, 15 C")
    for i in range(16):
        put("h", 410 + 2 * i, inputs[i].number if i < len(inputs) else -1)
        put("ffff", 730 + 4 * i, 1.0, 0.0, 0.0, 0.0)
    for i in range(16):
        put("f", 730 + 4 * i, 1.0)  # gain of the converter
        put("f", 922 + 4 * i, 1.0)
        put("f", 1050 + 4 * i, 1.0)  # gain of the signal conditioner
    for each in inputs:
        put("10s", 442 + 10 * each.number, each.name.encode().ljust(10))
        put("8s", 602 + 8 * each.number, each.unit.ljust(8))
        put("f", 922 + 4 * each.number, each.scale)
        put("f", 986 + 4 * each.number, each.offset)
    put("256s", 4898, rb"C:\protocols\stretch 5.pro")
    body = bytes(data) + samples.ljust(blocks * BLOCK, b"\x00")
    body += b"".join(struct.pack("<i56shh", at, text.encode().ljust(56), 1, 0) for at, text in tags)
    path.write_bytes(body)
    return path


def abf2(
    path: Path,
    inputs: list[Input],
    counts: np.ndarray,
    step_us: float,
    lengths: tuple[int, ...] = (),
    mode: int = GAP_FREE,
    tags: tuple[tuple[int, str], ...] = (),
) -> Path:
    """Write ABF2; `lengths` are the samples of each sweep; tags as in `abf1`."""
    strings = [b"Clampex", rb"C:\protocols\ramp 3.pro", b"fibre 7, 15 C"]
    strings += [text for each in inputs for text in (each.name.encode(), each.unit)]
    names = [0] + [strings.index(text) + 1 for text in strings]

    protocol = bytearray(BLOCK)
    struct.pack_into("<hf", protocol, 0, mode, step_us)
    struct.pack_into("<f", protocol, 14, step_us / len(inputs))
    struct.pack_into("<i", protocol, 22, counts.size // max(len(lengths), 1))
    struct.pack_into("<ffii", protocol, 110, RANGE_V, RANGE_V, RESOLUTION, RESOLUTION)
    struct.pack_into("<i", protocol, 132, names[3])

    channels = b""
    for i, each in enumerate(inputs):
        entry = bytearray(128)
        struct.pack_into("<h", entry, 0, each.number)
        struct.pack_into("<f", entry, 28, 1.0)
        struct.pack_into("<ffff", entry, 40, each.scale, each.offset, 1.0, 0.0)
        struct.pack_into("<ii", entry, 74, names[4 + 2 * i], names[5 + 2 * i])
        channels += bytes(entry)

    text = b"SSCH".ljust(44, b"\x00") + b"\x00" + b"\x00".join(strings) + b"\x00"
    entries = b"".join(struct.pack("<i56shh", at, note.encode().ljust(56), 1, 0) for at, note in tags)
    starts = np.cumsum([0, *lengths])
    sweeps = b"".join(
        struct.pack("<ii", int(start) * len(inputs), length * len(inputs))
        for start, length in zip(starts, lengths, strict=False)
    )
    samples = counts.astype("<i2").tobytes()

    header, body = bytearray(BLOCK), b""
    struct.pack_into("<4s4B", header, 0, b"ABF2", 0, 0, 0, 2)
    struct.pack_into("<IIII", header, 8, BLOCK, len(lengths), 20260314, 1000 * (3600 * 10 + 60 * 5))
    struct.pack_into("<II", header, 60, names[1], 0)
    struct.pack_into("<I", header, 72, names[2])
    for at, content, size, count in (
        (76, bytes(protocol), BLOCK, 1),
        (92, channels, 128, len(inputs)),
        (220, text, len(text), 1),
        (236, samples, 2, counts.size),
        (252, entries, 64, len(tags)),
        (316, sweeps, 8, len(lengths)),
    ):
        if count:
            struct.pack_into("<IIq", header, at, 1 + len(body) // BLOCK, size, count)
            body += content.ljust(-(-len(content) // BLOCK) * BLOCK, b"\x00")
    path.write_bytes(bytes(header) + body)
    return path
