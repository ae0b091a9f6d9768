"""The signals of a mapping: the ``columns``, where each is, and its unit, and ``activation``, which makes calcium."""

from __future__ import annotations

import math

from xb_muscle_ros.errors import UserError, naming
from xb_muscle_ros.trials.activation import CalciumTransient
from xb_muscle_ros.trials.readers.description import FACTS, Activation, Column, Stimulation
from xb_muscle_ros.trials.readers.side_by_side import TRIAL
from xb_muscle_ros.trials.readers.tree import Keys, check_keys
from xb_muscle_ros.trials.readers.units import Unit, number_and_unit, quantity, unit_of

FILE = "file"
BAG = "bag"

# Signals, and what a mapping may tell of each beside where it is and its unit.
SIGNALS = {
    "time": ("largest_step", "rate"),
    "length": ("is", "of", "at_reference"),
    "force": ("zero",),
    "calcium": (),
    "stimulation": ("threshold", "pulse_gap"),
}
_PLACE = {FILE: ("column",), BAG: ("topic", "field")}
_PULSE_GAP_S = 0.015
_SECONDS = Unit("time", 1.0)
NEVER = "never"
FORCE_DROP = "force_drop"
_CONSTANTS = {"rest": "0.05 uM", "tetanus": "8 uM", "rise": "50 ms", "decay": "30 ms"}


def read_column(columns: Keys, key: str, kind: str) -> Column:
    """Where a signal is.

    Args:
        columns: signals by name.
        key: the signal, one of `SIGNALS`.
        kind: `FILE` where signals are columns or channels, `BAG` where they are topics.

    Raises:
        UserError: an unknown or missing key, or an unknown unit.
    """
    if key not in columns:
        more = ", or give its rate" if key == "time" else ""
        raise UserError(f"{columns.where}: columns.{key} is missing; name the column and its unit{more}")
    place = _PLACE[kind][0]
    if key == "time" and kind == BAG:
        return Column(columns.below(key, "stamp", "largest_step").choice("stamp", "header", "log"), "s", _SECONDS)
    by_pattern = ("pattern", "factors") if kind == FILE else ()
    keys = columns.below(key, *_PLACE[kind], *by_pattern, "unit", *SIGNALS[key])
    if key == "time" and "rate" in keys:
        if "column" in keys or "pattern" in keys:
            raise UserError(
                f"{keys.where}: columns.time has a column and a rate; the column tells the times, leave one out"
            )
        return Column(f"time at {keys.values['rate']}", "s", _SECONDS)
    if "pattern" in keys:
        return _by_pattern(keys, key)
    name = keys.text(place, f"name the {place}")
    field = keys.text("field", f"name the field of {name}, for example position[0]") if kind == BAG else ""
    unit_name = keys.text("unit", f"give the unit of {place} '{name}'")
    return Column(name, unit_name, unit_of(unit_name, key, keys.where), field)


def _by_pattern(keys: Keys, key: str) -> Column:
    """A signal with a column for each trial."""
    if "column" in keys:
        raise UserError(f"{keys.where}: {keys.path} has a column and a pattern; leave one out")
    pattern = keys.pattern("pattern", "give a regular expression of column names")
    groups = tuple(pattern.groupindex)
    check_keys(groups, (TRIAL, *FACTS), f"group in {keys.path}.pattern: ", keys.where)
    if not groups:
        raise UserError(
            f"{keys.where}: {keys.path}.pattern is '{pattern.pattern}', which has no named group; needed is one that "
            "tells trials apart, for example 'F_(?P<trial>.+)' or 'F_pCa(?P<pca>.+)'"
        )
    factors = keys.below("factors")
    check_keys(factors.values, [name for name in groups if name in FACTS], f"{keys.path}.factors.", keys.where)
    unit_name = keys.text("unit", f"give the unit of the columns '{pattern.pattern}'")
    unit = unit_of(unit_name, key, keys.where)
    numbers = {name: factors.number(name) for name in factors.values}
    return Column(pattern.pattern, unit_name, unit, pattern=pattern, factors=numbers)


def optional_column(columns: Keys, key: str, kind: str) -> Column | None:
    """Where a signal is that may be there; see `read_column`."""
    return read_column(columns, key, kind) if key in columns else None


def read_stimulation(columns: Keys, kind: str) -> Stimulation | None:
    """Where stimulation is, if anywhere, and how it is told from rest; see `read_column`."""
    column = optional_column(columns, "stimulation", kind)
    if column is None:
        return None
    keys = columns.below("stimulation")
    threshold = keys.number("threshold") if "threshold" in keys else 0.5
    gap_s = keys.amount("pulse_gap", "time", "15 ms", zero=True)
    return Stimulation(column, threshold * column.unit.factor, _PULSE_GAP_S if gap_s is None else gap_s)


def trial_column(columns: Keys, kind: str) -> str | None:
    """The column that tells trials apart, where one is named.

    Raises:
        UserError: it is of a bag, or has no name.
    """
    if "trial" not in columns:
        return None
    if kind == BAG:
        raise UserError(f"{columns.where}: columns.trial is for tables; a bag is one trial; leave it out")
    return columns.below("trial", "column").text("column", "name the column")


def read_activation(mapping: Keys) -> Activation | None:
    """The activation of a mapping, where it has one.

    Raises:
        UserError: an unknown or missing key, or a value that is not allowed.
    """
    if mapping.values.get("activation") is None:
        return None
    keys = mapping.below("activation", *_CONSTANTS, "source", "begin", "end")
    values = [_constant(keys, name, example) for name, example in _CONSTANTS.items()]
    with naming(keys.where):
        transient = CalciumTransient(*values)
    return Activation(transient, keys.line("source"), *_times(keys))


def _constant(keys: Keys, name: str, example: str) -> float:
    text = keys.text(name, f"give a value with its unit, for example '{example}'")
    found = quantity(text, "time" if example.endswith("ms") else "calcium", keys.name(name), keys.where, example)
    # pCa is a logarithm: quantity leaves it alone.
    return 10.0 ** (6.0 - number_and_unit(text)[0]) if found.kind == "pCa" else found.value


def _times(keys: Keys) -> tuple[float | None, float | None]:
    begin, end = keys.values.get("begin"), keys.values.get("end")
    if begin is None:
        if end is not None:
            raise UserError(f"{keys.where}: activation.end needs activation.begin, for example 'begin: 1 s'")
        return None, None
    if begin == NEVER:
        return math.inf, math.inf
    begin_s = keys.amount("begin", "time", "1 s", zero=True)
    if end is None:
        raise UserError(f"{keys.where}: activation.end is missing; give a time such as '2 s', or {FORCE_DROP}")
    if end == FORCE_DROP:
        return begin_s, None
    end_s = keys.amount("end", "time", "2 s")
    if begin_s is not None and end_s is not None and end_s <= begin_s:
        raise UserError(
            f"{keys.where}: activation goes from {begin_s:g} to {end_s:g} s; its end has to come after its begin"
        )
    return begin_s, end_s
