"""Trials from SLControl files: permeabilised fibres, with their calibrations in the header."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from xb_muscle_ros.errors import UserError, suggest
from xb_muscle_ros.trials.readers.base import Pending, Reader
from xb_muscle_ros.trials.readers.description import Column, ImportMapping, filled, name_of
from xb_muscle_ros.trials.readers.recording import Recording, Signal
from xb_muscle_ros.trials.readers.slc_file import MAGIC, SlcHeader, read_columns, read_header
from xb_muscle_ros.trials.trial import Array

# The motor is at rest at the begin; its mean position then is the length in the header.
_REST_SAMPLES = 100
# The header may name the rate another program was told; then the time column is right.
_SAME_RATE = 0.01
# Notes of the experimenter that tell the trials of a fibre apart, and their units.
_NOTED = {"Species": "", "Muscle": "", "Temperature": " °C", "pH": " pH", "Drug": ""}
_PCA_IN_NAME = re.compile(r"(\d\d)pCa", re.IGNORECASE)


class SlcReader(Reader):
    """One trial to a file; the folder is the preparation.

    The column ``fl`` is fibre length in m by the header's calibration, from its length at the begin; ``force`` is in
    N, ``time`` in s; other channels are in V. F0 is that of the preparation's trial at pCa 4.5, zero force that of
    the slack fibre.
    """

    name = "slc"
    suffixes = (".slc",)
    begins = (MAGIC,)
    defaults: Mapping[str, Any] = {
        "fibre": "{folder}",
        "trial": "{folder}_{file}",
        "columns": {
            "time": {"column": "time", "unit": "s"},
            "length": {"column": "fl", "unit": "m"},
            "force": {"column": "force", "unit": "N", "zero": "slack"},
        },
        "f0": {"isometric_at_pca": 4.5},
    }

    def trials(self, path: Path, mapping: ImportMapping) -> Iterator[Pending]:
        """The one trial of the file."""
        yield Pending(filled(mapping.trial, path), lambda: _recording(path, mapping))

    def pca(self, path: Path, mapping: ImportMapping) -> float | None:
        """As the header tells."""
        return _facts(read_header(path), mapping)["pca"]


def _recording(path: Path, mapping: ImportMapping) -> Recording:
    header = read_header(path)
    columns = read_columns(header)
    channels = {"time": columns["time"], **_calibrated(header, columns)}

    def signal(column: Column) -> Signal:
        if column.name not in channels:
            raise UserError(f"{path} has no channel '{column.name}'{suggest(column.name, channels)}")
        return Signal(f"column '{column.name}'", channels[column.name], lambda i: f"line {header.lines + i + 1}")

    return Recording(
        str(path),
        filled(mapping.trial, path),
        {key: signal(column) for key, column in mapping.columns.items()},
        _facts(header, mapping),
        _notes(header),
        _rate_warning(header, columns["time"]),
    )


def _calibrated(header: SlcHeader, columns: dict[str, Array]) -> dict[str, Array]:
    """Channels; force in N and fl in m, the others in V."""
    channels = {name: values for name, values in columns.items() if name != "time"}
    channels["force"] = columns["force"] * header.number("FORCE_CALIBRATION") / header.force_gain
    um_per_v = header.number("FL_RESPONSE_CALIBRATION") * header.number("FL_POLARITY")
    moved_v = columns["fl"] - np.mean(columns["fl"][:_REST_SAMPLES])
    channels["fl"] = 1e-6 * (header.micrometres("Muscle_length") + um_per_v * moved_v)
    return channels


def _facts(header: SlcHeader, mapping: ImportMapping) -> dict[str, float | None]:
    """Facts of the mapping, and pCa of the header.

    Raises:
        UserError: header and file name tell different pCa.
    """
    path = header.path
    facts = mapping.facts_of(path)
    if facts["pca"] is not None or mapping.calcium is not None or mapping.activation is not None:
        return facts
    named = _PCA_IN_NAME.search(name_of(path))
    if named is not None and header.pca is not None and abs(header.pca - int(named.group(1)) / 10) > 0.051:
        raise UserError(
            f"{path}: the header says pCa {header.pca:g}, the file name {int(named.group(1)) / 10:g}; give the right "
            "one with --pca, or per_file in the mapping"
        )
    return {**facts, "pca": header.pca}


def _notes(header: SlcHeader) -> tuple[str, ...]:
    noted = [f"{header.info[name]}{unit}" for name, unit in _NOTED.items() if header.info.get(name, "NaN") != "NaN"]
    notes = [f"SLControl record of {header.recorded} ({', '.join(noted)})"]
    if "Area_(m^2)" in header.values:
        notes.append(f"cross-section {header.number('Area_(m^2)'):.6g} m^2")
    if "Sarcomere_length_(nm)" in header.values:
        notes.append(f"sarcomeres {header.number('Sarcomere_length_(nm)'):.6g} nm")
    return tuple(notes)


def _rate_warning(header: SlcHeader, time_s: Array) -> tuple[str, ...]:
    if "sampling_rate_(Hz)" not in header.values or time_s.size < 2:
        return ()
    stated_hz = header.number("sampling_rate_(Hz)")
    found_hz = 1.0 / float(np.median(np.diff(time_s)))
    if abs(stated_hz - found_hz) <= _SAME_RATE * found_hz:
        return ()
    return (
        f"{header.path}: the header says {stated_hz:g} Hz, the time column {found_hz:g} Hz; the time column is used",
    )
