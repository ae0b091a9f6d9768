"""The header of a ``.ddf`` file of Dynamic Muscle Control: references, calibrations, comment and protocol."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.readers.lines import Amount, Text, amount

NEEDED = "a data file of Dynamic Muscle Control"
BEGIN = re.compile(rb"\s*DMC.*Data File", re.IGNORECASE)
SAMPLE, SCALE = "Sample", "Scale (units/V)"
_DATA, _CALIBRATION, _PROTOCOL = "Test Data in Volts", "Calibration Data", "Protocol Array"
_RATE, _CHANNEL, _UNITS, _OFFSET, _TADS = "Sample Frequency (Hz)", "Channel", "Units", "Offset (volts)", "TADs"


class Calibration(NamedTuple):
    """How volts of a channel become its unit; the third number of DMC, TAD, is told alone."""

    unit: str
    scale: float
    offset_v: float
    tad: float


@dataclass(frozen=True)
class DdfHeader:
    """What stands above the data.

    Attributes:
        facts: values by the name before the colon.
        channels: calibrations by the channel's name.
        comment: of the test, on one line.
        protocol: one line each: wait (s), action, port and parameters.
        names: of the columns.
        first: index of the line the rows begin with.
    """

    path: Path
    facts: Mapping[str, str]
    channels: Mapping[str, Calibration]
    comment: str
    protocol: tuple[str, ...]
    names: tuple[str, ...]
    first: int

    def amount(self, name: str) -> Amount | None:
        """A number with its unit; None where it is not there."""
        return amount(self.facts[name]) if name in self.facts else None

    @property
    def rate_hz(self) -> float:
        """Samples in a second.

        Raises:
            UserError: the header does not tell them.
        """
        found = self.amount(_RATE)
        if found is None or not 0.0 < found.value < np.inf:
            what = "is missing" if found is None else f"is '{self.facts[_RATE]}'"
            raise UserError(f"{self.path}: {_RATE} {what} in the header; needed is a number above 0; mend the header")
        return found.value


def read_header(path: Path, text: Text) -> DdfHeader:
    """Read what stands above the data.

    Raises:
        UserError: the file is none of DMC, ends within its header, or has a calibration that is not whole.
    """
    lines = text.lines
    if not BEGIN.match(lines[0].encode()):
        raise UserError(f"{path} does not begin with DMC ... Data File; needed is {NEEDED}")
    data = next((i for i, line in enumerate(lines) if line.startswith(_DATA)), None)
    names_at = None if data is None else next((i for i in range(data + 1, len(lines)) if lines[i].strip()), None)
    names = () if names_at is None else tuple(lines[names_at].split())
    if data is None or names_at is None or not names or names[0] != SAMPLE:
        raise UserError(f"{path} ends within its header: '{_DATA}' or the names below it are missing; copy it again")
    facts: dict[str, str] = {}
    table: dict[str, list[str]] = {}
    words: dict[str, list[str]] = {"Comments": [], _PROTOCOL: []}
    part = ""
    for line in lines[1:data]:
        name, colon, value = line.partition(":")
        heading = next((each for each in (_CALIBRATION, "Comments", _PROTOCOL) if colon and each in name), "")
        if heading:
            part = heading
            words.setdefault(part, []).append(value.strip())
        elif part == _CALIBRATION:
            row = line.split("\t")
            table[row[0].strip()] = [cell.strip() for cell in row[1:]]
        elif part:
            words[part].append(" ".join(line.split("\t")).strip())
        elif colon:
            if facts.get(name.strip(), value.strip()) != value.strip():
                raise UserError(f"{path}: {name.strip()} is in the header twice, and differently; mend the header")
            facts[name.strip()] = value.strip()
    comment = " ".join(" ".join(words["Comments"]).split())
    protocol = tuple(" ".join(each.split()) for each in words[_PROTOCOL] if each)
    return DdfHeader(path, facts, _channels(path, table), comment, protocol, names, names_at + 1)


def _channels(path: Path, table: Mapping[str, list[str]]) -> dict[str, Calibration]:
    names = table.get(_CHANNEL, [])
    if not names:
        raise UserError(f"{path}: the header has no calibration ({_CALIBRATION}, {_CHANNEL}); mend the header")
    made = {}
    for i, name in enumerate(names):
        cells = {row: (table.get(row, []) + [""] * len(names))[i] for row in (_UNITS, SCALE, _OFFSET, _TADS)}
        values = {row: amount(cells[row]).value if cells[row] else 0.0 for row in (SCALE, _OFFSET, _TADS)}
        wrong = next((row for row in values if not np.isfinite(values[row])), None)
        if wrong is not None:
            raise UserError(f"{path}: {wrong} of {name} is '{cells[wrong]}' in the header; needed is a number; mend it")
        made[name] = Calibration(cells[_UNITS], values[SCALE], values[_OFFSET], values[_TADS])
    return made
