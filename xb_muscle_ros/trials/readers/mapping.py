"""How the columns of a data set's files map to a trial: a small YAML file, or options of the command line.

Every key is checked; one that is not known is answered with the nearest that is.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import yaml

from xb_muscle_ros.errors import UserError, suggest
from xb_muscle_ros.trials.readers.units import Quantity, Unit, quantity, unit_of

FIRST_ISOMETRIC = "first_isometric"
FACTS = ("pca", "amplitude_l0", "recovery_s")
_TOP = ("fibre", "data_set", "source", "columns", "reference_length", "f0", "file_name", "isometric_scaling", *FACTS)
_COLUMNS = {
    "time": ("column", "unit"),
    "length": ("column", "unit", "is", "of"),
    "force": ("column", "unit"),
    "calcium": ("column", "unit"),
}


class Column(NamedTuple):
    """A column of the file and the unit its numbers are in."""

    name: str
    unit_name: str
    unit: Unit


@dataclass(frozen=True)
class ImportMapping:
    """Everything that has to be known to make trials of a data set's files.

    Attributes:
        where: the mapping file or the command line, for messages.
        fibre: name of the fibre.
        data_set: begins the names of the bags; the fibre's name where it is not given.
        source: where the data come from, in words.
        time, length: columns every file has.
        force, calcium: columns a file may have.
        length_is_change: the length column holds the change from the reference length.
        half_sarcomere: the length column is that of a half-sarcomere, so lengths are stored relative to L0 = 1 m.
        reference_length: the length that is L0; None for the mean of the first isometric samples.
        f0: the force or stress that is F0.
        pca, amplitude_l0, recovery_s: facts that hold for every file (-log10 M, L0, s).
        file_name: finds facts in file names by its groups ``pca``, ``amplitude_l0``, ``recovery_s``.
        factors: what a number found in the file name is multiplied with.
        isometric_fractions: isometric force of the matching isometric trials by pCa, F0; may be empty.
        isometric_source: where these come from.
    """

    where: str
    fibre: str
    data_set: str
    source: str
    time: Column
    length: Column
    force: Column | None = None
    calcium: Column | None = None
    length_is_change: bool = False
    half_sarcomere: bool = False
    reference_length: Quantity | None = None
    f0: Quantity | None = None
    pca: float | None = None
    amplitude_l0: float | None = None
    recovery_s: float | None = None
    file_name: re.Pattern[str] | None = None
    factors: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))
    isometric_fractions: Mapping[float, float] = field(default_factory=lambda: MappingProxyType({}))
    isometric_source: str = ""

    def facts_of(self, path: Path) -> dict[str, float | None]:
        """pCa, amplitude (L0) and recovery (s) of one file; what its name tells goes before what holds for all.

        Raises:
            UserError: the file name does not match the pattern.
        """
        facts: dict[str, float | None] = {name: getattr(self, name) for name in FACTS}
        if self.file_name is not None:
            match = self.file_name.search(path.stem)
            if match is None:
                raise UserError(
                    f"{path}: the file name does not match '{self.file_name.pattern}' of {self.where}; "
                    "use the mapping made for this file"
                )
            for name, text in match.groupdict().items():
                if text is not None:
                    # 12 digits, so that 61 tenths are 6.1
                    facts[name] = float(f"{_finite(text, name, str(path)) * self.factors.get(name, 1.0):.12g}")
        return facts


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
    return _tree(tree, "the file", f"mapping {path}")


def build_mapping(tree: Mapping[str, Any], where: str) -> ImportMapping:
    """Check a tree of keys and make a mapping of it.

    Raises:
        UserError: an unknown or missing key, an unknown unit, or a value that is not allowed.
    """
    _known(tree, _TOP, "", where)
    columns = _tree(tree.get("columns", {}), "columns", where)
    _known(columns, _COLUMNS, "columns.", where)
    length = _tree(columns.get("length", {}), "columns.length", where)
    fibre = _text(tree, "fibre", where, needed="name the fibre, for example 'fibre: 18Dec2017a' or --fiber 18Dec2017a")
    scaling = _tree(tree.get("isometric_scaling", {}), "isometric_scaling", where)
    _known(scaling, ("source", "fractions_f0"), "isometric_scaling.", where)
    file_name, factors = _file_name(_tree(tree.get("file_name", {}), "file_name", where), where)
    reference = str(tree.get("reference_length", FIRST_ISOMETRIC))
    facts = {name: _finite(tree[name], name, where) for name in FACTS if name in tree}
    made = ImportMapping(
        where=where,
        fibre=fibre,
        data_set=str(tree.get("data_set", fibre)),
        source=" ".join(str(tree.get("source", "")).split()),
        time=_column(columns, "time", where),
        length=_column(columns, "length", where),
        force=_column(columns, "force", where) if "force" in columns else None,
        calcium=_column(columns, "calcium", where) if "calcium" in columns else None,
        length_is_change=_choice(length, "is", ("absolute", "change"), where) == "change",
        half_sarcomere=_choice(length, "of", ("fibre", "half_sarcomere"), where) == "half_sarcomere",
        reference_length=None
        if reference == FIRST_ISOMETRIC
        else quantity(reference, "length", "reference_length", where),
        f0=quantity(str(tree["f0"]), "force", "f0", where) if "f0" in tree else None,
        file_name=file_name,
        factors=factors,
        isometric_fractions=_fractions(scaling, where),
        isometric_source=" ".join(str(scaling.get("source", "")).split()),
        **facts,
    )
    _check_together(made)
    return made


def _check_together(made: ImportMapping) -> None:
    """What single keys cannot tell: units that need a reference."""
    where, force, length = made.where, made.force, made.length
    relative = length.unit.kind == "relative length"
    if relative and made.reference_length is not None:
        raise UserError(f"{where}: lengths are in {length.unit_name}, so reference_length has no use; leave it out")
    if made.length_is_change and not relative and made.reference_length is None:
        raise UserError(
            f"{where}: the length column holds a change in {length.unit_name}, so the reference length has to be "
            "given, for example 'reference_length: 42.8 mm' or --reference-length '42.8 mm'"
        )
    if made.reference_length is not None and made.reference_length.kind != "length":
        raise UserError(f"{where}: reference_length has to be a length such as '42.8 mm'")
    if force is None or force.unit.kind == "relative force":
        if made.f0 is not None:
            why = "there is no force column" if force is None else f"forces are in {force.unit_name}"
            raise UserError(f"{where}: {why}, so f0 has no use; leave it out")
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


def _column(columns: Mapping[str, Any], key: str, where: str) -> Column:
    if key not in columns:
        raise UserError(f"{where}: columns.{key} is missing; name the column and its unit")
    tree = _tree(columns[key], f"columns.{key}", where)
    _known(tree, _COLUMNS[key], f"columns.{key}.", where)
    name = _text(tree, "column", f"{where}: columns.{key}", needed="name the column of the file")
    unit_name = _text(tree, "unit", f"{where}: columns.{key}", needed=f"give the unit of column '{name}'")
    return Column(name, unit_name, unit_of(unit_name, key, where))


def _file_name(tree: Mapping[str, Any], where: str) -> tuple[re.Pattern[str] | None, Mapping[str, float]]:
    _known(tree, ("pattern", "factors"), "file_name.", where)
    if not tree:
        return None, {}
    text = _text(tree, "pattern", f"{where}: file_name", needed="give a regular expression")
    try:
        pattern = re.compile(text)
    except re.error as problem:
        raise UserError(f"{where}: file_name.pattern '{text}' is no regular expression: {problem}") from problem
    _known(pattern.groupindex, FACTS, "group in file_name.pattern: ", where)
    factors = _tree(tree.get("factors", {}), "file_name.factors", where)
    _known(factors, tuple(pattern.groupindex), "file_name.factors.", where)
    return pattern, {name: _finite(value, f"file_name.factors.{name}", where) for name, value in factors.items()}


def _fractions(scaling: Mapping[str, Any], where: str) -> Mapping[float, float]:
    table = scaling.get("fractions_f0", {})
    if not isinstance(table, dict):
        raise UserError(
            f"{where}: isometric_scaling.fractions_f0 is {table!r}; needed is a table of pCa: fraction of F0"
        )
    what = "isometric_scaling.fractions_f0"
    fractions = {_finite(pca, what, where): _finite(fraction, what, where) for pca, fraction in table.items()}
    for pca, fraction in fractions.items():
        if not 0.0 < fraction <= 2.0:
            raise UserError(f"{where}: {what} at pCa {pca:g} is {fraction:g}; allowed is above 0 up to 2 F0")
    return MappingProxyType(fractions)


def _known(tree: Mapping[str, Any], known: Any, prefix: str, where: str) -> None:
    for key in tree:
        if key not in known:
            raise UserError(f"{where}: unknown {prefix}{key}{suggest(str(key), known)}")


def _tree(value: Any, key: str, where: str) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise UserError(f"{where}: {key} is {value!r}; needed are keys with values")
    return value


def _text(tree: Mapping[str, Any], key: str, where: str, needed: str) -> str:
    value = tree.get(key)
    if value is None or not str(value).strip():
        raise UserError(f"{where}: {key} is missing; {needed}")
    return str(value)


def _choice(tree: Mapping[str, Any], key: str, allowed: tuple[str, ...], where: str) -> str:
    value = str(tree.get(key, allowed[0]))
    if value not in allowed:
        raise UserError(f"{where}: columns.length.{key} is '{value}'; allowed: {', '.join(allowed)}")
    return value


def _finite(value: Any, key: str, where: str) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = math.nan
    if not math.isfinite(number):
        raise UserError(f"{where}: {key} is {value!r}; needed is a finite number")
    return number
