"""Messages of a topic, kept small: of messages of one size, the bytes that differ, and the others once.

An hour at 1 kHz has millions of messages; as Python objects they would take ten times their bytes.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

Bytes = npt.NDArray[np.uint8]
Ints = npt.NDArray[np.int64]
LogTimes = npt.NDArray[np.uint64]

# A log time comes before the bytes of each row.
LOG_BYTES = 8
# Single messages are put into blocks of so many, or of so many bytes.
_WAITING, _WAITING_BYTES = 8192, 1 << 20
# The system's allocator gives arrays of this size memory of their own.
_SLAB_BYTES = 1 << 26


class Message(NamedTuple):
    """One message: where it was published, when it was logged (ns), and its bytes."""

    topic: str
    log_time_ns: int
    data: bytes


class _Slabs:
    """Places for many small arrays that live and go together.

    They go back to the system at once; of single ones between other arrays the heap would keep what they leave.
    """

    def __init__(self) -> None:
        self._slab: Bytes = np.empty(0, dtype=np.uint8)
        self._used = 0

    def kept(self, values: Bytes) -> Bytes:
        """A copy of values."""
        if self._used + values.size > self._slab.size:
            # What is not used is not there: memory is given page by page.
            self._slab, self._used = np.empty(max(values.size, _SLAB_BYTES), dtype=np.uint8), 0
        copy = self._slab[self._used : self._used + values.size].reshape(values.shape)
        copy[:] = values
        self._used += values.size
        return copy


class Block(NamedTuple):
    """Messages of one size out of a batch of consecutive ones.

    Attributes:
        places: which of the topic's messages each is, from 0, in the order of the files; ascending.
        varying: columns of a row in which they differ.
        common: the first row: log time in ns (little-endian), then the message's bytes.
        values: shape (messages, varying).
    """

    places: range | Ints
    varying: npt.NDArray[np.intp]
    common: Bytes
    values: Bytes

    @classmethod
    def of(cls, places: range | Ints, rows: Bytes, slabs: _Slabs) -> Block:
        """Messages given as rows of log time and bytes, shape (messages, 8 + size)."""
        varying = np.flatnonzero((rows != rows[0]).any(axis=0))
        return cls(places, varying, rows[0].copy(), slabs.kept(rows[:, varying]))

    def rows(self) -> Bytes:
        """As they were given."""
        rows = np.repeat(self.common[np.newaxis], len(self.places), axis=0)
        rows[:, self.varying] = self.values
        return rows

    def log_times(self) -> LogTimes:
        """When each was logged, ns."""
        rows = np.repeat(self.common[np.newaxis, :LOG_BYTES], len(self.places), axis=0)
        here = np.flatnonzero(self.varying < LOG_BYTES)
        rows[:, self.varying[here]] = self.values[:, here]
        times: LogTimes = rows.view("<u8")[:, 0].astype(np.uint64)
        return times


class Messages:
    """The messages of a topic in the order of the files, and sorted by log time.

    Iterating gives them in the order of log time; messages of one log time keep the order of the files.
    """

    def __init__(self, topic: str) -> None:
        self.topic = topic
        self._count = 0
        self._slabs = _Slabs()
        self._batches: list[list[Block]] = []
        self._waiting: list[tuple[int, bytes]] = []
        self._waiting_bytes = 0
        self._order: Ints | bool | None = False

    def __len__(self) -> int:
        return self._count

    def add(self, log_time_ns: int, data: bytes) -> None:
        """Put one more at the end."""
        self._waiting.append((log_time_ns, data))
        self._waiting_bytes += len(data)
        self._count += 1
        self._order = False
        if len(self._waiting) >= _WAITING or self._waiting_bytes >= _WAITING_BYTES:
            self._settle()

    def add_batch(self, groups: list[tuple[Ints | None, Bytes]]) -> None:
        """Put messages at the end, by their sizes.

        Args:
            groups: for each size, which of the batch they are (ascending, from 0; None for all), and rows of log time
                and bytes.
        """
        self._settle()
        first = self._count
        batch = []
        for places, rows in groups:
            where = range(first, first + len(rows)) if places is None else places + first
            batch.append(Block.of(where, rows, self._slabs))
            self._count += len(rows)
        self._batches.append(batch)
        self._order = False

    def extend(self, others: Messages) -> None:
        """Put the messages of another file at the end."""
        for batch in others._settled():
            shift = self._count - min(int(block.places[0]) for block in batch)
            self._batches.append([block._replace(places=_shifted(block.places, shift)) for block in batch])
            self._count += sum(len(block.places) for block in batch)
        self._order = False

    def blocks(self) -> Iterator[Block]:
        """All of them; blocks of one batch may lie within each other."""
        for batch in self._settled():
            yield from batch

    def log_times(self) -> LogTimes:
        """When each was logged, ns, in the order of the files."""
        times = np.empty(self._count, dtype=np.uint64)
        for block in self.blocks():
            times[slots(block.places)] = block.log_times()
        return times

    @property
    def order(self) -> Ints | None:
        """Places in the order of log time; None where the files have that order already."""
        if isinstance(self._order, bool):
            times = self.log_times()
            in_order = bool(np.all(times[1:] >= times[:-1]))
            self._order = None if in_order else np.argsort(times, kind="stable").astype(np.int64)
        return self._order

    def __iter__(self) -> Iterator[Message]:
        if self.order is None:
            return self.as_filed()
        filed = list(self.as_filed())
        return (filed[i] for i in self.order.tolist())

    def as_filed(self) -> Iterator[Message]:
        """All of them in the order of the files."""
        for batch in self._settled():
            first = min(int(block.places[0]) for block in batch)
            found: list[Message | None] = [None] * sum(len(block.places) for block in batch)
            for block in batch:
                rows = block.rows()
                for place, log_ns, row in zip(block.places, block.log_times().tolist(), rows, strict=True):
                    found[int(place) - first] = Message(self.topic, log_ns, row[LOG_BYTES:].tobytes())
            yield from (each for each in found if each is not None)

    def _settled(self) -> list[list[Block]]:
        self._settle()
        return self._batches

    def _settle(self) -> None:
        """Make blocks of single messages that wait."""
        if not self._waiting:
            return
        waiting, self._waiting, self._waiting_bytes = self._waiting, [], 0
        first = self._count - len(waiting)
        by_size: dict[int, list[int]] = {}
        for i, (_, data) in enumerate(waiting):
            by_size.setdefault(len(data), []).append(i)
        batch = []
        for size, places in by_size.items():
            rows = np.empty((len(places), LOG_BYTES + size), dtype=np.uint8)
            log_times = np.array([waiting[i][0] for i in places], dtype="<u8")
            rows[:, :LOG_BYTES] = log_times.view(np.uint8).reshape(-1, LOG_BYTES)
            rows[:, LOG_BYTES:] = np.frombuffer(b"".join(waiting[i][1] for i in places), np.uint8).reshape(-1, size)
            alone = len(by_size) == 1
            where = range(first, self._count) if alone else np.array(places) + first
            batch.append(Block.of(where, rows, self._slabs))
        self._batches.append(batch)


def _shifted(places: range | Ints, shift: int) -> range | Ints:
    return range(places.start + shift, places.stop + shift) if isinstance(places, range) else places + shift


def slots(places: Any) -> Any:
    """Places as what indexes an array: a slice where they follow each other."""
    return slice(places.start, places.stop) if isinstance(places, range) else places
