"""The rate that a file tells of its samples beside the one that its times show."""

from __future__ import annotations

import contextlib

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.inspecting.words import read_name
from xb_muscle_ros.trials.readers.table import Table
from xb_muscle_ros.trials.readers.units import UNITS, unit_in
from xb_muscle_ros.trials.trial import Array

# Clocks of two programs differ by less.
_SAME_RATE = 0.01
# Times increase, but for a few where they start anew.
_INCREASING = 0.9


def other_rate(stated_hz: float, time_s: Array) -> float | None:
    """Samples in a second by times, where that is not the stated rate; else None.

    Times that are rounded, so that samples share them, have the rate of their mean step; those with gaps that of their
    median step: the rate is another where neither agrees.

    Args:
        stated_hz: as the file tells.
        time_s: shape (n,), s; it may start anew.
    """
    steps = np.diff(time_s)
    steps = steps[steps >= 0.0]
    if not np.any(steps > 0.0):
        return None
    mean_s, median_s = float(np.mean(steps)), float(np.median(steps))
    rates = [1.0 / step for step in (median_s, mean_s) if step > 0.0]
    return None if any(abs(stated_hz - rate) <= _SAME_RATE * rate for rate in rates) else rates[0]


def rate_warning(where: object, stated_hz: float | None, time_s: Array) -> tuple[str, ...]:
    """A line where the header's rate is not that of the times, which count.

    A header may name the rate another program was told; then the times in the file are right.
    """
    found_hz = None if stated_hz is None else other_rate(stated_hz, time_s)
    if found_hz is None:
        return ()
    return (f"{where}: the header says {stated_hz:g} Hz, the time column {found_hz:g} Hz; the time column is used",)


def check_times(table: Table) -> None:
    """Make sure that no column of time tells another rate than stands above the table.

    Raises:
        UserError: naming the column and both rates.
    """
    if table.rate is None:
        return
    hz, line = table.rate
    for i, name in enumerate(table.header):
        own = name if table.header.count(name) == 1 else str(i + 1)
        unit, time_s = _times(table, i, own)
        found_hz = other_rate(hz, time_s)
        if found_hz is not None:
            raise UserError(
                f"{table.where}: there are {hz:.6g} samples in a second by '{line}', {found_hz:.6g} by column "
                f"'{name}'; tell which is right by --time-column '{own}' --time-unit {unit}, or by --rate '{hz:.6g} Hz'"
            )


def _times(table: Table, i: int, own: str) -> tuple[str, Array]:
    """Unit of a column that is time, and its numbers in s; none where it is something else."""
    named = read_name(table.header[i])
    unit = unit_in(table.units[i] if table.units else "", "time") or unit_in(named.unit, "time")
    if named.why_not or named.roles not in ((), ("time",)):
        return "", np.empty(0)
    if named.roles and table.has_clock(own):
        with contextlib.suppress(UserError):  # what is wrong with it is told where it is read
            return "s", table.times(own, np.arange(len(table.rows)))[0]
    if unit is None:
        return "", np.empty(0)
    values = table.rows.column(i, table.decimal)
    values = values[np.isfinite(values)]
    if np.count_nonzero(np.diff(values) >= 0.0) < _INCREASING * (values.size - 1):
        return "", np.empty(0)
    return unit, values * UNITS[unit].factor
