"""What a JointState says, and how alike messages are told from others."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from xb_muscle_ros.node.rules import stamp_ns
from xb_muscle_ros.node.stepping import Floats
from xb_muscle_ros.trials.joint_layout import FIELDS, ORIGIN, STAMP_AT, Layout


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
        begins = [STAMP_AT.stop, *(numbers.begin + 8 * numbers.size for numbers in fields)]
        pieces = [(0, ORIGIN), *zip(begins, [*ends, layout.size], strict=True)]
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
