"""MATLAB 7.3 files: HDF5, with MATLAB's own marks of what each data set is.

Arrays have their axes reversed. ``MATLAB_class`` names the class; ``MATLAB_empty`` marks a data set that holds the
shape of an empty array; cell arrays, and fields of struct arrays (without a class), are references to other objects.
"""

from __future__ import annotations

import contextlib
import itertools
import math
import zlib
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.readers.mat_nodes import SPARSE, Node, Objects, Opaque, Struct, numbers, opaque, texts
from xb_muscle_ros.trials.readers.mat_strings import object_number, text_of

SIGNATURE = b"\x89HDF\r\n\x1a\n"
# Deflate packs a thousand bytes of zeros into one; a data set larger than that is a damaged one.
_MOST_PACKED = 1100
_OCTAVE = "OCTAVE_NEW_FORMAT"
_MCOS = "#subsystem#/MCOS"


def read_hdf5(path: Path, wanted: Collection[str] | None) -> Struct:
    """Variables of a file by name; those wanted alone, None for all.

    Raises:
        UserError: h5py is missing, or Octave wrote the file in its own layout.
        Exception: whatever HDF5 trips over in a damaged file.
    """
    with _opened(path) as file:
        reading = _Reading(file, path.stat().st_size)
        return {name: reading.node(file[name]) for name in _names(file) if wanted is None or name in wanted}


def names_hdf5(path: Path) -> list[str]:
    """Names of the variables; raises as `read_hdf5`."""
    with _opened(path) as file:
        return _names(file)


@contextlib.contextmanager
def _opened(path: Path) -> Iterator[Any]:
    try:
        import h5py
    except ImportError as problem:
        raise UserError(
            f"{path} is a MATLAB 7.3 file, which needs h5py ({problem}); type: pip install 'xb_muscle_ros[files]', or "
            "save it in MATLAB with '-v7'"
        ) from problem
    with h5py.File(path, "r") as file:
        if any(_OCTAVE in item.attrs for item in file.values()):
            raise UserError(f"{path} is of Octave's own HDF5 layout; allowed are MATLAB's; save it with save -v7")
        yield file


def _names(file: Any) -> list[str]:
    return [name for name in _keys(file) if not name.startswith("#")]


def _keys(group: Any) -> list[str]:
    names = list(group)
    if not all(isinstance(name, str) for name in names):  # HDF5 gives bytes for what is no UTF-8
        raise ValueError(f"names in {group.name} are no text")
    return names


