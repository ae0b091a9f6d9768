"""Trials from ``.dat`` files of Aurora Scientific's 600A software: fibres, with length and force in their units.

Sections begin with ``*** name ***``: setup, calibrations (already applied), the test protocol (a table of times in ms,
control functions and options), and at last length and force over time, in the protocol's clock. ``Lin`` and ``Fin`` are
measured, ``Lout`` and ``Fout`` commanded. Facts of the format: AuroraAnalysisToolkit and AuroraCommandFileToolkit
(M. Millard), rd_dat (M. Gardner-Morse) and other public programs that read such files.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.readers.aurora_protocol import Step, bath_warnings, in_words, stretches
from xb_muscle_ros.trials.readers.base import Pending, Reader, Recording, begin_of
from xb_muscle_ros.trials.readers.contents import Contents
from xb_muscle_ros.trials.readers.description import ImportMapping, filled
from xb_muscle_ros.trials.readers.header import is_told, pca_of, reference_warning, told_keys, with_facts
from xb_muscle_ros.trials.readers.lines import Amount, Rows, Text, amount, read_lines, read_rows
from xb_muscle_ros.trials.readers.named_columns import NamedColumn, contents_of, signals_of
from xb_muscle_ros.trials.readers.rates import rate_warning
from xb_muscle_ros.trials.readers.units import UNITS
from xb_muscle_ros.trials.trial import Array

_NEEDED = "a data file of the 600A software"
_BEGIN = re.compile(rb"\s*ASI\s+6\d\d\w?\s+Data File", re.IGNORECASE)
_SECTION = re.compile(r"\s*\*\*\*\s*(.*?)\s*\*\*\*\s*")
_DATA = "Force and Length Signals vs Time"
_COLUMN = re.compile(r"\s*([^\s(](?:[^\t(]*[^\s(])?)\s*\(([^)\t]*)\)")
_LENGTH, _FORCE, _RATE = "Fiber Length", "Reference Force", "A/D Sampling Rate"
_INITIAL = "Initial Length"
_SAME_LENGTH = 0.01
# Times whose last digit is this much longer than a sample cannot tell samples apart.
_COARSE = 1.2
# Facts of the header that are noted.
_NOTED = {_LENGTH: "fibre", _INITIAL: "initial length", "Diameter": "diameter"}
_NOTED |= {"Initial Sarcomere Length": "sarcomeres", "Temperature": "temperature"}


@dataclass(frozen=True)
class DatHeader:
    """What stands above the data.

    Attributes:
        facts: values by the name before the colon, in the order of the file.
        protocol: control functions in the order of the file.
        names, units: of the columns; a unit is empty where there is none.
        first: index of the line the rows begin with.
    """

    path: Path
    facts: Mapping[str, tuple[str, ...]]
    protocol: tuple[Step, ...]
    names: tuple[str, ...]
    units: tuple[str, ...]
    first: int

    def text(self, name: str) -> str:
        """A value; empty where there is none."""
        return next(iter(self.facts.get(name, ())), "")

    def amount(self, name: str) -> Amount | None:
        """A number with its unit; None where it is not there.

        Raises:
            UserError: the header tells it twice, and differently.
        """
        told = self.facts.get(name, ())
        if len(set(told)) > 1:
            raise UserError(f"{self.path}: {name} is in the header as {' and as '.join(told)}; mend the header")
        return amount(told[0]) if told else None


def read_header(path: Path, text: Text) -> DatHeader:
    """Read what stands above the data.

    Raises:
        UserError: the file is none of the 600A software, or ends within its header.
    """
    facts: dict[str, tuple[str, ...]] = {}
    protocol: list[Step] = []
    in_table = False
    for i, line in enumerate(text.lines):
        section = _SECTION.fullmatch(line)
        if section is not None and section[1] == _DATA:
            return DatHeader(path, facts, tuple(protocol), *_columns(path, text, i + 1))
        if section is not None:
            in_table = False
        elif in_table:
            step = Step.read(line)
            protocol += [step] if step is not None else []
        elif line.lstrip().startswith("Time") and "Control Function" in line:
            in_table = True
        elif ":" in line:
            name, _, value = line.partition(":")
            facts[name.strip()] = (*facts.get(name.strip(), ()), value.strip())
    what = "ends within its header" if _BEGIN.match(text.lines[0].encode()) else f"has no section *** {_DATA} ***"
    raise UserError(f"{path} {what}; needed is {_NEEDED}; copy it again, or read a table with --format csv")


def _columns(path: Path, text: Text, i: int) -> tuple[tuple[str, ...], tuple[str, ...], int]:
    """Names and units of the columns, and the index of the line below them."""
    while i < len(text.lines) and not text.lines[i].strip():
        i += 1
    line = text.lines[i].strip() if i < len(text.lines) else ""
    cells = [cell for cell in re.split(r"\t|\s{2,}", line) if cell.strip()]
    if any(cell.count("(") > 1 for cell in cells):
        cells = [match.group() for match in _COLUMN.finditer(line)]
    found = [(match[1], match[2].strip()) if (match := _COLUMN.fullmatch(c)) else (c.strip(), "") for c in cells]
    names = tuple(name for name, _ in found)
    if not names or names[0].casefold() != "time":
        raise UserError(f"{path} ends within its header or names no columns below *** {_DATA} ***; copy it again")
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise UserError(f"{path} has more than one column '{twice}'; rename one")
    return names, tuple(unit for _, unit in found), i + 1


class DatReader(Reader):
    """One trial to a file; the folder is the fibre.

    Columns go by their names without units; lengths come in m, forces in N, times in s. L0 is the fibre length of the
    header.
    """

    name = "dat"
    suffixes = (".dat",)
    defaults: Mapping[str, Any] = {
        "fibre": "{folder}",
        "columns": {
            "time": {"column": "Time", "unit": "s"},
            "length": {"column": "Lin", "unit": "m"},
            "force": {"column": "Fin", "unit": "N"},
        },
    }
    in_header = ("f0", "reference_length")
    takes = ("decimal",)

    def matches(self, path: Path) -> bool:
        """Whether the file begins like one of the software; the ending is that of tables as well."""
        begin = begin_of(path)
        return _BEGIN.match(begin) is not None or (begin.count(b"***") > 1 and b"*** Setup Parameters ***" in begin)

    def completed(self, path: Path, mapping: ImportMapping) -> ImportMapping:
        """L0 by the fibre length of the header, F0 by its reference force."""
        header = read_header(path, read_lines(path, _NEEDED))
        return with_facts(path, mapping, (_LENGTH, header.amount(_LENGTH)), (_FORCE, header.amount(_FORCE)))

    def trials(self, path: Path, mapping: ImportMapping) -> Iterator[Pending]:
        """The one trial of the file."""
        yield Pending(filled(mapping.trial, path), lambda: _recording(path, mapping))

    def pca(self, path: Path, mapping: ImportMapping) -> float | None:
        """As the mapping, the header's comment or the file's name tells."""
        return pca_of(path, mapping, read_header(path, read_lines(path, _NEEDED)).text("Comment"))[0]

    def contents(self, path: Path) -> Contents:
        """All columns in their units, and what the header tells."""
        text = read_lines(path, _NEEDED)
        header = read_header(path, text)
        rows = read_rows(path, text, header.first, header.names)
        time, rounded = _times(header, rows, _rate(header))
        signals = contents_of(_named(header, rows, time), self.defaults, rows.at)
        facts = {name: values[0] for name, values in header.facts.items() if values[0]}
        steps = (f"protocol: {in_words(header.protocol)}",) if header.protocol else ()
        told = told_keys(header.amount(_LENGTH), header.amount(_FORCE))
        return Contents(
            "Aurora 600A", signals, facts=facts, others=steps, notes=(*rows.notices, *rounded), in_header=told
        )


def _rate(header: DatHeader) -> float | None:
    rate = header.amount(_RATE)
    return rate.value if rate is not None and rate.unit in ("Hz", "") and rate.value > 0.0 else None


def _named(header: DatHeader, rows: Rows, time: Array) -> dict[str, NamedColumn]:
    return {
        name: NamedColumn(time if i == 0 else rows.values[:, i], unit)
        for i, (name, unit) in enumerate(zip(header.names, header.units, strict=True))
    }


def _recording(path: Path, mapping: ImportMapping) -> Recording:
    text = read_lines(path, _NEEDED)
    header = read_header(path, text)
    rows = read_rows(path, text, header.first, header.names, mapping.table.decimal)
    rate_hz = _rate(header)
    time, rounded = _times(header, rows, rate_hz)
    signals = signals_of(path, mapping, _named(header, rows, time), rows.at)
    time_s = signals["time"].values * mapping.time.unit.factor
    pca, how = pca_of(path, mapping, header.text("Comment"))
    planned = stretches(header.protocol, float(time_s[0]), float(time_s[-1]))
    facts = mapping.facts_of(path)
    told = {} if planned is None else {"amplitude_l0": planned.amplitude_l0, "recovery_s": planned.recovery_s}
    if "reference_length" in mapping.own_keys or not is_told(header.amount(_LENGTH)):
        told.pop("amplitude_l0", None)  # commands are in the header's Lo
    shift_s = max(-float(time_s[0]), 0.0)
    return Recording(
        str(path),
        filled(mapping.trial, path),
        signals,
        {**{name: told.get(name) if value is None else value for name, value in facts.items()}, "pca": pca},
        (*_notes(header), *((how,) if how else ())),
        (
            *rows.notices,
            *rounded,
            *rate_warning(path, rate_hz, time_s),
            *reference_warning(path, mapping, _LENGTH, header.amount(_LENGTH)),
            *_of_lengths(header, mapping),
            *(bath_warnings(path, header.protocol, time_s) if pca is not None else ()),
        ),
        None if planned is None else planned.test_start_s + shift_s,
    )


def _times(header: DatHeader, rows: Rows, rate_hz: float | None) -> tuple[Array, tuple[str, ...]]:
    """Times in the unit of the file; where its digits do not tell samples apart, by the header's rate, with a line."""
    time = rows.values[:, 0]
    steps = np.diff(time)
    unit = UNITS.get(header.units[0])
    if rate_hz is None or unit is None or not np.any(steps == 0.0) or np.any(steps < 0.0) or not np.any(steps > 0.0):
        return time, ()
    even = time[0] + np.arange(time.size) / (rate_hz * unit.factor)
    digit = float(np.min(steps[steps > 0.0]))
    if digit < _COARSE / (rate_hz * unit.factor) or np.max(np.abs(even - time)) > 1.01 * digit:
        return time, ()  # a line that is there twice
    return even, (
        f"{header.path}: times are rounded to {digit:.3g} {header.units[0]}, so that samples share them; they are "
        f"counted by the header's {rate_hz:g} Hz",
    )


def _of_lengths(header: DatHeader, mapping: ImportMapping) -> Iterator[str]:
    """A line where the header has two lengths of the fibre: laboratories take either for L0."""
    length, initial = header.amount(_LENGTH), header.amount(_INITIAL)
    if "reference_length" in mapping.own_keys or length is None or initial is None or length.unit != initial.unit:
        return
    if is_told(length) and is_told(initial) and abs(initial.value - length.value) > _SAME_LENGTH * length.value:
        yield (
            f"{header.path}: the header has {_LENGTH} {header.text(_LENGTH)} and {_INITIAL} {header.text(_INITIAL)}; "
            "L0 is the former; give --reference-length if it is the latter"
        )


def _notes(header: DatHeader) -> Iterator[str]:
    noted = [f"{words} {header.text(name)}" for name, words in _NOTED.items() if header.text(name)]
    yield f"Aurora 600A record of {header.text('Created') or 'an unknown day'}" + (
        f" ({', '.join(noted)})" if noted else ""
    )
    if header.text("Comment"):
        yield f"comment: {header.text('Comment')}"
    if header.protocol:
        yield f"protocol: {in_words(header.protocol)}"
