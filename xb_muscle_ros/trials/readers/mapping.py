"""How the columns of a data set's files map to a trial: a small YAML file, or options of the command line.

Every key is checked; one that is not known is answered with the nearest that is.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import Any

import yaml

from xb_muscle_ros import fast_yaml
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.mains import check_frequencies
from xb_muscle_ros.trials.readers.columns import (
    FILE,
    SIGNALS,
    optional_column,
    read_activation,
    read_column,
    read_stimulation,
    trial_column,
)
from xb_muscle_ros.trials.readers.description import FACTS, FIRST_ISOMETRIC, LENGTHS_OF, Column, ImportMapping
from xb_muscle_ros.trials.readers.options import TABLE_KEYS, read_options
from xb_muscle_ros.trials.readers.tree import Keys, check_keys
from xb_muscle_ros.trials.readers.units import Quantity, finite, reading

_NAMES = ("fibre", "trial", "data_set", "source")
_PARTS = (
    "columns",
    "reference_length",
    "f0",
    "gear_ratio",
    "activation",
    "phases",
    "file_name",
    "isometric_scaling",
    "notch",
)
# Beyond these it is no muscle's F0, or its unit is wrong: a myofibril to the largest muscles, weak to strong.
F0_RANGES = {"force": (1e-9, 1e5, "N"), "stress": (1e3, 2e6, "Pa")}


def load_mapping(path: Path) -> dict[str, Any]:
    """The tree of a mapping file, not yet checked.

    Raises:
        UserError: the file is missing, no YAML, or no mapping.
    """
    try:
        tree = fast_yaml.load(path.read_text(encoding="utf-8"))
    except OSError as problem:
        raise UserError(f"mapping {path} cannot be read: {problem.strerror}; give a YAML file") from problem
    except (yaml.YAMLError, UnicodeDecodeError) as problem:
        raise UserError(f"mapping {path} is malformed YAML: {problem}") from problem
    if not isinstance(tree, dict):
        raise UserError(f"mapping {path}: the file is {tree!r}; needed are keys with values")
    return tree


def build_mapping(
    tree: Mapping[str, Any], where: str, kind: str = FILE, in_header: Collection[str] = ()
) -> ImportMapping:
    """Check a tree of keys and make a mapping of it.

    Args:
        tree: as a mapping file has it, without ``per_file`` and ``format``.
        kind: `FILE` where signals are columns or channels, `BAG` where they are topics.
        in_header: of ``f0`` and ``reference_length``, what files of the format may tell themselves.

    Raises:
        UserError: an unknown or missing key, an unknown unit, or a value that is not allowed.
    """
    keys = Keys(tree, where, known=(*_NAMES, *TABLE_KEYS, *_PARTS, *FACTS))
    fibre = keys.text("fibre", "name the fibre, for example 'fibre: 18Dec2017a' or --fiber 18Dec2017a")
    columns = keys.below("columns", *SIGNALS, "trial")
    time, length = read_column(columns, "time", kind), read_column(columns, "length", kind)
    length_keys, force = columns.below("length"), optional_column(columns, "force", kind)
    scaling = keys.below("isometric_scaling", "source", "fractions_f0")
    file_name, factors = _file_name(keys.below("file_name", "pattern", "factors"))
    from_start = keys.values.get("reference_length") == FIRST_ISOMETRIC
    f0_is_found = isinstance(keys.values.get("f0"), Mapping)
    made = ImportMapping(
        where=where,
        fibre=fibre,
        data_set=_name(keys, "data_set", fibre),
        source=keys.line("source"),
        time=time,
        length=length,
        force=force,
        calcium=optional_column(columns, "calcium", kind),
        stimulation=read_stimulation(columns, kind),
        activation=read_activation(keys),
        trial=_name(keys, "trial", "{file}"),
        trial_column=trial_column(columns, kind),
        table=read_options(keys, FACTS),
        rate_hz=columns.below("time").amount("rate", "rate", "1000 Hz"),
        length_is_change=length_keys.choice("is", "absolute", "change") == "change",
        length_of=length_keys.choice("of", *LENGTHS_OF),
        reference_length=None if from_start else keys.quantity("reference_length", "length", "42.8 mm"),
        at_reference=_at_reference(length_keys, length),
        largest_step_s=columns.below("time").amount("largest_step", "time", "0.5 s"),
        servo_give=keys.below("phases", "servo_give").quantity("servo_give", "length", "0.4 mm"),
        f0=None if f0_is_found else keys.quantity("f0", "force", "100 kPa"),
        f0_at_pca=keys.below("f0", "isometric_at_pca").number("isometric_at_pca") if f0_is_found else None,
        force_zero_from_slack=columns.below("force").values.get("zero") == "slack",
        force_zero=_force_zero(columns.below("force"), force),
        notch_hz=_notch(keys),
        facts={name: keys.number(name) for name in FACTS if name in keys},
        file_name=file_name,
        factors=factors,
        isometric_fractions=_fractions(scaling),
        isometric_source=scaling.line("source"),
        gear_ratio=_gear_ratio(keys),
    )
    if made.length.unit.per and "is" not in length_keys.values and made.at_reference is None:
        raise UserError(
            f"{where}: lengths are in volts, and what 0 V is does not show; give columns.length.is (--length-is) as "
            "'change', where 0 V is the reference length, or 'absolute', where it is no length at all, or give what "
            "the column reads at the reference length by columns.length.at_reference, for example '2.5 V'"
        )
    if from_start and length.unit.kind == "relative length":
        raise UserError(
            f"{where}: lengths are in {length.unit_name}, so 'reference_length: {FIRST_ISOMETRIC}' has no use; leave "
            "it out, or give how long one L0 is, for example '42.8 mm'"
        )
    units = (_length_faults(made, in_header), _force_faults(made, in_header))
    for fault in itertools.chain(*units, _calcium_faults(made), _pattern_faults(made)):
        raise UserError(f"{where}: {fault}")
    return made


def _at_reference(keys: Keys, length: Column) -> Quantity | None:
    text = keys.values.get("at_reference")
    if text is None or not length.unit.per:
        return keys.quantity("at_reference", "length", "42.5 mm")
    return reading(str(text), "length", length.unit, keys.name("at_reference"), keys.where, "2.5 V")


def _force_zero(keys: Keys, force: Column | None) -> Quantity | None:
    """What the column reads without force, where the mapping tells a number."""
    text = str(keys.values.get("zero", "as_recorded"))
    if text in ("as_recorded", "slack"):
        return None
    if force is None or not any(character.isdigit() for character in text):
        raise UserError(
            f"{keys.where}: {keys.name('zero')} is '{text}'; allowed: as_recorded, slack, or what the column reads "
            "without force, for example '0.12 V'"
        )
    found = reading(text, "force", force.unit, keys.name("zero"), keys.where, "0.02 mN")
    if found.kind != force.unit.kind:
        raise UserError(
            f"{keys.where}: {keys.name('zero')} is a {found.kind}, the force column a {force.unit.kind}; give it in "
            "the column's unit"
        )
    return found


def _notch(keys: Keys) -> tuple[float, ...]:
    told = keys.values.get("notch", [])
    each = told if isinstance(told, list) else [told]
    found = tuple(finite(hz, "notch", keys.where) for hz in each)
    check_frequencies(found, f"{keys.where}: notch")
    return found


def _name(keys: Keys, key: str, default: str) -> str:
    return keys.text(key, "give a name, or leave it out") if key in keys else default


def _gear_ratio(keys: Keys) -> float | None:
    if "gear_ratio" not in keys:
        return None
    ratio = keys.number("gear_ratio")
    if not 0.01 <= ratio <= 100.0:
        raise UserError(f"{keys.where}: gear_ratio is {ratio:g}; allowed is 0.01 to 100")
    return ratio


def _length_faults(made: ImportMapping, in_header: Collection[str]) -> Iterator[str]:
    """What single keys cannot tell: units that need a reference."""
    kind, unit, reference, at = made.length.unit.kind, made.length.unit_name, made.reference_length, made.at_reference
    relative = kind == "relative length"
    if at is not None and at.kind != kind:
        yield f"columns.length.at_reference has to be a {kind}, as the column is"
    if relative and reference is not None and made.length_of != "fibre":
        yield f"{made.length_of} lengths are in {unit}, so reference_length has no use; leave it out"
    unknown = reference is None and "reference_length" not in in_header
    if (made.length_is_change or at is not None) and not relative and unknown:
        what = f"a change in {unit}" if made.length_is_change else "that of more than the fibre"
        yield (
            f"the length column holds {what}, so the reference length has to be given, for example "
            "'reference_length: 42.8 mm' or --reference-length '42.8 mm'"
        )
    if at is not None and (made.length_is_change or made.length_of != "fibre"):
        yield "columns.length.at_reference fits neither changes nor sarcomeres; leave it out"
    if reference is not None and reference.kind != "length":
        yield "reference_length has to be a length such as '42.8 mm'"
    if made.servo_give is not None and made.servo_give.kind != kind:
        yield f"phases.servo_give has to be a {kind}, as the length column is"


def _force_faults(made: ImportMapping, in_header: Collection[str]) -> Iterator[str]:
    force, f0 = made.force, made.f0
    if force is None:
        if f0 is not None or made.f0_at_pca is not None:
            yield "there is no force column, so f0 has no use; leave it out"
        return
    unit, relative = force.unit_name, force.unit.kind == "relative force"
    if relative and made.f0_at_pca is not None:
        yield f"forces are in {unit}, so f0.isometric_at_pca has no use; leave it out, or give a force such as '0.9 mN'"
    if f0 is None:
        if not relative and made.f0_at_pca is None and "f0" not in in_header:
            yield f"forces are in {unit}, so f0 is needed, for example 'f0: 100 {unit}' or --f0 '100 {unit}'"
        return
    yield from f0_faults(f0, force)


def f0_faults(f0: Quantity, force: Column) -> Iterator[str]:
    """What is wrong with F0 for a column of force."""
    if force.unit.kind == "relative force" and f0.kind != "force":
        yield (
            f"forces are in {force.unit_name} and f0 is a {f0.kind}, which has no use; leave it out, or give the force "
            "that is F0, for example '0.9 mN'"
        )
        return
    if f0.kind != force.unit.kind and force.unit.kind != "relative force":
        yield f"f0 is a {f0.kind}, the force column a {force.unit.kind}; give f0 in {force.unit_name}"
        return
    low, high, unit = F0_RANGES[f0.kind]
    if not low <= f0.value <= high:
        yield f"f0 is {f0.value:g} {unit}; allowed is {low:g} to {high:g} {unit}; is its unit right?"


def _calcium_faults(made: ImportMapping) -> Iterator[str]:
    activation, stimulated = made.activation, made.stimulation is not None
    if activation is None:
        if stimulated:
            needed = "give its rest, tetanus, rise and decay"
            yield f"columns.stimulation needs activation, which makes calcium of it; {needed}"
        return
    if stimulated == (activation.begin_s is not None):
        what = "both tell" if stimulated else "neither tells"
        yield f"columns.stimulation and activation.begin: {what} when there is stimulation; exactly one has to"
    if activation.begin_s is not None and activation.end_s is None and made.force is None:
        yield "activation.end is force_drop, but there is no force column; give the time it ends"
    by_name = any("pca" in pattern.groupindex for pattern in made.patterns)
    if made.calcium is not None or "pca" in made.facts or by_name:
        yield "calcium comes from stimulation, so a calcium column and pCa have no use; leave them out"


def _pattern_faults(made: ImportMapping) -> Iterator[str]:
    """Facts that both the names of columns and something else tell."""
    columns = {key: column for key, column in made.columns.items() if column.pattern is not None}
    for key, column in columns.items():
        assert column.pattern is not None
        twice = next((fact for fact in column.pattern.groupindex if fact in made.facts), None)
        if twice is not None:
            yield f"columns.{key}.pattern tells {twice}, and it is given as well; leave one of them out"
        if "pca" in column.pattern.groupindex and made.calcium is not None:
            yield f"columns.{key}.pattern tells pca, and columns.calcium tells calcium; leave one of them out"
    sheets = made.table.sheets
    if sheets is not None and sheets.pattern is not None:
        twice = next((fact for fact in sheets.pattern.groupindex if fact in made.facts), None)
        if twice is not None:
            yield f"sheet.pattern tells {twice}, and it is given as well; leave one of them out"


def _file_name(keys: Keys) -> tuple[re.Pattern[str] | None, Mapping[str, float]]:
    if not keys.values:
        return None, {}
    pattern = keys.pattern("pattern", "give a regular expression")
    check_keys(pattern.groupindex, FACTS, "group in file_name.pattern: ", keys.where)
    factors = keys.below("factors")
    check_keys(factors.values, pattern.groupindex, "file_name.factors.", keys.where)
    return pattern, {name: factors.number(name) for name in factors.values}


def _fractions(scaling: Keys) -> Mapping[float, float]:
    table, what = scaling.values.get("fractions_f0", {}), "isometric_scaling.fractions_f0"
    if not isinstance(table, dict):
        raise UserError(f"{scaling.where}: {what} is {table!r}; needed is a table of pCa: fraction of F0")
    fractions = {finite(pca, what, scaling.where): finite(part, what, scaling.where) for pca, part in table.items()}
    for pca, fraction in fractions.items():
        if not 0.0 < fraction <= 2.0:
            raise UserError(f"{scaling.where}: {what} at pCa {pca:g} is {fraction:g}; allowed is above 0 up to 2 F0")
    return fractions
