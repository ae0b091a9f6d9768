"""Variables of a MATLAB file of any version, as they are in MATLAB; see `mat_nodes` for what they become."""

from __future__ import annotations

import contextlib
import io
import warnings
from collections.abc import Collection, Iterator
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.readers.base import begin_of
from xb_muscle_ros.trials.readers.mat_hdf5 import SIGNATURE, names_hdf5, read_hdf5
from xb_muscle_ros.trials.readers.mat_nodes import SPARSE, Node, Objects, Struct, numbers, opaque, texts
from xb_muscle_ros.trials.readers.mat_strings import object_number, text_of

MAT5, MAT73 = b"MATLAB 5.0 MAT-file", b"MATLAB 7.3 MAT-file"
_OCTAVE_TEXT = b"# Created by Octave"
# SciPy's name for objects in the root, which have theirs inside, and for where their content is.
_UNNAMED, _WORKSPACE = "None", "__function_workspace__"
_HEADER_BYTES = 128


def load(path: Path, names: Collection[str] | None = None) -> Struct:
    """Variables by name; those named alone, as far as the file has them, or all.

    Raises:
        UserError: the file cannot be read, or is damaged; or it is of version 7.3 and h5py is missing.
    """
    try:
        status = path.stat()
    except OSError as problem:
        raise UserError(f"{path} cannot be read: {problem.strerror}; give a MATLAB file") from problem
    wanted = None if names is None else tuple(sorted(set(names)))
    return _loaded(path, wanted, status.st_size, status.st_mtime_ns)


def names_of(path: Path) -> list[str]:
    """Names of a file's variables, which takes little time unless some are objects.

    Raises:
        UserError: as `load`.
    """
    from scipy.io import whosmat

    with _told(path):
        if _is_hdf5(begin_of(path)):
            return names_hdf5(path)
        try:
            return [name for name, *_ in whosmat(path)]
        except TypeError:  # SciPy trips over objects
            return list(load(path))


@lru_cache(maxsize=1)
def _loaded(path: Path, names: tuple[str, ...] | None, _size: int, _mtime_ns: int) -> Struct:
    """The last file is kept: what it holds and its trials are asked for one after the other."""
    with _told(path):
        return read_hdf5(path, names) if _is_hdf5(begin_of(path)) else _read_mat5(path, names)


def _is_hdf5(begin: bytes) -> bool:
    return begin.startswith(MAT73) or SIGNATURE in (begin[:8], begin[512:520])


@contextlib.contextmanager
def _told(path: Path) -> Iterator[None]:
    """Tell in one line what is wrong with a file."""
    if begin_of(path).startswith(_OCTAVE_TEXT):
        raise UserError(f"{path} is text of Octave; allowed are MATLAB files; save it with save('-v7', ...)")
    try:
        yield
    except UserError:
        raise
    except Exception as problem:  # SciPy and HDF5 pass on whatever their parsers trip over
        raise UserError(f"{path} is no whole MATLAB file ({problem}); copy it again") from problem


def _read_mat5(path: Path, names: tuple[str, ...] | None) -> Struct:
    wanted = None if names is None else [*names, _UNNAMED, _WORKSPACE]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # several objects of one name: they are distinguished below
        content = _loadmat(path, wanted)
    reading = _Reading(content.pop(_WORKSPACE, None))
    found = {name: reading.node(value) for name, value in content.items() if not name.startswith("__")}
    if found.pop(_UNNAMED, None) is not None:
        found |= {name: node for name, node in _objects(path, reading).items() if names is None or name in names}
    return found


def _objects(path: Path, reading: _Reading) -> Struct:
    """Objects in the root of a file by name, which SciPy before 1.18 does not tell."""
    from scipy.io.matlab import varmats_from_mat

    with path.open("rb") as file:
        parts = [part for name, part in varmats_from_mat(file) if name == _UNNAMED]
    found = {}
    for part in parts:
        value = _loadmat(part)[_UNNAMED]
        found[_text(value[0]["s0"])] = reading.node(value)
    return found


class _Reading:
    """What SciPy makes of a file, as nodes; strings are looked up in the file's workspace, if it has one."""

    def __init__(self, workspace: npt.NDArray[Any] | None) -> None:
        self._cells = None if workspace is None else _cells(workspace)

    def node(self, value: Any) -> Node:
        from scipy.io.matlab import MatlabFunction, MatlabObject, MatlabOpaque
        from scipy.sparse import issparse

        if value is None:  # a struct without fields
            return {}
        if issparse(value):
            return SPARSE
        if isinstance(value, MatlabOpaque):
            return self._object(value)
        if isinstance(value, MatlabFunction):
            return opaque("function_handle")
        if isinstance(value, MatlabObject):
            return opaque(str(value.classname))
        array = np.asarray(value)
        if array.dtype.names is not None:
            return self._structs(array)
        if array.dtype == object:
            return self._each(array, self.node)
        if array.dtype.kind in "US":
            return texts([str(row) for row in array.ravel()])
        return numbers(array)

    def _structs(self, array: npt.NDArray[Any]) -> Node:
        def struct(record: Any) -> Struct:
            return {name: self.node(record[name]) for name in array.dtype.names or ()}

        return struct(array.ravel()[0]) if array.size == 1 else self._each(array, struct)

    def _each(self, array: npt.NDArray[Any], convert: Any) -> Objects:
        made = np.empty(array.shape, dtype=object)
        for index in np.ndindex(array.shape):
            made[index] = convert(array[index])
        return made

    def _object(self, value: Any) -> Node:
        record = value.ravel()[0]
        old = "s2" in (value.dtype.names or ())  # names of SciPy before 1.18
        kind = _text(record["s2" if old else "_Class"])
        if kind == "string" and self._cells is not None:
            number = object_number(np.asarray(record["arr" if old else "_ObjectMetadata"]))
            cells = self._cells
            found = None if number is None else text_of(number, cells[0], lambda i: np.asarray(cells[i]))
            if found is not None:
                return found
        return opaque(kind)


def _cells(workspace: npt.NDArray[Any]) -> list[npt.NDArray[Any]] | None:
    """Links and contents of the objects: the workspace is a MATLAB file in the file, without most of the header."""
    data = np.asarray(workspace, dtype=np.uint8).tobytes()
    try:
        # One element after another, without names: the first is that of the objects.
        first = data[8 : 16 + int.from_bytes(data[12:16], "little" if data[2:4] == b"IM" else "big")]
        struct = _loadmat(io.BytesIO(MAT5.ljust(_HEADER_BYTES - 4) + data[:4] + first))[_WORKSPACE]
        wrapper = struct.ravel()[0]["MCOS"].ravel()[0]
        cells = wrapper["arr" if "arr" in wrapper.dtype.names else "_ObjectMetadata"]
        return [np.asarray(cell) for cell in np.asarray(cells).ravel(order="F")]
    except Exception:  # of another layout: strings stay objects, and are told when they are asked for
        return None


def _loadmat(source: Any, names: list[str] | None = None) -> dict[str, Any]:
    """Variables of a file, or of one in memory, as SciPy has them."""
    from scipy.io import loadmat

    return dict(loadmat(source, variable_names=names, chars_as_strings=True))


def _text(value: Any) -> str:
    return value.decode("latin-1") if isinstance(value, bytes) else str(value)
