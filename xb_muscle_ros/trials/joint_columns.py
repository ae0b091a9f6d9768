"""Stamps and numbers of many JointState messages at once.

Messages that differ in stamp and numbers alone are read as columns, where a library's own reader has confirmed the
layout of one of them. Whatever else a topic has (another byte order, names that keep changing, values that are
missing) is for who reads message by message.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple, cast

import numpy as np
import numpy.typing as npt
from rosbags.serde import SerdeError

from xb_muscle_ros.trials import ros_types
from xb_muscle_ros.trials.joint_layout import DOUBLE, FIELDS, ORIGIN, Layout
from xb_muscle_ros.trials.messages import LOG_BYTES, Block, Bytes, Ints, Messages, slots
from xb_muscle_ros.trials.ros_types import JointState
from xb_muscle_ros.trials.stamps import Stamps
from xb_muscle_ros.trials.trial import Array

# More kinds of messages than this within a block are read one by one.
_MOST_KINDS = 8
_SECOND_NS = 1_000_000_000

Pick = Callable[[Sequence[str]], Sequence[tuple[str, int]] | None]
"""Which numbers of a message with these names are wanted, each by field and place; None for none of them.

It refuses names by a ValueError.
"""


class UnusualError(Exception):
    """A message that is not read as a column."""


class Picked(NamedTuple):
    """What was taken, in the order of log time or of the files.

    Attributes:
        stamps_ns: shape (n,), of the headers.
        values: shape (n, numbers).
        places: which of the topic's messages each is, from 0.
    """

    stamps_ns: Stamps
    values: Array
    places: range | Ints


def picked(messages: Messages, pick: Pick, width: int, as_filed: bool = False) -> Picked:
    """Stamps and the numbers that are wanted, of the messages that have them.

    Args:
        messages: JointState in CDR.
        pick: which numbers; ``width`` of them.
        width: how many.
        as_filed: in the order of the files, and not of log time.

    Raises:
        UnusualError: see above.
    """
    count = len(messages)
    stamps = np.empty(count, dtype=np.int64)
    values = np.empty((count, width))
    kept: npt.NDArray[np.bool_] | None = None
    for kind in _kinds(messages):
        try:
            wanted = pick(kind.layout.names)
        except ValueError as problem:
            raise UnusualError from problem
        at = slots(kind.places)
        if wanted is None:
            kept = np.ones(count, dtype=np.bool_) if kept is None else kept
            kept[at] = False
            continue
        stamps[at] = kind.stamps()
        for column, (field, place) in enumerate(wanted):
            values[at, column] = kind.numbers(field, place)
    places: range | Ints = range(count)
    order = None if as_filed else messages.order
    if order is not None:
        stamps, values = stamps[order], values[order]
        kept = None if kept is None else kept[order]
    if kept is not None:
        places = np.flatnonzero(kept)
        stamps, values = stamps[places], values[places]
    for array in (stamps, values):
        array.setflags(write=False)
    return Picked(stamps, values, places)


def names_of(messages: Messages) -> list[str]:
    """Every name, in the order in which messages come by log time.

    Raises:
        UnusualError: see above; also a message without names.
    """
    order = messages.order
    rank = None if order is None else np.argsort(order)
    first: dict[tuple[str, ...], int] = {}
    for kind in _kinds(messages):
        names = kind.layout.names
        if not names:
            raise UnusualError
        begin = int(kind.places[0]) if rank is None else int(rank[slots(kind.places)].min())
        first[names] = min(begin, first.get(names, begin))
    return list(dict.fromkeys(name for names in sorted(first, key=first.__getitem__) for name in names))


class _Kind(NamedTuple):
    """Messages of one layout: which of the topic's they are, and their bytes, shape (messages, size)."""

    layout: Layout
    places: range | Ints
    data: Bytes

    def stamps(self) -> Stamps:
        """Times in the headers, ns."""
        seconds: Stamps = _column(self.data, ORIGIN, np.dtype("<i4")).astype(np.int64)
        ns: Stamps = _column(self.data, ORIGIN + 4, np.dtype("<u4")).astype(np.int64)
        return seconds * _SECOND_NS + ns

    def numbers(self, field: str, place: int) -> Array:
        """The number of a field at a place, of every message.

        Raises:
            UnusualError: the field has fewer.
        """
        numbers = getattr(self.layout, field)
        if place >= numbers.size:
            raise UnusualError
        values: Array = _column(self.data, numbers.begin + DOUBLE.itemsize * place, DOUBLE)
        return values


