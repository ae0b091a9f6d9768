"""Axon binary files (ABF1 and ABF2 of pClamp): channels with units, sweeps, and what the file tells beside them.

pyabf reads the headers. Where it would go by a damaged one, or drops a part of it, the bytes are looked at here: the
places of ABF1's fields and of ABF2's sections are those of Axon's description of the format.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path, PureWindowsPath
from typing import Any, NamedTuple

import numpy as np

from xb_muscle_ros.errors import UserError, suggest
from xb_muscle_ros.trials.trial import Array

ABF1, ABF2 = b"ABF ", b"ABF2"
_BLOCK = 512
# ABF2: where the header tells block, bytes of an entry, and entries of a section.
_SECTIONS = {
    "protocol": 76, "channels": 92, "outputs": 108, "epochs": 124, "epochs of outputs": 156, "user list": 172,
    "strings": 220, "data": 236, "tags": 252, "sweeps": 316,
}  # fmt: skip
_TAG_BYTES = 64
# ABF1: names and units of the 16 inputs.
_NAMES, _UNITS, _INPUTS = (442, 10), (602, 8), 16
_PROTOCOL, _COMMENT, _OLD_COMMENT = (4898, 256), (5154, 128), (310, 56)
# Old headers of ABF1 are shorter; comment, protocol and telegraphed gains would then be read from the samples.
_LONG_HEADER = 6144
_VARIABLE, _EPISODIC = 1, 5
_MODES = (1, 2, 3, 4, 5)


class Channel(NamedTuple):
    """Name and unit (empty where the file tells none) of a channel, and what its samples are scaled by."""

    name: str
    unit: str
    gain: float
    offset: float


@dataclass(frozen=True)
class AbfFile:
    """What a file holds.

    Attributes:
        channels: in the order of the file.
        step_s: time between the samples of a channel, s.
        sweeps: first sample of each, and one behind its last.
        notes: date, protocol, comment and tags, in words.
        raw: samples as stored, shape (samples, channels).
    """

    path: Path
    channels: tuple[Channel, ...]
    step_s: float
    sweeps: tuple[tuple[int, int], ...]
    notes: tuple[str, ...]
    raw: np.ndarray[Any, Any]

    def index(self, name: str) -> int:
        """Number of a channel, from 0, by its name or number.

        Raises:
            UserError: there is none, or several of that name.
        """
        names = [channel.name for channel in self.channels]
        for equal in (str, str.casefold):
            found = [i for i, each in enumerate(names) if equal(each) == equal(name.strip())]
            if len(found) == 1:
                return found[0]
            if found:
                raise UserError(f"{self.path} has {len(found)} channels '{name}'; give a number; it has {self.told()}")
        if name.strip().isdecimal() and int(name) < len(names):
            return int(name)
        raise UserError(f"{self.path} has no channel '{name}'{suggest(name, names)}; it has {self.told()}")

    def told(self) -> str:
        """Its channels, for messages."""
        return ", ".join(f"{i} '{each.name}' ({each.unit or 'no unit'})" for i, each in enumerate(self.channels))

    def values(self, channel: int, sweep: int) -> Array:
        """Samples of a channel in its unit, shape (samples,)."""
        begin, end = self.sweeps[sweep]
        samples: Array = self.raw[begin:end, channel].astype(np.float64)
        return samples * self.channels[channel].gain + self.channels[channel].offset


def read_abf(path: Path) -> AbfFile:
    """Read a file.

    Raises:
        UserError: pyabf is missing; the file cannot be read, is damaged, or of a kind that pyabf cannot read.
    """
    try:
        import pyabf
    except ImportError as problem:
        raise UserError(
            f"{path} is an Axon file, which needs pyabf ({problem}); type: pip install 'xb_muscle_ros[files]'"
        ) from problem
    try:
        data = path.read_bytes()
    except OSError as problem:
        raise UserError(f"{path} cannot be read: {problem.strerror}; give an ABF file") from problem
    try:
        _check_header(path, data)
        return _made(path, data, pyabf.ABF(str(path), loadData=False))
    except UserError:
        raise
    except Exception as problem:  # pyabf passes on whatever it trips over
        raise UserError(f"{path} is no whole ABF file ({problem}); copy it again") from problem


def _check_header(path: Path, data: bytes) -> None:
    """Make sure that the parts of a file are within it."""
    if data[:4] == ABF2:
        for name, at in _SECTIONS.items():
            block, size, count = struct.unpack_from("<IIq", data, at)
            if count < 0 or (count and not 0 < block * _BLOCK + size * count <= len(data)) or (count and not size):
                raise UserError(f"{path} is no whole ABF file: its {name} are not all there; copy it again")
    elif data[:4] == ABF1:
        if struct.unpack_from("<h", data, 100)[0] == 1:
            raise UserError(f"{path} is ABF1 with floating-point samples, which pyabf cannot read; save it as ABF2")
        block, count = struct.unpack_from("<ii", data, 44)
        if count < 0 or (count and not 0 < block * _BLOCK + _TAG_BYTES * count <= len(data)):
            raise UserError(f"{path} is no whole ABF file: its tags are not all there; copy it again")
    else:
        raise UserError(f"{path} does not begin with ABF; needed is an Axon binary file")


def _made(path: Path, data: bytes, abf: Any) -> AbfFile:
    is_first = data[:4] == ABF1
    count = int(abf.channelCount)
    step_us = float(abf._headerV1.fADCSampleInterval * count if is_first else abf._protocolSection.fADCSequenceInterval)
    channels = tuple(_channels(data, abf, is_first))
    if abf.nOperationMode not in _MODES or not channels or not (math.isfinite(step_us) and step_us > 0.0):
        raise ValueError(f"mode {abf.nOperationMode}, {count} channels, {step_us:g} us between samples")
    if not all(math.isfinite(each.gain) and each.gain and math.isfinite(each.offset) for each in channels):
        raise ValueError("a channel has no scale")
    kind = np.dtype("<f4" if abf._nDataFormat == 1 else "<i2")
    header = abf._headerV1 if is_first else None
    begin = int(abf.dataByteStart) if header is None else (
        header.lDataSectionPtr * _BLOCK + header.nNumPointsIgnored * kind.itemsize
    )  # fmt: skip
    points = int(abf.dataPointCount)
    there = (len(data) - begin) // kind.itemsize
    if begin <= 0 or points <= 0 or there < points:
        raise UserError(
            f"{path} holds {max(there, 0)} samples of {points}, so it was cut short or the recording was not ended; "
            "copy it again, or save it anew in Clampfit"
        )
    if points % count:
        raise ValueError(f"{points} samples of {count} channels")
    raw = np.frombuffer(data, dtype=kind, count=points, offset=begin).reshape(-1, count)
    sweeps = tuple(_sweeps(path, abf, _lengths(data, abf, is_first), points // count))
    return AbfFile(path, channels, 1e-6 * step_us, sweeps, tuple(_notes(data, abf, header)), raw)


def _channels(data: bytes, abf: Any, is_first: bool) -> Iterator[Channel]:
    for i in range(int(abf.channelCount)):
        gain, offset = (1.0, 0.0) if abf._nDataFormat == 1 else (float(abf._dataGain[i]), float(abf._dataOffset[i]))
        name, unit = abf.adcNames[i], abf.adcUnits[i]
        if is_first:  # pyabf drops the sign of micro
            number = int(abf._headerV1.nADCSamplingSeq[i])
            if not 0 <= number < _INPUTS:
                raise ValueError(f"channel {i} is input {number}")
            name, unit = (_text(data, at + size * number, size) for at, size in (_NAMES, _UNITS))
            if _is_short(abf._headerV1) and abf._headerV1.nTelegraphEnable[number] == 1:
                gain *= abf._headerV1.fTelegraphAdditGain[number]
        yield Channel("" if name == "?" else str(name), "" if unit == "?" else str(unit), gain, offset)


def _is_short(header: Any) -> bool:
    """Whether an ABF1 file's samples begin where a later header would go on."""
    return bool(header.lDataSectionPtr * _BLOCK < _LONG_HEADER)


