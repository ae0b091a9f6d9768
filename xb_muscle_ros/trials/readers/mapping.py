"""How the columns of a data set's files map to a trial: a small YAML file, or options of the command line.

Every key is checked; one that is not known is answered with the nearest that is.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

import yaml

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.readers.columns import BAG, FILE, Columns, read_columns
from xb_muscle_ros.trials.readers.description import FACTS, Activation, ImportMapping, finite
from xb_muscle_ros.trials.readers.numerals import DECIMALS
from xb_muscle_ros.trials.readers.stimulus import read_activation
from xb_muscle_ros.trials.readers.tree import check_keys, choice_at, subtree, text_at, words_at
from xb_muscle_ros.trials.readers.units import Quantity, quantity

__all__ = ["BAG", "FILE", "FIRST_ISOMETRIC", "ImportMapping", "build_mapping", "load_mapping"]

FIRST_ISOMETRIC = "first_isometric"
_TOP = (
    *(
        "fibre",
        "trial",
        "data_set",
        "source",
        "decimal",
        "columns",
        "reference_length",
        "f0",
        "activation",
        "phases",
        "file_name",
    ),
    *("isometric_scaling", *FACTS),
)


# Beyond these it is no muscle's F0, or its unit is wrong: a myofibril to the largest muscles, weak to strong.
F0_RANGES = {"force": (1e-9, 1e5, "N"), "stress": (1e3, 2e6, "Pa")}


def load_mapping(path: Path) -> dict[str, Any]:
    """The tree of a mapping file, not yet checked.

    Raises:
        UserError: the file is missing, no YAML, or no mapping.
    """
    try:
        tree = yaml.safe_load(path.read_text(encoding="utf-8"))
    except OSError as problem:
        raise UserError(f"mapping {path} cannot be read: {problem.strerror}; give a YAML file") from problem
    except (yaml.YAMLError, UnicodeDecodeError) as problem:
        raise UserError(f"mapping {path} is malformed YAML: {problem}") from problem
    return subtree(tree, "the file", f"mapping {path}")


def build_mapping(tree: Mapping[str, Any], where: str, kind: str = FILE) -> ImportMapping:
    """Check a tree of keys and make a mapping of it.

    Args:
        tree: as a mapping file has it, without ``per_file`` and ``format``.
        where: the mapping file, for messages.
        kind: `FILE` where signals are columns or channels, `BAG` where they are topics.

    Raises:
        UserError: an unknown or missing key, an unknown unit, or a value that is not allowed.
    """
    check_keys(tree, _TOP, "", where)
    fibre = text_at(
        tree, "fibre", where, needed="name the fibre, for example 'fibre: 18Dec2017a' or --fiber 18Dec2017a"
    )
    columns = read_columns(subtree(tree.get("columns", {}), "columns", where), where, kind)
    scaling = subtree(tree.get("isometric_scaling", {}), "isometric_scaling", where)
    check_keys(scaling, ("source", "fractions_f0"), "isometric_scaling.", where)
    file_name, factors = _file_name(subtree(tree.get("file_name", {}), "file_name", where), where)
    reference = str(tree.get("reference_length", FIRST_ISOMETRIC))
    facts = {name: finite(tree[name], name, where) for name in FACTS if name in tree}
    f0, f0_at_pca = _f0(tree, where)
    phases = subtree(tree.get("phases", {}), "phases", where)
    check_keys(phases, ("servo_give",), "phases.", where)
    give = phases.get("servo_give")
    activation = tree.get("activation")
    made = ImportMapping(
        where=where,
        fibre=fibre,
        data_set=_name(tree, "data_set", fibre, where),
        source=words_at(tree, "source"),
        time=columns.time,
        length=columns.length,
        force=columns.force,
        calcium=columns.calcium,
        stimulation=columns.stimulation,
        length_is_change=columns.length_is_change,
        length_of=columns.length_of,
        trial_column=columns.trial_column,
        rate_hz=columns.rate_hz,
        decimal=choice_at(tree, "decimal", DECIMALS, "", where) if "decimal" in tree else None,
        at_reference=columns.at_reference,
        largest_step_s=columns.largest_step_s,
        force_zero_from_slack=columns.force_zero_from_slack,
        activation=None if activation is None else read_activation(subtree(activation, "activation", where), where),
        trial=_name(tree, "trial", "{file}", where),
        reference_length=None
        if reference == FIRST_ISOMETRIC
        else quantity(reference, "length", "reference_length", where),
        servo_give=None if give is None else quantity(str(give), "length", "phases.servo_give", where, "0.4 mm"),
        f0=f0,
        f0_at_pca=f0_at_pca,
        file_name=file_name,
        factors=factors,
        isometric_fractions=_fractions(scaling, where),
        isometric_source=words_at(scaling, "source"),
        pca=facts.get("pca"),
        amplitude_l0=facts.get("amplitude_l0"),
        recovery_s=facts.get("recovery_s"),
    )
    _check_length(made)
    _check_force(made)
    _check_calcium(made, columns, made.activation)
    return made


def _name(tree: Mapping[str, Any], key: str, default: str, where: str) -> str:
    return text_at(tree, key, where, needed="give a name, or leave it out") if key in tree else default


def _check_length(made: ImportMapping) -> None:
    """What single keys cannot tell: units that need a reference."""
    where, length = made.where, made.length
    relative = length.unit.kind == "relative length"
    if relative and made.reference_length is not None:
        raise UserError(f"{where}: lengths are in {length.unit_name}, so reference_length has no use; leave it out")
    if (made.length_is_change or made.at_reference is not None) and not relative and made.reference_length is None:
        what = f"a change in {length.unit_name}" if made.length_is_change else "that of more than the fibre"
        raise UserError(
            f"{where}: the length column holds {what}, so the reference length has to be "
            "given, for example 'reference_length: 42.8 mm' or --reference-length '42.8 mm'"
        )
    if made.at_reference is not None and (made.length_is_change or made.length_of != "fibre"):
        raise UserError(f"{where}: columns.length.at_reference fits neither changes nor sarcomeres; leave it out")
    if made.reference_length is not None and made.reference_length.kind != "length":
        raise UserError(f"{where}: reference_length has to be a length such as '42.8 mm'")
    if made.servo_give is not None and made.servo_give.kind != length.unit.kind:
        raise UserError(f"{where}: phases.servo_give has to be a {length.unit.kind}, as the length column is")


def _check_force(made: ImportMapping) -> None:
    where, force = made.where, made.force
    if force is None or force.unit.kind == "relative force":
        if made.f0 is not None or made.f0_at_pca is not None:
            why = "there is no force column" if force is None else f"forces are in {force.unit_name}"
            raise UserError(f"{where}: {why}, so f0 has no use; leave it out")
        return
    if made.f0_at_pca is not None:
        return
    if made.f0 is None:
        unit = force.unit_name
        raise UserError(
            f"{where}: forces are in {unit}, so f0 is needed, for example 'f0: 100 {unit}' or --f0 '100 {unit}'"
        )
    if made.f0.kind != force.unit.kind:
        raise UserError(
            f"{where}: f0 is a {made.f0.kind}, the force column a {force.unit.kind}; give f0 in {force.unit_name}"
        )
    low, high, unit = F0_RANGES[made.f0.kind]
    if not low <= made.f0.value <= high:
        raise UserError(
            f"{where}: f0 is {made.f0.value:g} {unit}; allowed is {low:g} to {high:g} {unit}; is its unit right?"
        )


def _check_calcium(made: ImportMapping, columns: Columns, activation: Activation | None) -> None:
    where = made.where
    if columns.stimulation is not None and activation is None:
        raise UserError(
            f"{where}: columns.stimulation needs activation, which makes calcium of it; give its rest, tetanus, rise "
            "and decay"
        )
    if activation is None:
        return
    if (columns.stimulation is None) == (activation.begin_s is None):
        what = "both tell" if columns.stimulation is not None else "neither tells"
        raise UserError(
            f"{where}: columns.stimulation and activation.begin: {what} when there is stimulation; exactly one has to"
        )
    if activation.begin_s is not None and activation.end_s is None and made.force is None:
        raise UserError(f"{where}: activation.end is force_drop, but there is no force column; give the time it ends")
    by_name = made.file_name is not None and "pca" in made.file_name.groupindex
    if columns.calcium is not None or made.pca is not None or by_name:
        raise UserError(
            f"{where}: calcium comes from stimulation, so a calcium column and pCa have no use; leave them out"
        )


def _f0(tree: Mapping[str, Any], where: str) -> tuple[Quantity | None, float | None]:
    if tree.get("f0") is None:
        return None, None
    if not isinstance(tree["f0"], dict):
        return quantity(str(tree["f0"]), "force", "f0", where, "100 kPa"), None
    check_keys(tree["f0"], ("isometric_at_pca",), "f0.", where)
    return None, finite(tree["f0"].get("isometric_at_pca"), "f0.isometric_at_pca", where)


def _file_name(tree: Mapping[str, Any], where: str) -> tuple[re.Pattern[str] | None, Mapping[str, float]]:
    check_keys(tree, ("pattern", "factors"), "file_name.", where)
    if not tree:
        return None, {}
    text = text_at(tree, "pattern", f"{where}: file_name", needed="give a regular expression")
    try:
        pattern = re.compile(text)
    except re.error as problem:
        raise UserError(f"{where}: file_name.pattern '{text}' is no regular expression: {problem}") from problem
    check_keys(pattern.groupindex, FACTS, "group in file_name.pattern: ", where)
    factors = subtree(tree.get("factors", {}), "file_name.factors", where)
    check_keys(factors, tuple(pattern.groupindex), "file_name.factors.", where)
    return pattern, {name: finite(value, f"file_name.factors.{name}", where) for name, value in factors.items()}


def _fractions(scaling: Mapping[str, Any], where: str) -> Mapping[float, float]:
    table = scaling.get("fractions_f0", {})
    if not isinstance(table, dict):
        raise UserError(
            f"{where}: isometric_scaling.fractions_f0 is {table!r}; needed is a table of pCa: fraction of F0"
        )
    what = "isometric_scaling.fractions_f0"
    fractions = {finite(pca, what, where): finite(fraction, what, where) for pca, fraction in table.items()}
    for pca, fraction in fractions.items():
        if not 0.0 < fraction <= 2.0:
            raise UserError(f"{where}: {what} at pCa {pca:g} is {fraction:g}; allowed is above 0 up to 2 F0")
    return MappingProxyType(fractions)