def _column(data: Bytes, begin: int, kind: np.dtype[Any]) -> npt.NDArray[Any]:
    """Numbers that begin at a byte of every row; aligned."""
    return np.ascontiguousarray(data[:, begin : begin + kind.itemsize]).view(kind)[:, 0]


def _kinds(messages: Messages) -> Iterator[_Kind]:
    """Messages by their layouts."""
    known: dict[bytes, Layout] = {}
    for block in messages.blocks():
        data = block.rows()[:, LOG_BYTES:]
        places, found = block.places, 0
        while len(places):
            found += 1
            if found > _MOST_KINDS:
                raise UnusualError
            layout = _layout(data[0].tobytes(), known)
            alike = _alike(layout, data, block)
            if alike is None:
                yield _Kind(layout, places, data)
                break
            which = np.array(places, dtype=np.int64) if isinstance(places, range) else places
            yield _Kind(layout, which[alike], data[alike])
            places, data = which[~alike], data[~alike]


def _alike(layout: Layout, data: Bytes, block: Block) -> npt.NDArray[np.bool_] | None:
    """Which rows have the layout of the first; None for all."""
    fixed = np.zeros(LOG_BYTES + layout.size, dtype=np.bool_)
    for begin, end in layout.fixed:
        fixed[LOG_BYTES + begin : LOG_BYTES + end] = True
    columns = block.varying[fixed[block.varying]] - LOG_BYTES
    if not columns.size:
        return None
    alike: npt.NDArray[np.bool_] = (data[:, columns] == data[0, columns]).all(axis=1)
    return None if alike.all() else alike


def _layout(message: bytes, known: dict[bytes, Layout]) -> Layout:
    """Layout of a message that the library reads in the same way.

    Args:
        known: layouts that were confirmed, by all that is fixed; added to.

    Raises:
        UnusualError: there is none.
    """
    layout = Layout.of(message)
    if layout is None:
        raise UnusualError
    key = struct.pack("<Q", layout.size) + b"".join(message[begin:end] for begin, end in layout.fixed)
    if key not in known:
        if not _confirmed(layout, message):
            raise UnusualError
        known[key] = layout
    return known[key]


def _confirmed(layout: Layout, message: bytes) -> bool:
    """Whether the library finds stamp, names and numbers where the layout has them; numbers are all different ones."""
    probe, stamp_ns = bytearray(message), 123_456_789_012
    layout.set_stamp(probe, stamp_ns)
    expected, begin = [], 1.0
    for field in FIELDS:
        numbers = getattr(layout, field)
        expected.append(np.arange(begin, begin + numbers.size))
        probe[numbers.begin : numbers.begin + DOUBLE.itemsize * numbers.size] = expected[-1].astype(DOUBLE).tobytes()
        begin += numbers.size
    try:
        whole = layout.trimmed(bytes(probe))
        read = cast(JointState, ros_types.typestore().deserialize_cdr(whole, ros_types.JOINT_STATE))
    except SerdeError:
        return False
    stamp = read.header.stamp
    same = all(np.array_equal(getattr(read, field), of) for field, of in zip(FIELDS, expected, strict=True))
    return same and tuple(read.name) == layout.names and stamp.sec * _SECOND_NS + stamp.nanosec == stamp_ns
