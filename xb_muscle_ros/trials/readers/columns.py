"""The ``columns`` of a mapping: where each signal is, and its unit."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.readers.description import LENGTHS_OF, Column, Stimulation, finite
from xb_muscle_ros.trials.readers.tree import check_keys, choice_at, subtree, text_at
from xb_muscle_ros.trials.readers.units import Unit, quantity, unit_of

FILE = "file"
BAG = "bag"

# Beside where the signal is and its unit.
_MORE = {
    "time": ("largest_step", "rate"),
    "length": ("is", "of", "at_reference"),
    "force": ("zero",),
    "calcium": (),
    "stimulation": ("threshold", "pulse_gap"),
}
_PLACE = {FILE: ("column",), BAG: ("topic", "field")}
_DEFAULT_PULSE_GAP = "15 ms"
_SECONDS = Unit("time", 1.0)


class Columns(NamedTuple):
    """Fields of an `ImportMapping` that the columns tell."""

    time: Column
    length: Column
    force: Column | None
    calcium: Column | None
    stimulation: Stimulation | None
    length_is_change: bool
    length_of: str
    trial_column: str | None
    rate_hz: float | None
    at_reference: float | None
    largest_step_s: float | None
    force_zero_from_slack: bool


def read_columns(tree: Mapping[str, Any], where: str, kind: str) -> Columns:
    """Check the columns of a mapping.

    Args:
        tree: signals by name.
        where: the mapping file, for messages.
        kind: `FILE` where signals are columns or channels, `BAG` where they are topics.

    Raises:
        UserError: an unknown or missing key, unit or value.
    """
    check_keys(tree, (*_MORE, "trial"), "columns.", where)
    time, length = _column(tree, "time", where, kind), _column(tree, "length", where, kind)
    length_keys, force_keys = _keys(tree, "length", where), _keys(tree, "force", where)
    step = _keys(tree, "time", where).get("largest_step")
    return Columns(
        time=time,
        length=length,
        force=_column(tree, "force", where, kind) if "force" in tree else None,
        calcium=_column(tree, "calcium", where, kind) if "calcium" in tree else None,
        stimulation=_stimulation(tree, where, kind) if "stimulation" in tree else None,
        length_is_change=choice_at(length_keys, "is", ("absolute", "change"), "columns.length.", where) == "change",
        length_of=choice_at(length_keys, "of", LENGTHS_OF, "columns.length.", where),
        trial_column=_trial_column(tree, where, kind),
        rate_hz=_rate_hz(tree, where),
        at_reference=_at_reference(length_keys, length, where),
        largest_step_s=None
        if step is None
        else quantity(str(step), "time", "columns.time.largest_step", where, "0.5 s").value,
        force_zero_from_slack=choice_at(force_keys, "zero", ("as_recorded", "slack"), "columns.force.", where)
        == "slack",
    )


def _at_reference(keys: Mapping[str, Any], length: Column, where: str) -> float | None:
    if "at_reference" not in keys:
        return None
    what = "columns.length.at_reference"
    reference = quantity(str(keys["at_reference"]), "length", what, where, "42.5 mm")
    if reference.kind != length.unit.kind:
        raise UserError(f"{where}: {what} has to be a {length.unit.kind}, as the column is")
    return reference.value


def _column(tree: Mapping[str, Any], key: str, where: str, kind: str) -> Column:
    if key not in tree:
        more = ", or give its rate" if key == "time" else ""
        raise UserError(f"{where}: columns.{key} is missing; name the column and its unit{more}")
    keys = _keys(tree, key, where)
    here = f"{where}: columns.{key}"
    if kind == BAG and key == "time":
        check_keys(keys, ("stamp", "largest_step"), f"columns.{key}.", where)
        return Column(choice_at(keys, "stamp", ("header", "log"), "columns.time.", where), "s", _SECONDS)
    check_keys(keys, (*_PLACE[kind], "unit", *_MORE[key]), f"columns.{key}.", where)
    if key == "time" and "rate" in keys:
        if "column" in keys:
            raise UserError(f"{where}: columns.time has a column and a rate; the column tells the times, leave one out")
        return Column(f"time at {keys['rate']}", "s", _SECONDS)
    name = text_at(keys, _PLACE[kind][0], here, needed=f"name the {_PLACE[kind][0]}")
    field = (
        text_at(keys, "field", here, needed=f"name the field of {name}, for example position[0]") if kind == BAG else ""
    )
    unit_name = text_at(keys, "unit", here, needed=f"give the unit of {_PLACE[kind][0]} '{name}'")
    return Column(name, unit_name, unit_of(unit_name, key, where), field)


def _rate_hz(tree: Mapping[str, Any], where: str) -> float | None:
    rate = _keys(tree, "time", where).get("rate")
    return None if rate is None else quantity(str(rate), "rate", "columns.time.rate", where, "1000 Hz").value


def _trial_column(tree: Mapping[str, Any], where: str, kind: str) -> str | None:
    if "trial" not in tree:
        return None
    if kind == BAG:
        raise UserError(f"{where}: columns.trial is for tables; a bag is one trial; leave it out")
    keys = _keys(tree, "trial", where)
    check_keys(keys, ("column",), "columns.trial.", where)
    return text_at(keys, "column", f"{where}: columns.trial", needed="name the column")


def _stimulation(tree: Mapping[str, Any], where: str, kind: str) -> Stimulation:
    keys = _keys(tree, "stimulation", where)
    column = _column(tree, "stimulation", where, kind)
    threshold = finite(keys.get("threshold", 0.5), "columns.stimulation.threshold", where)
    gap = quantity(
        str(keys.get("pulse_gap", _DEFAULT_PULSE_GAP)),
        "time",
        "columns.stimulation.pulse_gap",
        where,
        "15 ms",
        zero=True,
    )
    return Stimulation(column, threshold * column.unit.factor, gap.value)


def _keys(tree: Mapping[str, Any], key: str, where: str) -> dict[str, Any]:
    return subtree(tree.get(key, {}), f"columns.{key}", where)
