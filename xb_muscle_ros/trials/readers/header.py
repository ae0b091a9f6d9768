"""What a file tells of itself, put where the mapping tells nothing: units, L0 and F0, pCa."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.readers.base import Signal
from xb_muscle_ros.trials.readers.calcium import SAME_PCA, pcas_in
from xb_muscle_ros.trials.readers.description import Column, ImportMapping, name_of
from xb_muscle_ros.trials.readers.lines import Amount
from xb_muscle_ros.trials.readers.mapping import f0_faults
from xb_muscle_ros.trials.readers.units import KINDS, UNITS, Quantity, calibration, unit_in, unit_of, volts_of

PREFIX = "columns."


def scaled(signal: Signal, key: str, unit: str, column: Column, mapping: ImportMapping, path: Path) -> Signal:
    """A signal in the unit of the mapping, from that of the file.

    Args:
        signal: in the unit of the file.
        key: ``time``, ``length``, ``force`` or ``stimulation``.
        unit: as the file has it; empty where it has none.
        column: of the mapping. A unit the mapping itself tells is that of a file that has none, or one that is not
            known.

    Raises:
        UserError: neither tells a unit that is known, or they tell different ones.
    """
    told = f"{PREFIX}{key}.unit" in mapping.own_keys
    known = [name for name, each in UNITS.items() if each.kind in KINDS[key]]
    if unit_in(unit, key) is None:
        if told:
            return signal
        found = f"is in '{unit}', which is no known unit of {key}" if unit else "has no unit"
        remedy = f"give it as {PREFIX}{key}.unit" + (f" or --{key}-unit" if key != "stimulation" else "")
        if volts := volts_of(unit, key):
            remedy += f", as {calibration(key, volts)}"
        raise UserError(f"{path}, {signal.name} {found}; known: {', '.join(known)}; {remedy}, or name another column")
    plain = unit_in(unit, key) or unit
    own = unit_of(plain, key, str(path))
    if not told and own.kind != column.unit.kind:
        raise UserError(
            f"{path}, {signal.name} is in {unit} by the file, which is a {own.kind}; give it as {PREFIX}{key}.unit or "
            f"--{key}-unit {plain}"
        )
    if told and column.unit != own:
        raise UserError(
            f"{path}, {signal.name} is in {unit} by the file, in {column.unit_name} by {mapping.where}; leave "
            f"{PREFIX}{key}.unit out, or mend the file"
        )
    return replace(signal, values=signal.values * (own.factor / column.unit.factor))


def is_told(found: Amount | None) -> bool:
    """Whether a header tells an amount: a number above 0; 0 and NaN stand for what was not entered."""
    return found is not None and math.isfinite(found.value) and found.value > 0.0


def told_keys(reference: Amount | None, f0: Amount | None) -> tuple[str, ...]:
    """Keys of a mapping that a header tells, by its amounts."""
    return tuple(key for key, found in (("reference_length", reference), ("f0", f0)) if is_told(found))


def with_facts(
    path: Path, mapping: ImportMapping, reference: tuple[str, Amount | None], f0: tuple[str, Amount | None]
) -> ImportMapping:
    """The mapping with L0 and F0 of a header, where the mapping tells none itself.

    Args:
        reference, f0: name in the header, and what is there; None where it is not.

    Raises:
        UserError: a unit that is not known, F0 that no muscle has, or neither header nor mapping tells what is needed.
    """
    name, length = reference
    if "reference_length" not in mapping.own_keys and mapping.length_of == "fibre":
        if length is not None and is_told(length):
            found = Quantity(length.value * unit_of(length.unit, "length", f"{path}: {name}").factor, "length")
            mapping = replace(mapping, reference_length=found, reference_note=f"{name} of the header")
        elif mapping.length.unit.kind == "length" and (mapping.length_is_change or mapping.at_reference is not None):
            raise UserError(
                f"{path}: {_missing(name, length)}, and the length column holds a change, so the reference length has "
                "to be given, for example 'reference_length: 42.8 mm' or --reference-length '42.8 mm'"
            )
    name, force = f0
    if mapping.force is None or "f0" in mapping.own_keys:
        return mapping
    if force is None or not is_told(force):
        if mapping.force.unit.kind == "relative force":
            return mapping
        raise UserError(f"{path}: {_missing(name, force)}, so f0 is needed, for example 'f0: 100 mN' or --f0 '100 mN'")
    unit = unit_of(force.unit, "force", f"{path}: {name}")
    given = Quantity(force.value * unit.factor, unit.kind)
    if mapping.force.unit.kind == "relative force" and given.kind != "force":
        return mapping
    for fault in f0_faults(given, mapping.force):
        raise UserError(f"{path}: {name} of the header: {fault}")
    return replace(mapping, f0=given, f0_note=f", {name} of the header")


def _missing(name: str, found: Amount | None) -> str:
    if found is None:
        return f"the header has no {name}"
    return f"{name} in the header is {'NaN' if math.isnan(found.value) else f'{found.value:g}'}"


def reference_warning(path: Path, mapping: ImportMapping, name: str, found: Amount | None) -> tuple[str, ...]:
    """A line where L0 is taken from the record because the header does not tell it."""
    if (
        mapping.reference_length is not None
        or "reference_length" in mapping.own_keys
        or mapping.length.unit.kind != "length"
        or mapping.length_of != "fibre"
    ):
        return ()
    return (
        f"{path}: {_missing(name, found)}; L0 is the length before its first change; give --reference-length if it is "
        "another",
    )


def pca_of(path: Path, mapping: ImportMapping, comment: str) -> tuple[float | None, str]:
    """The pCa by the mapping, or else by the header's comment or the file's name, and where the latter was found.

    Raises:
        UserError: comment and name tell different ones.
    """
    pca = mapping.facts_of(path)["pca"]
    if pca is not None or mapping.calcium is not None or mapping.activation is not None:
        return pca, ""
    told = {"comment of the header": pcas_in(comment), "file name": pcas_in(name_of(path))}
    single = {where: found[0] for where, found in told.items() if len(found) == 1}
    values = list(single.values())
    if len(values) == 2 and abs(values[0] - values[1]) > SAME_PCA:
        raise UserError(
            f"{path}: the comment of the header says pCa {values[0]:g}, the file name {values[1]:g}; give the right "
            "one with --pca, or per_file in the mapping"
        )
    return (values[0], f"pCa {values[0]:g} by the {' and the '.join(single)}") if single else (None, "")
