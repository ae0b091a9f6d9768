"""Trials from Axon binary files (pClamp, AxoScope): a trial for each sweep; a gap-free recording is one trial."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.readers.abf_file import ABF1, ABF2, AbfFile, read_abf
from xb_muscle_ros.trials.readers.base import Pending, Reader, Recording, Signal
from xb_muscle_ros.trials.readers.contents import Content, Contents
from xb_muscle_ros.trials.readers.description import ImportMapping, filled
from xb_muscle_ros.trials.readers.left_out import Told
from xb_muscle_ros.trials.readers.told_units import differing, told_of, told_unit

_TIME = "time"
# Channels of these names are taken without being named.
_USUAL = ("length", "force")


class AbfReader(Reader):
    """Channels by name or number; their units, and the rate of the samples, are those of the file."""

    name = "abf"
    suffixes = (".abf",)
    begins = (ABF1, ABF2)
    tells = True
    defaults: Mapping[str, Any] = {"fibre": "{file}", "columns": {"time": {"column": _TIME, "unit": "s"}}}

    def told(self, path: Path, tree: Mapping[str, Any]) -> Told:
        """Units of the channels that the mapping names, and channels called length and force where it names none.

        Raises:
            UserError: the file cannot be read, has no such channel, or a unit that is not known.
        """
        file = _load(path)
        columns = {key: each for key, each in tree.get("columns", {}).items() if isinstance(each, Mapping)}
        named = {key: str(each["column"]) for key, each in columns.items() if "column" in each and key != "time"}
        by_name = {each.name.casefold(): each.name for each in file.channels}
        found = {key: by_name[key] for key in _USUAL if key in by_name and key not in named}
        if "length" not in {**named, **found}:
            raise UserError(
                f"{path}: columns.length has to name a channel (--length-column); the file has {file.told()}"
            )
        units = {}
        for key, name in {**found, **named}.items():
            channel = file.channels[file.index(name)]
            if "unit" not in columns.get(key, {}) and channel.unit:
                units[key] = told_unit(channel.unit, key, f"{path}: channel '{channel.name}'")
        return told_of(str(path), found, units)

    def trials(self, path: Path, mapping: ImportMapping) -> Iterator[Pending]:
        """A trial for each sweep; the file is read whole, its trials are made one at a time."""
        file = _load(path)
        whole = filled(mapping.trial, path)
        for i in range(len(file.sweeps)):
            name = whole if len(file.sweeps) == 1 else f"{whole}_{i + 1}"
            where = str(path) if len(file.sweeps) == 1 else f"{path}, trial {name}"
            yield Pending(name, partial(_recording, file, mapping, i, name, where))

    def pca(self, path: Path, mapping: ImportMapping) -> float | None:
        """As the file's name or the mapping tells; None where a channel does."""
        return None if mapping.calcium is not None else super().pca(path, mapping)

    def contents(self, path: Path) -> Contents:
        """All channels of the first sweep, with the units of the file."""
        file = _load(path)
        begin, end = file.sweeps[0]
        signals = [Content(_TIME, np.arange(end - begin) * file.step_s, "s", told_role="time")]
        for i, channel in enumerate(file.channels):
            signals.append(Content(channel.name or str(i), file.values(i, 0), channel.unit))
        names = tuple(str(i + 1) for i in range(len(file.sweeps))) if len(file.sweeps) > 1 else ()
        form = f"{file.notes[0]}, {len(file.channels)} channels at {1.0 / file.step_s:.6g} Hz"
        return Contents(form, tuple(signals), names, others=file.notes[1:])


def _load(path: Path) -> AbfFile:
    try:
        status = path.stat()
    except OSError as problem:
        raise UserError(f"{path} cannot be read: {problem.strerror}; give an ABF file") from problem
    return _loaded(path, status.st_size, status.st_mtime_ns)


@lru_cache(maxsize=1)
def _loaded(path: Path, _size: int, _mtime_ns: int) -> AbfFile:
    """The last file is kept: its units and its trials are asked for one after the other."""
    return read_abf(path)


def _recording(file: AbfFile, mapping: ImportMapping, sweep: int, name: str, where: str) -> Recording:
    begin, end = file.sweeps[sweep]
    signals = {}
    for key, column in mapping.columns.items():
        if key == "time":
            values, shown = np.arange(end - begin) * file.step_s, _TIME
        else:
            number = file.index(column.name)
            values, shown = file.values(number, sweep), f"channel '{file.channels[number].name or number}'"
        signals[key] = Signal(shown, values, lambda i: f"sample {i + 1}")
    lines = (*mapping.told, *differing(str(file.path), _units(file, mapping), mapping)) if sweep == 0 else ()
    sweeps = (f"sweep {sweep + 1} of {len(file.sweeps)}",) if len(file.sweeps) > 1 else ()
    return Recording(
        where,
        name,
        signals,
        mapping.facts_of(file.path),
        (*file.notes, *sweeps),
        warnings=lines,
    )


def _units(file: AbfFile, mapping: ImportMapping) -> dict[str, str]:
    """Units of the file by signal; of time there is none."""
    return {key: file.channels[file.index(each.name)].unit for key, each in mapping.columns.items() if key != "time"}
