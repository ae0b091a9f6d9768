"""Large arrays in a temporary file, which the system writes out where memory is short.

What a model answers to an hour at 1 kHz is 250 MB. It is made and looked at from begin to end, so that most of it need
not be in memory at any time.
"""

from __future__ import annotations

import mmap
import os
import tempfile

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

# Arrays of fewer numbers stay in memory.
LEAST = 1 << 20


class Spool(mmap.mmap):
    """The file, which has no name, of one array."""


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


def release(*arrays: Array) -> None:
    """Let go of the memory of arrays made by `roomy`; they keep what they hold and are read again where needed."""
    for array in arrays:
        if isinstance(array.base, Spool) and hasattr(mmap, "MADV_DONTNEED"):
            array.base.madvise(mmap.MADV_DONTNEED)


def is_settled(array: npt.ArrayLike) -> bool:
    """Whether nobody can change an array: it is read-only, and so is every array whose memory it shares."""
    while isinstance(array, np.ndarray):
        if array.flags.writeable:
            return False
        if array.base is None or isinstance(array.base, Spool):
            return True
        array = array.base
    return False
