"""The text format of SLControl (Campbell and Moss 2003): a header of tags and values, then columns of volts.

Values are on a line of their own below a ``_TAG_``, or behind a name that ends with a colon, or, between
``_FILE_INFO_START_`` and ``_FILE_INFO_STOP_``, behind the name. Lengths come in µm, times in ms, calibrations per V.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.trial import Array

MAGIC = b"SLCONTROL_DATA_FILE"
# Columns after that of time, by the number of input channels.
CHANNELS = {
    4: ("force", "sl", "fl", "intensity"),
    8: ("force", "fl", "fl_command", "stimulus", "light_intensity", "shutter", "wavelength_command", "spare"),
}
_DATA = "Data"
_INFO = ("_FILE_INFO_START_", "_FILE_INFO_STOP_")


@dataclass(frozen=True)
class SlcHeader:
    """What stands above the data.

    Attributes:
        path: the file.
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
        value = math.nan if text is None else _float(text)
        if not math.isfinite(value):
            found = "is missing" if text is None else f"is '{text}'"
            raise UserError(f"{self.path}: {name} {found} in the header; needed is a number; mend the header")
        return value

    def micrometres(self, name: str) -> float:
        """A number whose name carries its unit, which has to be µm; the sign for µ depends on the file's encoding."""
        pattern = re.compile(re.escape(name) + r"_\((.*)m\)")
        key = next((each for each in self.values if pattern.fullmatch(each)), None)
        if key is None:
            raise UserError(f"{self.path}: {name}_(µm) is missing in the header; needed is a number; mend the header")
        unit = pattern.fullmatch(key)
        assert unit is not None
        if unit.group(1) not in ("µ", "μ", "u"):
            raise UserError(f"{self.path}: {key} in the header is not in µm; that is the only unit known for it")
        return self.number(key)

    @property
    def pca(self) -> float | None:
        """The pCa as noted; None where it is not or is no number."""
        value = _float(self.info.get("pCa", ""))
        return value if math.isfinite(value) else None

    @property
    def force_gain(self) -> float:
        """What force was amplified by beside its calibration; 1 where nothing is noted."""
        value = _float(self.info.get("Force_gain", ""))
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
                lines.append(_text(raw))
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
    table = _numbers(header, rows[:points], names)
    return {name: table[:, i] for i, name in enumerate(names)}


def _numbers(header: SlcHeader, rows: list[bytes], names: tuple[str, ...]) -> Array:
    cells = [row.split() for row in rows]
    try:
        table: Array = np.array(cells, dtype=np.float64)  # ragged rows and words are ValueErrors
        if table.shape == (len(rows), len(names)):
            return table
    except ValueError:
        pass
    for i, row in enumerate(cells):
        line = header.lines + i + 1
        if len(row) != len(names):
            raise UserError(
                f"{header.path}, line {line} has {len(row)} cells; needed are {len(names)}: {', '.join(names)}"
            )
        for name, cell in zip(names, row, strict=True):
            if math.isnan(_float(cell.decode("latin-1"))) and cell.lower() != b"nan":
                raise UserError(
                    f"{header.path}, line {line}, column '{name}' holds '{cell.decode('latin-1')}'; needed is a number"
                )
    raise UserError(f"{header.path} has no rows below its header; copy it again")


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
        elif line:
            recorded = line if tag == "_RECORD_TIME_" else recorded
        tag = line if line.startswith("_") else tag
    return SlcHeader(path, info, values, recorded, len(lines))


def _text(raw: bytes) -> str:
    try:
        return raw.decode("utf-8").strip()
    except UnicodeDecodeError:
        return raw.decode("latin-1").strip()


def _float(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan
