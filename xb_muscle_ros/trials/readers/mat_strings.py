"""Strings of MATLAB ("text" in double quotes): objects, whose content is kept in a part of the file of its own.

The variable holds the number of its object. A cell array called MCOS holds first the links, bytes that lead from the
number of an object to that of its content, and from the third cell on the contents. The content of an array of strings
is 64-bit words: 1, number of axes, axes, length of each text in 16-bit units, and the texts in UTF-16 one after the
other. MATLAB does not document this layout; it is told here as found by the authors of mat-io and MAT.jl.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.trials.readers.mat_nodes import Objects

# First number of what stands for an object.
MARK = 0xDD000000
_FIRST_CONTENT = 2
_MOST_TEXTS = 100_000


def object_number(values: npt.NDArray[Any]) -> int | None:
    """The object that a variable stands for; None where it is of another layout, an array of objects say."""
    words = [int(word) for word in np.asarray(values).ravel()]
    if len(words) < 6 or words[0] != MARK or words[1] != 2 or words[2:4] != [1, 1]:
        return None
    return words[4]


def text_of(number: int, links: npt.NDArray[Any], content: Callable[[int], npt.NDArray[Any]]) -> str | Objects | None:
    """The text, or array of texts, of a string object; None where the layout is another.

    Args:
        number: of the object, from 1.
        links: bytes of the first cell.
        content: gives the values of a cell, counted from 0.
    """
    try:
        index = _content_index(number, np.asarray(links, dtype=np.uint8).tobytes())
        return None if index is None else _decoded(np.asarray(content(index + _FIRST_CONTENT)))
    except (IndexError, KeyError, ValueError, TypeError):
        return None


def _content_index(number: int, links: bytes) -> int | None:
    words = np.frombuffer(links[: len(links) // 4 * 4], dtype="<u4")
    begins = [int(offset) // 4 for offset in words[2:10]]
    identity = words[begins[2] + 6 * number : begins[2] + 6 * number + 6]
    block, at = int(identity[3]), begins[1] + 2  # what stands before the first block is that of object 0
    if not 0 < block <= number:
        return None
    for _ in range(block - 1):
        at += _block_words(int(words[at]))
    if int(words[at]) != 1 or at >= begins[2]:
        return None
    kind, index = int(words[at + 2]), int(words[at + 3])
    return index if kind == 1 else None


def _block_words(properties: int) -> int:
    """Words of a block: the count, three for each property, and one where these are odd, to fill 8 bytes."""
    words = 1 + 3 * properties
    return words + words % 2


def _decoded(values: npt.NDArray[Any]) -> str | Objects | None:
    words = values.ravel(order="F").astype("<u8", copy=False)
    if words.size < 3 or int(words[0]) != 1:
        return None
    axes = int(words[1])
    shape = tuple(int(n) for n in words[2 : 2 + axes])
    count = math.prod(shape)
    if not 2 <= axes <= 8 or not 0 <= count <= min(words.size, _MOST_TEXTS):
        return None
    lengths = [int(n) for n in words[2 + axes : 2 + axes + count]]
    units = words[2 + axes + count :].tobytes()
    if len(lengths) != count or 2 * sum(lengths) > len(units):
        return None
    made, begin = np.empty(count, dtype=object), 0
    for i, length in enumerate(lengths):
        made[i] = units[2 * begin : 2 * (begin + length)].decode("utf-16-le", "replace")
        begin += length
    return str(made[0]) if count == 1 else made.reshape(shape, order="F")
