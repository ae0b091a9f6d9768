"""Trials from ``.ddf`` files of Aurora Scientific's Dynamic Muscle Control (DMC): stimulated muscles, in volts.

A header tells the sample frequency, references, a calibration of each channel, and the protocol; then come samples
in V. A channel is (V + offset) x scale in its unit, as workloopR reads it (Baliga and Senthivasan, Journal of Open
Source Software, doi 10.21105/joss.01856; the files shipped with it are of DMC 5.3). ``Stim`` is 1 while there is a
pulse.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.readers.base import Pending, Reader, Recording, Signal, begin_of
from xb_muscle_ros.trials.readers.contents import Contents
from xb_muscle_ros.trials.readers.ddf_header import BEGIN, NEEDED, SAMPLE, SCALE, DdfHeader, read_header
from xb_muscle_ros.trials.readers.description import ImportMapping, filled
from xb_muscle_ros.trials.readers.header import reference_warning, told_keys, with_facts
from xb_muscle_ros.trials.readers.lines import Rows, read_lines, read_rows
from xb_muscle_ros.trials.readers.named_columns import NamedColumn, column_of, contents_of, signals_of
from xb_muscle_ros.trials.trial import Array

_LENGTH, _FORCE, _STIM = "Reference Length", "Reference Force", "Stim"
# The motor is at rest at the begin; a change of length counts from its mean position then, s.
_REST_S = 0.01
_MOST_STEPS = 12


class DdfReader(Reader):
    """One trial to a file; the folder is the muscle.

    Channels go by their names (AI0 is the length, AI1 the force, as the software has them); lengths come in m, forces
    in N. Length is the motor's change of position from the begin, L0 the header's reference length, F0 its reference
    force. ``Stim`` becomes calcium where the mapping has an activation without times.
    """

    name = "ddf"
    suffixes = (".ddf",)
    defaults: Mapping[str, Any] = {
        "fibre": "{folder}",
        "columns": {
            "time": {"column": SAMPLE, "unit": "s"},
            "length": {"column": "AI0", "unit": "m", "is": "change"},
            "force": {"column": "AI1", "unit": "N"},
        },
    }
    in_header = ("f0", "reference_length")
    takes = ("decimal", "gear_ratio")

    def defaults_for(self, told: Mapping[str, Any]) -> Mapping[str, Any]:
        """With the record of stimulation where the mapping has a use for it."""
        activation = told.get("activation")
        if not isinstance(activation, Mapping) or activation.get("begin") is not None:
            return self.defaults
        columns = {**self.defaults["columns"], "stimulation": {"column": _STIM, "unit": "1"}}
        return {**self.defaults, "columns": columns}

    def matches(self, path: Path) -> bool:
        """Whether the file is called so or begins like one."""
        return super().matches(path) or BEGIN.match(begin_of(path)) is not None

    def completed(self, path: Path, mapping: ImportMapping) -> ImportMapping:
        """L0 and F0 by the references of the header."""
        header = read_header(path, read_lines(path, NEEDED))
        return with_facts(path, mapping, (_LENGTH, header.amount(_LENGTH)), (_FORCE, header.amount(_FORCE)))

    def trials(self, path: Path, mapping: ImportMapping) -> Iterator[Pending]:
        """The one trial of the file."""
        yield Pending(filled(mapping.trial, path), lambda: _recording(path, mapping))

    def contents(self, path: Path) -> Contents:
        """All channels, those with a calibration in their units, and what the header tells."""
        text = read_lines(path, NEEDED)
        header = read_header(path, text)
        rows, ending = _without_zeros(header, read_rows(path, text, header.first, header.names))
        signals = contents_of(_named(header, rows), self.defaults, rows.at)
        notes = (*rows.notices, *((ending,) if ending else ()))
        told = told_keys(header.amount(_LENGTH), header.amount(_FORCE))
        others = tuple(_notes(header, ""))
        return Contents("Aurora DMC", signals, facts=header.facts, others=others, notes=notes, in_header=told)


def _named(header: DdfHeader, rows: Rows) -> dict[str, NamedColumn]:
    return {
        name: NamedColumn(rows.values[:, 0] / header.rate_hz, "s") if i == 0 else _channel(header, name, rows, i)
        for i, name in enumerate(header.names)
    }


def _recording(path: Path, mapping: ImportMapping) -> Recording:
    text = read_lines(path, NEEDED)
    header = read_header(path, text)
    rows, ending = _without_zeros(header, read_rows(path, text, header.first, header.names, mapping.table.decimal))
    columns = _named(header, rows)
    for key, column in mapping.columns.items():
        used = column_of(path, columns, column, key)
        if key in ("length", "force") and used.unit and header.channels[_name(column.name, header)].scale == 0.0:
            raise UserError(
                f"{path}: {SCALE} of {column.name} is 0 in the header, so its volts have no meaning; name another "
                f"channel as columns.{key}.column, or mend the header"
            )
    signals = signals_of(path, mapping, columns, rows.at)
    notes = list(_notes(header, ending))
    if mapping.length_is_change:
        signals["length"], rest = _from_rest(signals["length"], header)
        notes.append(
            f"length is the change from its mean over the first {1e3 * _REST_S:g} ms, {rest:.6g} "
            f"{mapping.length.unit_name} as recorded"
        )
    if mapping.gear_ratio is not None:
        notes.append(f"gear ratio {mapping.gear_ratio:g}: length divided by it, force multiplied with it")
        for key, factor in (("length", 1.0 / mapping.gear_ratio), ("force", mapping.gear_ratio)):
            if key in signals:
                signals[key] = replace(signals[key], values=signals[key].values * factor)
    facts = mapping.facts_of(path)
    return Recording(
        str(path),
        filled(mapping.trial, path),
        signals,
        facts,
        tuple(notes),
        (
            *rows.notices,
            *_of_calibration(header, mapping),
            *reference_warning(path, mapping, _LENGTH, header.amount(_LENGTH)),
            *_of_stimulation(header, mapping, columns, facts["pca"]),
        ),
    )


def _name(column: str, header: DdfHeader) -> str:
    """The channel a mapping names, with or without its unit."""
    return column if column in header.channels else column.partition(" (")[0]


def _channel(header: DdfHeader, name: str, rows: Rows, i: int) -> NamedColumn:
    found = header.channels.get(name)
    if found is None:
        return NamedColumn(rows.values[:, i], "1" if name == _STIM else "")
    return NamedColumn((rows.values[:, i] + found.offset_v) * found.scale, found.unit)


def _without_zeros(header: DdfHeader, rows: Rows) -> tuple[Rows, str]:
    """Rows without the last one where that holds zeros alone, as DMC ends its files, and a note on it."""
    zero = ~rows.values[:, 1:].any(axis=1)
    if len(header.names) < 2 or len(rows.lines) < 2 or not zero[-1] or zero[:-1].all() or zero[-2]:
        return rows, ""
    kept = Rows(rows.values[:-1], rows.lines[:-1], rows.notices)
    return kept, f"the row of zeros in line {rows.lines[-1]}, which ends the file, is no sample and is left out"


def _from_rest(length: Signal, header: DdfHeader) -> tuple[Signal, float]:
    first = length.values[: max(1, round(_REST_S * header.rate_hz))]
    # Samples that are no numbers are refused at their own place.
    rest = float(np.mean(first[np.isfinite(first)])) if np.isfinite(first).any() else 0.0
    return replace(length, values=length.values - rest), rest


def _of_calibration(header: DdfHeader, mapping: ImportMapping) -> Iterator[str]:
    """Numbers of the calibration whose meaning is not the same in every description of the format."""
    for key in ("length", "force"):
        column = mapping.columns.get(key)
        found = None if column is None else header.channels.get(_name(column.name, header))
        if found is None or column is None:
            continue
        if found.offset_v and not (key == "length" and mapping.length_is_change):
            yield (
                f"{header.path}: {column.name} has an offset of {found.offset_v:g} V in the header; it is added before "
                f"scaling, so {key} moves by {found.offset_v * found.scale:.6g} {found.unit}; check zero {key}"
            )
        if found.tad:
            yield f"{header.path}: {column.name} has a TAD of {found.tad:g} in the header; it is not used"


def _of_stimulation(
    header: DdfHeader, mapping: ImportMapping, columns: Mapping[str, NamedColumn], pca: float | None
) -> tuple[str, ...]:
    """A line where pulses are recorded and calcium does not follow them.

    Raises:
        UserError: there are pulses, and nothing tells calcium.
    """
    if _STIM not in columns or mapping.activation is not None or mapping.calcium is not None:
        return ()
    on = np.flatnonzero(columns[_STIM].values > 0.5)
    if not on.size:
        return ()
    time_s: Array = columns[SAMPLE].values
    when = f"{header.path}: {_STIM} has pulses from {time_s[on[0]]:.6g} to {time_s[on[-1]]:.6g} s"
    if pca is None:
        raise UserError(
            f"{when}, and nothing makes calcium of them; give 'activation: {{rest: 0.05 uM, tetanus: 8 uM, "
            "rise: 50 ms, decay: 30 ms}' with the muscle's own numbers in the mapping, or a constant --pca"
        )
    return (f"{when}; pCa is given as {pca:g} for all of the trial, so they are not used",)


def _notes(header: DdfHeader, ending: str) -> Iterator[str]:
    area = header.amount("Reference Area")
    known = area is not None and np.isfinite(area.value) and area.value > 0.0
    yield "Aurora DMC record" + (f" (cross-section {header.facts['Reference Area']})" if known else "")
    if header.comment:
        yield f"comment: {header.comment}"
    if header.protocol:
        more = len(header.protocol) - _MOST_STEPS
        yield f"protocol (wait in s, action): {', then '.join(header.protocol[:_MOST_STEPS])}" + (
            f", and {more} more" if more > 0 else ""
        )
    if ending:
        yield ending
