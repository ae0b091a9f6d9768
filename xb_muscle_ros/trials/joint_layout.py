"""Where a JointState has its stamp, names and numbers when serialized.

Source of the layout: plain CDR, OMG DDS-XTypes 1.3, 7.4.3; here little-endian, which is what middleware sends on all
common machines.
"""

from __future__ import annotations

import struct
from typing import Any, NamedTuple

import numpy as np

from xb_muscle_ros.trials.trial import Array

FIELDS = ("position", "velocity", "effort")

# Representation identifier of plain CDR in little-endian order; two bytes of options follow.
_LITTLE = b"\x00\x01"
# Offsets count from the end of representation and options.
ORIGIN = 4
STAMP = struct.Struct("<iI")
STAMP_AT = slice(ORIGIN, ORIGIN + STAMP.size)
DOUBLE = np.dtype("<f8")
_COUNT = struct.Struct("<I")
_NONE: Array = np.empty(0)
_NONE.setflags(write=False)
_SECOND_NS = 1_000_000_000


class Numbers(NamedTuple):
    """Where a field's numbers are: from which byte on, and how many."""

    begin: int
    size: int

    def of(self, data: Any) -> Array:
        """They themselves, in the data's own memory; they need not be aligned there."""
        return np.frombuffer(data, DOUBLE, self.size, self.begin)

    def copied(self, data: bytes) -> Array:
        """A copy of them, aligned."""
        return np.frombuffer(data, DOUBLE, self.size, self.begin).copy() if self.size else _NONE


class Layout(NamedTuple):
    """Where things are in a message; equal for all messages that differ in stamp and numbers only.

    Attributes:
        size: of the message, bytes.
        fixed: all that a reader looks at on its way, but for stamp and numbers: first and last byte of each piece.
        names: as they stand there.
        position, velocity, effort: numbers.
        end: behind its last byte; what follows up to `size` is nobody's.
    """

    size: int
    fixed: tuple[tuple[int, int], ...]
    names: tuple[str, ...]
    position: Numbers
    velocity: Numbers
    effort: Numbers
    end: int

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
        fixed = [(0, ORIGIN)]
        at = STAMP_AT.stop

        def count() -> int:
            nonlocal at
            at += -(at - ORIGIN) % _COUNT.size
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
            at += -(at - ORIGIN) % 8
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
        return cls(len(data), tuple(fixed), names, *fields, at) if at <= len(data) else None

    def trimmed(self, data: bytes) -> bytes:
        """A message without what follows its end: rclpy's serialization makes more bytes than it fills."""
        return data[: self.end]

    def stamp_ns(self, data: bytes) -> int:
        """Time in the header, ns."""
        seconds, ns = STAMP.unpack_from(data, ORIGIN)
        return int(seconds) * _SECOND_NS + int(ns)

    def set_stamp(self, data: Any, stamp_ns: int) -> None:
        """Put a time in ns into the header."""
        STAMP.pack_into(data, ORIGIN, *divmod(stamp_ns, _SECOND_NS))
