"""Large arrays and texts in a temporary file, which the system writes out where memory is short.

What a model answers to an hour at 1 kHz is 250 MB. It is made and looked at from begin to end, so that most of it need
not be in memory at any time.
"""

from __future__ import annotations

import itertools
import mmap
import os
import tempfile
from collections.abc import Iterable, Iterator
from typing import IO, Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

# Arrays of fewer numbers stay in memory.
LEAST = 1 << 20


class Spool(mmap.mmap):
    """The file, which has no name, of one array or text."""


def roomy(size: int) -> Array:
    """An array of zeros of shape (size,), in a file where it is large and there is one to be had."""
    if size < LEAST:
        return np.zeros(size)
    try:
        with tempfile.TemporaryFile() as file:
            # Taken from the disk now: to run out of it later would end the process.
            os.posix_fallocate(file.fileno(), 0, 8 * size)
            return np.ndarray((size,), dtype=np.float64, buffer=Spool(file.fileno(), 8 * size))
    except (OSError, AttributeError):
        return np.zeros(size)


def spooled(blocks: Iterable[bytes]) -> bytes | Spool:
    """Bytes put behind each other, in a file where they are many and there is room for one, else in memory."""
    held, more = [b""], iter(blocks)
    while sum(map(len, held)) < 8 * LEAST:
        block = next(more, None)
        if block is None:
            return b"".join(held)
        held.append(block)
    try:
        file = tempfile.TemporaryFile(buffering=0)  # noqa: SIM115  # errors of the source are not those of this file
    except OSError:
        return b"".join(itertools.chain(held, more))
    rest = itertools.chain(held, more)
    with file:
        for block in rest:
            if not _written(file, block):
                file.seek(0)
                return b"".join([file.read(), block, *rest])
        return _mapped(file)


def _written(file: IO[bytes], block: bytes) -> bool:
    """Whether a block could be written; if not, the file ends where it did."""
    end = file.tell()
    try:
        done = 0
        while done < len(block):
            done += file.write(block[done:])
    except OSError:
        file.truncate(end)
        return False
    return True


def _mapped(file: IO[bytes]) -> bytes | Spool:
    try:
        return Spool(file.fileno(), file.tell(), access=mmap.ACCESS_READ)
    except OSError:
        file.seek(0)
        return file.read()


def release(*arrays: Array | bytes | Spool) -> None:
    """Let go of the memory of what is in such files: arrays or parts of arrays, with all they are a part of, and texts.

    They keep what they hold and are read again where needed.
    """
    for array in arrays:
        spool = list(_bases(array))[-1]
        if isinstance(spool, Spool) and hasattr(mmap, "MADV_DONTNEED"):
            spool.madvise(mmap.MADV_DONTNEED)


def settle(array: Array) -> Array:
    """The array, which nobody can change from now on, nor what it is a part of, but by parts that were taken before."""
    for each in _bases(array):
        if isinstance(each, np.ndarray):
            each.setflags(write=False)
    return array


def is_settled(array: npt.ArrayLike) -> bool:
    """Whether nobody can change an array: it is read-only, and so is every array whose memory it shares."""
    *arrays, last = _bases(array)
    if any(each.flags.writeable for each in arrays):
        return False
    return not last.flags.writeable if isinstance(last, np.ndarray) else isinstance(last, Spool)


def _bases(array: object) -> Iterator[Any]:
    """An array, what it is a part of, and so on."""
    yield array
    while isinstance(array, np.ndarray) and array.base is not None:
        array = array.base
        yield array
