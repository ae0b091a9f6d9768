"""The ``columns`` of a mapping: where each signal is, and its unit."""

from __future__ import annotations

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.readers.description import Column, Stimulation
from xb_muscle_ros.trials.readers.tree import Keys
from xb_muscle_ros.trials.readers.units import Unit, unit_of

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
    keys = columns.below(key, *_PLACE[kind], "unit", *SIGNALS[key])
    if key == "time" and "rate" in keys:
        if "column" in keys:
            raise UserError(
                f"{keys.where}: columns.time has a column and a rate; the column tells the times, leave one out"
            )
        return Column(f"time at {keys.values['rate']}", "s", _SECONDS)
    name = keys.text(place, f"name the {place}")
    field = keys.text("field", f"name the field of {name}, for example position[0]") if kind == BAG else ""
    unit_name = keys.text("unit", f"give the unit of {place} '{name}'")
    return Column(name, unit_name, unit_of(unit_name, key, keys.where), field)


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