def _text(data: bytes, at: int, size: int) -> str:
    return data[at : at + size].split(b"\x00")[0].decode("cp1252", "replace").strip()


def _lengths(data: bytes, abf: Any, is_first: bool) -> list[int]:
    """Samples of each sweep, all channels together, where the file lists them."""
    if not is_first:
        return [int(each) for each in abf._synchArraySection.lLength]
    block, count = struct.unpack_from("<ii", data, 92)
    if block <= 0 or not 0 < count <= (len(data) - block * _BLOCK) // 8:
        return []
    return [struct.unpack_from("<i", data, block * _BLOCK + 8 * i + 4)[0] for i in range(count)]


def _sweeps(path: Path, abf: Any, lengths: list[int], samples: int) -> Iterator[tuple[int, int]]:
    """Begin and end of each sweep, in samples of one channel."""
    count, channels = int(abf.sweepCount), int(abf.channelCount)
    whole = sum(lengths) == samples * channels and all(each > 0 and each % channels == 0 for each in lengths)
    if abf.nOperationMode == _VARIABLE and not whole:
        raise UserError(f"{path} does not tell how long each of its sweeps is; save it anew in Clampfit, or as text")
    if whole:
        ends = np.cumsum([each // channels for each in lengths]).tolist()
        yield from zip([0, *ends[:-1]], ends, strict=True)
        return
    header = abf._headerV1 if hasattr(abf, "_headerV1") else abf._protocolSection
    each, rest = divmod(samples, count)
    told = int(header.lNumSamplesPerEpisode)
    if rest or (abf.nOperationMode == _EPISODIC and told != each * channels):
        raise ValueError(f"{samples} samples of a channel are no {count} sweeps of {told // channels}")
    yield from ((i * each, (i + 1) * each) for i in range(count))


def _notes(data: bytes, abf: Any, header: Any) -> Iterator[str]:
    """Date, protocol, comment and tags."""
    dated = abf.abfDateTimeString != "ERROR" and (header is None or header.lFileStartDate > 0)
    kind = f"Axon ABF{abf.abfVersion['major']} record"
    yield kind + (f" of {abf.abfDateTime:%Y-%m-%d %H:%M:%S}" if dated else "")
    protocol, comment = PureWindowsPath(abf.protocolPath).stem.replace("None", ""), str(abf.abfFileComment)
    times_s, texts = abf.tagTimesSec, abf.tagComments
    if header is not None:
        late = not _is_short(header)
        protocol = PureWindowsPath(_text(data, *_PROTOCOL)).stem if late else ""
        comment = (_text(data, *_COMMENT) if late else "") or _text(data, *_OLD_COMMENT)
        # Where no unit of time is told, tags count the samples of all channels; pyabf divides by the channels.
        times_s = [1e-6 * (header.fSynchTimeUnit or header.fADCSampleInterval) * time for time in header.lTagTime]
    for what, text in (("protocol ", protocol), ("comment ", comment)):
        text = " ".join(text.split())
        if text and text.isprintable():
            yield f"{what}'{text}'"
    told = ", ".join(f"'{_plain(text)}' at {time_s:.6g} s" for text, time_s in zip(texts, times_s, strict=True))
    if told:
        yield f"tags of the file: {told}"


def _plain(text: Any) -> str:
    return " ".join("".join(sign for sign in str(text) if sign.isprintable()).split())
