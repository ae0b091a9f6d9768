"""What a JointState says, and where it says it when serialized.

Source of the layout: plain CDR, OMG DDS-XTypes 1.3, 7.4.3; here little-endian, which is what middleware sends on all
common machines.
"""

from __future__ import annotations

import struct
from typing import Any, NamedTuple

import numpy as np

from xb_muscle_ros.node.rules import stamp_ns
from xb_muscle_ros.node.stepping import Floats

FIELDS = ("position", "velocity", "effort")

# Representation identifier of plain CDR in little-endian order; two bytes of options follow.
_LITTLE = b"\x00\x01"
# Offsets count from the end of representation and options.
_ORIGIN = 4
_COUNT = struct.Struct("<I")
_STAMP = struct.Struct("<iI")
_STAMP_AT = slice(_ORIGIN, _ORIGIN + _STAMP.size)
_DOUBLE = np.dtype("<f8")
_NONE: Floats = np.empty(0)
_NONE.setflags(write=False)
_SECOND_NS = 1_000_000_000


class Joints(NamedTuple):
    """What a JointState says; arrays are the reader's own.

    Attributes:
        stamp_ns: of the header, ns.
        names: the same object as long as they do not change.
        position, velocity, effort: shape (names,), or empty.
    """

    stamp_ns: int
    names: tuple[str, ...]
    position: Floats
    velocity: Floats
    effort: Floats

    @classmethod
    def of(cls, message: Any) -> Joints:
        """What a message says."""
        fields = (np.array(getattr(message, field), dtype=np.float64) for field in FIELDS)
        return cls(stamp_ns(message.header.stamp), tuple(message.name), *fields)


class Numbers(NamedTuple):
    """Where a field's numbers are: from which byte on, and how many."""

    begin: int
    size: int

    def of(self, data: Any) -> Floats:
        """They themselves, in the data's own memory; they need not be aligned there."""
        return np.frombuffer(data, _DOUBLE, self.size, self.begin)

    def copied(self, data: bytes) -> Floats:
        """A copy of them, aligned."""
        return np.frombuffer(data, _DOUBLE, self.size, self.begin).copy() if self.size else _NONE


class Layout(NamedTuple):
    """Where things are in a message; equal for all messages that differ in stamp and numbers only.

    Attributes:
        size: of the message, bytes.
        fixed: all that a reader looks at on its way, but for stamp and numbers: first and last byte of each piece.
        names: as they stand there.
        position, velocity, effort: numbers.
    """

    size: int
    fixed: tuple[tuple[int, int], ...]
    names: tuple[str, ...]
    position: Numbers
    velocity: Numbers
    effort: Numbers

    @classmethod
    def of(cls, data: bytes) -> Layout | None:
        """Layout of a message; None where it is not laid out so, or not whole."""
        if data[:2] != _LITTLE:
            return None
        try:
            return cls._walked(data)
        except (struct.error, UnicodeDecodeError):
            return None

    @classmethod
    def _walked(cls, data: bytes) -> Layout | None:
        fixed = [(0, _ORIGIN)]
        at = _STAMP_AT.stop

        def count() -> int:
            nonlocal at
            at += -(at - _ORIGIN) % _COUNT.size
            (value,) = _COUNT.unpack_from(data, at)
            fixed.append((at, at + _COUNT.size))
            at += _COUNT.size
            return int(value)

        def text() -> str:
            nonlocal at
            size = count()
            piece = data[at : at + size]
            fixed.append((at, at + size))
            at += size
            # The zero at its end counts.
            return piece[:-1].decode()

        def numbers() -> Numbers:
            nonlocal at
            many = count()
            if not many:
                return Numbers(at, 0)
            at += -(at - _ORIGIN) % 8
            found = Numbers(at, many)
            at += 8 * many
            return found

        text()
        many = count()
        # A count that cannot be meant would take as long to follow as it says.
        if many > len(data):
            return None
        names = tuple(text() for _ in range(many))
        fields = numbers(), numbers(), numbers()
        # What comes after its end is nobody's.
        return cls(len(data), tuple(fixed), names, *fields) if at <= len(data) else None

    def stamp_ns(self, data: bytes) -> int:
        """Time in the header, ns."""
        seconds, ns = _STAMP.unpack_from(data, _ORIGIN)
        return int(seconds) * _SECOND_NS + int(ns)

    def set_stamp(self, data: Any, stamp_ns: int) -> None:
        """Put a time in ns into the header."""
        _STAMP.pack_into(data, _ORIGIN, *divmod(stamp_ns, _SECOND_NS))


class Alike:
    """Tells messages of a layout from others."""

    def __init__(self, layout: Layout, data: bytes) -> None:
        """Know a message of that layout."""
        mask = np.zeros(layout.size, dtype=np.uint8)
        for begin, end in layout.fixed:
            mask[begin:end] = 0xFF
        self._size = layout.size
        self._mask = mask
        self._known = np.frombuffer(data, np.uint8) & mask
        # Between the numbers: from each byte on until another. What lies there is mostly equal, padding as well.
        fields = [numbers for numbers in (layout.position, layout.velocity, layout.effort) if numbers.size]
        ends = [numbers.begin for numbers in fields]
        begins = [_STAMP_AT.stop, *(numbers.begin + 8 * numbers.size for numbers in fields)]
        pieces = [(0, _ORIGIN), *zip(begins, [*ends, layout.size], strict=True)]
        self._pieces = [(begin, end) for begin, end in pieces if begin < end]
        self._seen = [data[begin:end] for begin, end in self._pieces]

    def __call__(self, data: bytes) -> bool:
        """Whether a message has the layout, and its names; padding may hold anything."""
        if len(data) != self._size:
            return False
        for (begin, end), seen in zip(self._pieces, self._seen, strict=True):
            if data[begin:end] != seen:
                break
        else:
            return True
        if not np.array_equal(np.frombuffer(data, np.uint8) & self._mask, self._known):
            return False
        self._seen = [data[begin:end] for begin, end in self._pieces]
        return True
