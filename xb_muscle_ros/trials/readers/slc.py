"""Trials from SLControl files (Campbell and Moss 2003): permeabilised fibres, with their calibrations in the header.

A header of tags and values stands above columns of volts. Values are on a line of their own below a ``_TAG_``, or
behind a name that ends with a colon, or, between ``_FILE_INFO_START_`` and ``_FILE_INFO_STOP_``, behind the name.
Lengths come in µm, times in ms, calibrations per V.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from xb_muscle_ros.errors import UserError, suggest
from xb_muscle_ros.trials.readers.base import Pending, Reader, Recording, Signal
from xb_muscle_ros.trials.readers.cells import number
from xb_muscle_ros.trials.readers.contents import Content, Contents
from xb_muscle_ros.trials.readers.description import Column, ImportMapping, filled, name_of
from xb_muscle_ros.trials.readers.lines import decoded, numbers
from xb_muscle_ros.trials.readers.rates import rate_warning
from xb_muscle_ros.trials.readers.rows import SPACES, TextRows
from xb_muscle_ros.trials.trial import Array

MAGIC = b"SLCONTROL_DATA_FILE"
# Columns after that of time, by the number of input channels.
CHANNELS = {
    4: ("force", "sl", "fl", "intensity"),
    8: ("force", "fl", "fl_command", "stimulus", "light_intensity", "shutter", "wavelength_command", "spare"),
}
_DATA = "Data"
_INFO = ("_FILE_INFO_START_", "_FILE_INFO_STOP_")
# The motor is at rest at the begin; its mean position then is the length in the header.
_REST_SAMPLES = 100
# Notes of the experimenter that tell the trials of a fibre apart, and their units.
_NOTED = {"Species": "", "Muscle": "", "Temperature": " °C", "pH": " pH", "Drug": ""}
_PCA_IN_NAME = re.compile(r"(\d\d)pCa", re.IGNORECASE)


@dataclass(frozen=True)
class SlcHeader:
    """What stands above the data.

    Attributes:
        info: what the experimenter noted (pCa, species, temperature, ...), by name.
        values: everything else, by the name before the colon.
        recorded: day and time, as in the file.
        lines: how many lines the header takes, the one that says ``Data`` included.
    """

    path: Path
    info: dict[str, str]
    values: dict[str, str]
    recorded: str
    lines: int

    def number(self, name: str) -> float:
        """A number that has to be there.

        Raises:
            UserError: it is missing or no finite number.
        """
        text = self.values.get(name)
        value = math.nan if text is None else number(text)
        if not math.isfinite(value):
            found = "is missing" if text is None else f"is '{text}'"
            raise UserError(f"{self.path}: {name} {found} in the header; needed is a number; mend the header")
        return value

    def micrometres(self, name: str) -> float:
        """A number whose name carries its unit, which has to be µm; the sign for µ depends on the file's encoding."""
        match = next(filter(None, (re.fullmatch(re.escape(name) + r"_\((.*)m\)", each) for each in self.values)), None)
        if match is None:
            raise UserError(f"{self.path}: {name}_(µm) is missing in the header; needed is a number; mend the header")
        key = match.group()
        if match.group(1) not in ("µ", "μ", "u"):
            raise UserError(f"{self.path}: {key} in the header is not in µm; that is the only unit known for it")
        return self.number(key)

    @property
    def pca(self) -> float | None:
        """The pCa as noted; None where it is not or is no number."""
        value = number(self.info.get("pCa", ""))
        return value if math.isfinite(value) else None

    @property
    def force_gain(self) -> float:
        """What force was amplified by beside its calibration; 1 where nothing is noted."""
        value = number(self.info.get("Force_gain", ""))
        return value if math.isfinite(value) and value > 0.0 else 1.0


def read_header(path: Path) -> SlcHeader:
    """Read the header alone.

    Raises:
        UserError: the file cannot be read, or is none of SLControl.
    """
    try:
        with path.open("rb") as file:
            lines = []
            for raw in file:
                lines.append(decoded(raw).strip())
                if lines[-1] == _DATA:
                    break
    except OSError as problem:
        raise UserError(f"{path} cannot be read: {problem.strerror}; give an SLControl file") from problem
    if not lines or lines[0] != MAGIC.decode() or lines[-1] != _DATA:
        what = "is empty" if not lines else f"does not begin with {MAGIC.decode()}"
        if lines and lines[0] == MAGIC.decode():
            what = "ends within its header"
        raise UserError(f"{path} {what}; needed is a whole SLControl file")
    return _header(path, lines)


def read_columns(header: SlcHeader) -> dict[str, Array]:
    """Columns below the header by name, ``time`` in s and the others in V, shape (data points,) each.

    Raises:
        UserError: a cell that is no number, an unknown number of channels, or rows missing.
    """
    channels = int(header.number("No_of_input_channels")) if "No_of_input_channels" in header.values else 4
    if channels not in CHANNELS:
        known = " or ".join(map(str, CHANNELS))
        raise UserError(f"{header.path} has {channels} input channels; known are files with {known}")
    names = ("time", *CHANNELS[channels])
    rows = header.path.read_bytes().split(b"\n")[header.lines :]
    rows = rows[:-1] if rows and not rows[-1].strip() else rows
    points = int(header.number("data_points")) if "data_points" in header.values else len(rows)
    if len(rows) < points:
        raise UserError(
            f"{header.path} has {len(rows)} rows; its header tells of {points} data points, so it was cut short; "
            "copy it again"
        )
    if not rows[:points]:
        raise UserError(f"{header.path} has no rows below its header; copy it again")
    cells = TextRows(
        [decoded(row).strip() for row in rows[:points]], range(header.lines + 1, 1 + header.lines + points), SPACES
    )
    table = numbers(header.path, cells, names)
    return {name: table[:, i] for i, name in enumerate(names)}


def _header(path: Path, lines: list[str]) -> SlcHeader:
    info: dict[str, str] = {}
    values: dict[str, str] = {}
    recorded, inside, tag = "", False, ""
    for line in lines[1:-1]:
        if line in _INFO:
            inside = line == _INFO[0]
        elif inside:
            name, _, value = line.partition(" ")
            info[name] = value.strip()
        elif ":" in line and tag != "_RECORD_TIME_":
            name, _, value = line.partition(":")
            values[name.strip()] = value.strip()
        elif line and not line.startswith("_"):
            recorded = line if tag == "_RECORD_TIME_" else recorded
        tag = line if line.startswith("_") else tag
    return SlcHeader(path, info, values, recorded, len(lines))


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

    def contents(self, path: Path) -> Contents:
        """All channels, those that the header calibrates in their units, and what the header tells."""
        header = read_header(path)
        columns = read_columns(header)
        channels = {"time": columns["time"], **_calibrated(header, columns)}
        roles = {keys["column"]: role for role, keys in self.defaults["columns"].items()}

        def at(i: int) -> str:
            return f"line {header.lines + i + 1}"

        signals = [
            self.content_of(roles[name], name, values, at=at) if name in roles else Content(name, values, "V", at=at)
            for name, values in channels.items()
        ]
        form = f"SLControl, {len(channels) - 1} channels, recorded {header.recorded or 'at no noted time'}"
        noted = {name: text for name, text in {**header.info, **header.values}.items() if text not in ("", "NaN")}
        return Contents(form, tuple(signals), facts=noted, notes=_rate_warning(header, columns["time"]))


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
    stated = "sampling_rate_(Hz)" in header.values
    return rate_warning(header.path, header.number("sampling_rate_(Hz)") if stated else None, time_s)
