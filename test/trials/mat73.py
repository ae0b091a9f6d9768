"""MATLAB 7.3 files, written as MATLAB lays them out: HDF5 behind 512 bytes, axes reversed, cells as references."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

h5py = pytest.importorskip("h5py")  # of the extra 'files'

HEADER = b"MATLAB 7.3 MAT-file, Platform: GLNXA64, Created on: Mon Nov 30 10:00:00 2026 HDF5 schema 1.00 ."


class Text(str):
    """A string of MATLAB, an object; a plain text is a char array."""

    __slots__ = ()


def save73(path: Path, variables: dict[str, Any]) -> Path:
    """Write variables: arrays, texts, dicts (structs), lists (cells), and records of NumPy (arrays of structs)."""
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, value in variables.items():
            _put(file, file, name, value)
        _put_objects(file)
    with path.open("r+b") as raw:
        raw.write(HEADER.ljust(116) + b"\x00" * 8 + b"\x00\x02IM")
    return path


def _put(file: h5py.File, group: h5py.Group, name: str, value: Any) -> None:
    if isinstance(value, dict):
        made = group.create_group(name)
        _class(made, "struct")
        for key, each in value.items():
            _put(file, made, key, each)
    elif isinstance(value, Text):
        texts = file.attrs.get("texts", "")
        file.attrs["texts"] = f"{texts}{value}\n"  # until all are there
        mark = np.array([[0xDD000000, 2, 1, 1, 1 + texts.count("\n"), 1]], dtype=np.uint32)
        _data(group, name, mark, "string").attrs["MATLAB_object_decode"] = np.int32(3)
    elif isinstance(value, str):
        codes = np.frombuffer(value.encode("utf-16-le"), dtype="<u2").reshape(-1, 1)
        _data(group, name, codes, "char").attrs["MATLAB_int_decode"] = np.int32(2)
    elif isinstance(value, list):
        _data(group, name, _references(file, value), "cell")
    elif value.dtype.names:
        made = group.create_group(name)
        _class(made, "struct")
        for key in value.dtype.names:
            made.create_dataset(key, data=_references(file, list(value[key].ravel())))
    elif value.size == 0:
        empty = group.create_dataset(name, data=np.array(value.shape if value.ndim > 1 else (0, 0), dtype=np.uint64))
        _class(empty, "double")
        empty.attrs["MATLAB_empty"] = np.uint8(1)
    else:
        kinds = {"f": "double", "b": "logical", "i": "int64", "u": "uint8"}
        array = np.atleast_2d(value) if value.ndim != 1 else value[:, None]
        _data(
            group, name, array.T.astype(np.uint8 if value.dtype.kind == "b" else value.dtype), kinds[value.dtype.kind]
        )


def _put_objects(file: h5py.File) -> None:
    """What the strings hold, in the part of a file where objects are kept."""
    texts = str(file.attrs.get("texts", "")).splitlines()
    if not texts:
        return
    del file.attrs["texts"]
    names = b"any\x00string\x00".ljust(16, b"\x00")
    classes = np.array([0, 0, 0, 0, 0, 2, 0, 0], dtype="<u4").tobytes()
    values = np.array([0, 0, *(w for i in range(len(texts)) for w in (1, 1, 1, i))], dtype="<u4").tobytes()
    objects = np.array(
        [0] * 6 + [w for i in range(1, len(texts) + 1) for w in (1, 0, 0, i, 0, i)], dtype="<u4"
    ).tobytes()
    begins = 40 + np.cumsum([len(names), len(classes), len(values), len(objects)])
    head = np.array([4, 2, *begins, *[begins[-1]] * 4], dtype="<u4").tobytes()
    links = np.frombuffer(head + names + classes + values + objects, dtype=np.uint8)
    contents = []
    for text in texts:
        units = text.encode("utf-16-le")
        words = [1, 2, 1, 1, len(units) // 2]
        contents.append(
            np.array([words + np.frombuffer(units.ljust(-(-len(units) // 8) * 8, b"\x00"), "<u8").tolist()])
        )
    _data(
        file.create_group("#subsystem#"),
        "MCOS",
        _references(file, [links[None, :], links[None, :8], *contents]),
        "FileWrapper__",
    )


def _references(file: h5py.File, values: list[Any]) -> np.ndarray:
    store = file.require_group("#refs#")
    made = np.empty((len(values), 1), dtype=h5py.ref_dtype)
    for i, value in enumerate(values):
        name = f"r{len(store)}"
        _put(file, store, name, value)
        made[i, 0] = store[name].ref
    return made


def _data(group: h5py.Group, name: str, values: np.ndarray, kind: str) -> h5py.Dataset:
    dtype = h5py.ref_dtype if values.dtype == object else values.dtype
    packed = {"chunks": values.shape, "compression": "gzip"} if values.size > 10 and dtype != h5py.ref_dtype else {}
    made = group.create_dataset(name, data=values, dtype=dtype, **packed)
    _class(made, kind)
    return made


def _class(item: Any, kind: str) -> None:
    item.attrs["MATLAB_class"] = np.bytes_(kind)
