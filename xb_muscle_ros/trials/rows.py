"""Records of one size within a buffer, seen as the rows of a matrix."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Bytes = npt.NDArray[np.uint8]
Ints = npt.NDArray[np.int64]


def evenly(starts: Ints) -> int | None:
    """Bytes from each record to the next; None where these differ."""
    if starts.size < 2:
        return 1
    stride = int(starts[1] - starts[0])
    return stride if bool(np.all(np.diff(starts) == stride)) else None


def rows_of(buffer: Bytes, starts: Ints, size: int) -> Bytes:
    """The records, shape (records, size): a view where they lie evenly, else a copy.

    Args:
        buffer: shape (bytes,); holds every record whole.
        starts: first byte of each, ascending.
        size: of each, bytes.
    """
    stride = evenly(starts)
    if stride is None or not starts.size:
        return buffer[starts[:, np.newaxis] + np.arange(size)]
    begin = buffer[int(starts[0]) :]
    return np.lib.stride_tricks.as_strided(begin, (starts.size, size), (stride, 1))


def put_rows(buffer: Bytes, starts: Ints, rows: Bytes) -> None:
    """Write records to their places, which do not overlap."""
    size = rows.shape[1]
    if evenly(starts) is None:
        buffer[starts[:, np.newaxis] + np.arange(size)] = rows
    elif starts.size:
        rows_of(buffer, starts, size)[:] = rows