class _Reading:
    """One open file."""

    def __init__(self, file: Any, size: int) -> None:
        import h5py

        self._file, self._most = file, size * _MOST_PACKED
        self._group, self._reference = h5py.Group, h5py.Reference

    def node(self, item: Any) -> Node:
        """What a group or a data set stands for."""
        kind = _kind(item)
        if "MATLAB_sparse" in item.attrs:
            return SPARSE
        if "MATLAB_object_decode" in item.attrs and kind != "function_handle":
            return self._object(item, kind)
        if isinstance(item, self._group):
            return opaque(kind) if kind == "function_handle" else self._struct(item)
        if kind == "function_handle":
            return opaque(kind)
        if "MATLAB_empty" in item.attrs:
            return _empty(kind, self._values(item))
        if item.dtype == object and self._is_references(item):
            return self._followed(item)
        if kind == "char":
            return _chars(self._values(item))
        if item.dtype.kind in "OSU":
            return opaque("text of HDF5")
        if item.dtype.names == ("real", "imag"):
            return numbers(np.zeros(1, dtype=complex))
        return numbers(self._values(item).T)

    def _object(self, item: Any, kind: str) -> Node:
        if kind == "string":
            number = object_number(self._values(item))
            found = None if number is None or _MCOS not in self._file else self._string(number)
            if found is not None:
                return found
        return opaque(kind or "unknown")

    def _string(self, number: int) -> str | Objects | None:
        cells = self._values(self._file[_MCOS]).ravel()
        links = self._values(self._file[cells[0]]).ravel()
        return text_of(number, links, lambda i: self._values(self._file[cells[i]]).T)

    def _struct(self, group: Any) -> Struct | Objects | Opaque:
        """A struct, or an array of them: each field is then an array of references that has no class."""
        fields = {name: group[name] for name in _keys(group)}
        arrays = [item for item in fields.values() if self._is_of_array(item)]
        if not arrays or len(arrays) != len(fields):
            return {name: self.node(item) for name, item in fields.items()}
        shape = arrays[0].shape[::-1]
        if any(item.shape[::-1] != shape for item in arrays):
            raise ValueError(f"fields of {group.name} differ in shape")
        columns = {name: self._followed(item).ravel(order="F") for name, item in fields.items()}
        made = np.empty(math.prod(shape), dtype=object)
        for i in range(made.size):
            made[i] = {name: column[i] for name, column in columns.items()}
        return made.reshape(shape, order="F")

    def _is_of_array(self, item: Any) -> bool:
        return not isinstance(item, self._group) and not _kind(item) and self._is_references(item)

    def _is_references(self, item: Any) -> bool:
        import h5py

        return h5py.check_ref_dtype(item.dtype) is self._reference

    def _followed(self, item: Any) -> Objects:
        references = self._values(item)
        made = np.empty(references.size, dtype=object)
        for i, reference in enumerate(references.ravel()):
            made[i] = self.node(self._file[reference])
        return made.reshape(references.shape).T

    def _values(self, item: Any) -> np.ndarray[Any, Any]:
        if item.size * item.dtype.itemsize > self._most:
            raise ValueError(f"{item.name} claims {item.size} numbers, more than the file can hold")
        if not _is_usual(item):
            raise ValueError(f"{item.name} has numbers of an unknown type")
        values = np.asarray(item[()])
        if not _is_whole(item, values):
            raise ValueError(f"parts of {item.name} are not there")
        return values


def _is_whole(item: Any, values: np.ndarray[Any, Any]) -> bool:
    """Whether all of a data set is in the file: HDF5 gives zeros, without a word, for parts it does not find.

    Where a part is nothing but zeros, its bytes are looked at: a damaged index may hide them from HDF5.
    """
    if item.chunks is None:
        return bool(item.id.get_storage_size() == item.size * item.id.get_type().get_size())
    for begin in itertools.product(*(range(0, n, step) for n, step in zip(item.shape, item.chunks, strict=True))):
        if item.id.get_chunk_info_by_coord(begin).byte_offset is None:
            return False
        part = tuple(slice(at, at + step) for at, step in zip(begin, item.chunks, strict=True))
        if values.dtype.kind in "fiu" and not values[part].any():
            stored = item.id.read_direct_chunk(begin)[1]
            if any(zlib.decompress(stored) if item.compression == "gzip" else stored):
                return False
    return True


def _is_usual(item: Any) -> bool:
    """Whether numbers are of a usual type: HDF5 converts any, and takes a damaged description of one for another."""
    import h5py

    return item.dtype.kind not in "fiu" or bool(h5py.h5t.py_create(item.dtype).equal(item.id.get_type()))


def _kind(item: Any) -> str:
    kind = item.attrs.get("MATLAB_class", b"")
    return kind.decode() if isinstance(kind, bytes) else str(kind)


def _empty(kind: str, shape: np.ndarray[Any, Any]) -> Node:
    if kind == "char":
        return ""
    dtype = object if kind in ("cell", "struct") else np.float64
    axes = tuple(int(n) for n in shape.ravel())
    # The other axes of an empty array have no use, and may be of any length.
    return np.empty(axes if 0 in axes and len(axes) <= 8 else (0, 0), dtype=dtype)


def _chars(codes: np.ndarray[Any, Any]) -> str | Objects:
    """Rows of characters; each is a unit of UTF-16."""
    rows = np.atleast_2d(codes.T) if codes.ndim < 3 else codes.T.reshape(codes.shape[-1], -1)
    return texts([np.asarray(row, dtype="<u2").tobytes().decode("utf-16-le", "replace") for row in rows])
