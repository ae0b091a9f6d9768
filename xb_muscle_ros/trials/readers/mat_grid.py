"""MATLAB files of the data of Horslen et al. 2023, as van der Zee et al. 2026 arranged them.

A struct ``data`` holds ``Fexp`` (F0), ``Lexp`` (change of length, L0) and ``texp`` (s) as samples x pCa x recovery x
amplitude, padded with NaN, and ``pCas``, ``ISIs`` (recovery, ms) and ``AMPs`` (1e-4 L0). The test stretch begins at
0.005 s, times before it are negative. A cell whose lengths or forces are all NaN was not measured.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.readers.base import Pending, Recording, Signal
from xb_muscle_ros.trials.readers.description import Column, ImportMapping, filled
from xb_muscle_ros.trials.readers.left_out import Told
from xb_muscle_ros.trials.readers.mat_nodes import Struct
from xb_muscle_ros.trials.trial import Array

TEST_START_S = 0.005
STRUCT = "data"
# Axes of the signals after that of samples: field of the struct, fact it tells, and factor to the fact's unit.
_AXES = (("pCas", "pca", 1.0), ("ISIs", "recovery_s", 1e-3), ("AMPs", "amplitude_l0", 1e-4))
_SIGNALS = ("time", "length", "force")
Cell = tuple[int, ...]


@dataclass(frozen=True)
class _Data:
    """The struct: signals of shape (samples, pCa, recovery, amplitude) by field, and the axes as in the file."""

    path: Path
    signals: dict[str, Array]
    axes: tuple[Array, ...]

    def values(self, column: Column, cell: Cell) -> Array:
        """Samples of a cell without the padding."""
        samples: Array = self.signals[column.name][:, cell[0], cell[1], cell[2]]
        finite = np.flatnonzero(np.isfinite(samples))
        return samples[: finite[-1] + 1] if finite.size else samples[:0]


# What a mapping need not say.
TOLD = Told(
    (
        *(("columns.time.column", "texp"), ("columns.time.unit", "s")),
        *(("columns.length.column", "Lexp"), ("columns.length.unit", "L0"), ("columns.length.is", "change")),
        *(("columns.force.column", "Fexp"), ("columns.force.unit", "F0")),
    )
)


def is_grid(content: Struct) -> bool:
    """Whether variables are of this layout: a struct of this name with one of the axes at least."""
    struct = content.get(STRUCT)
    return isinstance(struct, dict) and any(field in struct for field, *_ in _AXES)


def trials(path: Path, mapping: ImportMapping, content: Struct) -> Iterator[Pending]:
    """The measured cells of a file, pCa by pCa.

    Raises:
        UserError: arrays that are missing or do not fit each other.
    """
    data = _data(path, mapping, content[STRUCT])
    measured = [column for column in (mapping.length, mapping.force) if column is not None]
    for cell in itertools.product(*(range(axis.size) for axis in data.axes)):
        if all(data.values(column, cell).size for column in measured):
            pca, recovery_ms, amplitude = (axis[i] for axis, i in zip(data.axes, cell, strict=True))
            name = f"{filled(mapping.trial, path)}_amp{amplitude:g}_rt{recovery_ms:g}ms_pca{10.0 * pca:.6g}"
            yield Pending(name, partial(_recording, data, mapping, cell, name))


def _recording(data: _Data, mapping: ImportMapping, cell: Cell, name: str) -> Recording:
    where = f"{data.path}, trial {name}"
    facts = _facts(data, cell, where)
    found = {key: data.values(column, cell) for key, column in mapping.columns.items() if key in _SIGNALS}
    time, length = found["time"], found["length"]
    if mapping.force is not None and found["force"].size != length.size:
        raise UserError(
            f"{where}: {mapping.length.name} has {length.size} samples, {mapping.force.name} {found['force'].size}; "
            "needed are equal numbers; mend the file"
        )
    warnings: tuple[str, ...] = ()
    if 0 < time.size < length.size:
        # The authors kept one record of times for all pCa.
        warnings = (f"{where}: {length.size} samples have {time.size} times; those without a time are left out",)
    count = min(time.size, length.size)
    shift = max(0.0, -float(time[0])) if count else 0.0
    found["time"] = time + shift
    test_start_s = TEST_START_S + shift * mapping.time.unit.factor
    return Recording(
        where,
        name,
        {
            key: Signal(mapping.columns[key].name, values[:count], lambda i: f"sample {i + 1}")
            for key, values in found.items()
        },
        facts,
        (f"time {TEST_START_S:g} s of the file is {test_start_s:.6g} s here",),
        warnings,
        test_start_s,
    )


def _facts(data: _Data, cell: Cell, where: str) -> dict[str, float | None]:
    facts: dict[str, float | None] = {}
    for (field, fact, factor), axis, i in zip(_AXES, data.axes, cell, strict=True):
        if not np.isfinite(axis[i]):
            raise UserError(f"{where}: {field}({i + 1}) is {axis[i]}; needed is a number; mend the file")
        facts[fact] = float(f"{factor * float(axis[i]):.12g}")  # 12 digits, so that 316 ms are 0.316 s
    return facts


def _data(path: Path, mapping: ImportMapping, struct: Struct) -> _Data:
    columns = [column for key, column in mapping.columns.items() if key in _SIGNALS]
    missing = [name for name in (*(c.name for c in columns), *(field for field, *_ in _AXES)) if name not in struct]
    if missing:
        raise UserError(
            f"{path}: struct {STRUCT} has no {missing[0]}; its fields: {', '.join(map(str, struct))}; is it a file of "
            "this data set?"
        )
    axes = tuple(_numbers(path, struct, field).ravel() for field, *_ in _AXES)
    shape = tuple(axis.size for axis in axes)
    signals = {}
    for column in columns:
        array = _numbers(path, struct, column.name)
        cells = int(np.prod(shape))
        # MATLAB drops axes of length 1 at the end.
        if (
            array.size % cells
            or array.size == 0
            or tuple(n for n in array.shape[1:] if n > 1) != tuple(n for n in shape if n > 1)
        ):
            raise UserError(
                f"{path}: {column.name} has shape {array.shape}; needed are samples x {shape}, as "
                "pCas, ISIs and AMPs tell"
            )
        signals[column.name] = array.reshape(-1, *shape)
    return _Data(path, signals, axes)


def _numbers(path: Path, struct: Struct, field: str) -> Array:
    array = struct[field]
    if not isinstance(array, np.ndarray) or array.dtype == object:
        raise UserError(f"{path}: {STRUCT}.{field} holds no numbers; is it a file of this data set?")
    return array
