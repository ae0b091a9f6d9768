"""An inspection in words: what is in the file, what was recognised, what is missing."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from xb_muscle_ros import tables
from xb_muscle_ros.trials.importing import line_of
from xb_muscle_ros.trials.inspecting.clocks import Clock, clock_of, value_faults
from xb_muscle_ros.trials.inspecting.inspection import Inspection
from xb_muscle_ros.trials.readers.contents import Content
from xb_muscle_ros.trials.readers.units import UNITS
from xb_muscle_ros.trials.trial import Array

_MOST_TRIALS = 12
_MOST_FACTS = 24
_LONGEST_FACT = 100


def times_of_signal(made: Inspection, content: Content) -> tuple[Array, bool]:
    """Times of a signal: in s, or where the unit of time is not known as they are; numbers of samples without any.

    Returns:
        shape (n,), and whether they are s.
    """
    if content.times_s is not None:
        return content.times_s, True
    time = made.recognition.roles.get("time")
    if time is None or time.content.values.size != content.values.size:
        return np.arange(content.values.size, dtype=np.float64), False
    factor = UNITS[time.unit].factor if time.unit else 1.0
    return time.content.values * factor, bool(time.unit)


def clock_of_signal(made: Inspection, content: Content) -> Clock | None:
    """Clock of a signal; None where there is none."""
    if content.times_s is None and "time" not in made.recognition.roles:
        return None
    times, _ = times_of_signal(made, content)
    return clock_of(times, content)


def rows(made: Inspection) -> list[dict[str, Any]]:
    """A row for each signal: name, unit, number of values and of blanks, range, sampling rate, what it is taken for."""
    roles = {one.content.label: one for one in made.recognition.roles.values()}
    found = []
    for content in made.contents.signals:
        one = roles.get(content.label)
        clock = clock_of_signal(made, content)
        in_s = times_of_signal(made, content)[1]
        values = content.finite
        found.append(
            {
                "signal": content.label,
                "unit": made.recognition.units[content.label] or None,
                "type": content.of or None,
                "values": int(values.size),
                "blanks": int(content.values.size - values.size),
                "lowest": float(values.min()) if values.size else None,
                "highest": float(values.max()) if values.size else None,
                "rate_hz": clock.rate_hz if clock is not None and in_s else None,
                "role": one.role if one is not None else None,
                "taken_for": made.recognition.taken_for.get(content.label, ""),
            }
        )
    return found


def report(made: Inspection) -> str:
    """The whole inspection as text."""
    lines = [f"{made.path}: {made.format}, {made.contents.format}", *_contents(made)]
    for head, told in (
        ("Told by the file", tuple(_facts(made))),
        ("Recognised", tuple(_recognised(made))),
        ("Look at", tuple(_doubts(made))),
        ("Missing for an import", () if made.is_own else tuple(made.proposal.missing)),
        ("Refused by an import", () if made.is_own else made.refused),
    ):
        if told:
            lines += [f"{head}:", *(f"  {line}" for line in told)]
    lines.append(_verdict(made))
    return "\n".join(lines)


def _contents(made: Inspection) -> Iterator[str]:
    columns: tables.Columns[dict[str, Any]] = {
        "signal": lambda row: str(row["signal"]),
        "unit": lambda row: row["unit"] or "?",
        "values": lambda row: str(row["values"]),
        "blanks": lambda row: str(row["blanks"] or ""),
        "lowest": lambda row: tables.number(row["lowest"], ".6g"),
        "highest": lambda row: tables.number(row["highest"], ".6g"),
        "rate (Hz)": lambda row: tables.number(row["rate_hz"], ".6g"),
        "taken for": lambda row: str(row["taken_for"]),
    }
    head, body = tables.filled(columns, rows(made))
    if body:
        table = tables.aligned(head, body, left=(0, 1, len(head) - 1))
        yield from (f"  {line}" for line in table.splitlines())
    yield from (f"  {line}" for line in made.contents.others)
    if len(made.contents.trials) > 1:
        yield f"  {len(made.contents.trials)} trials; the signals above are those of {made.contents.trials[0]}"


def _facts(made: Inspection) -> Iterator[str]:
    for i, (name, text) in enumerate(made.contents.facts.items()):
        if i == _MOST_FACTS:
            yield f"... and {len(made.contents.facts) - _MOST_FACTS} more"
            return
        shown = " ".join(text.split())
        yield f"{name}: {shown if len(shown) <= _LONGEST_FACT else shown[:_LONGEST_FACT] + ' ...'}"


def _recognised(made: Inspection) -> Iterator[str]:
    for role, one in made.recognition.roles.items():
        unit = f"in {one.unit}" if one.unit else "in an unknown unit"
        yield f"{role}: '{one.content.label}' {unit} ({one.why})"
    what = "replay takes it for" if made.is_own else "imported it is"
    for trial in made.trials[:_MOST_TRIALS]:
        yield f"{what} fibre {trial.facts.fibre}, trial {trial.facts.trial}: {line_of(trial)}"
    if len(made.trials) > _MOST_TRIALS:
        yield f"... and {len(made.trials) - _MOST_TRIALS} more trials"


def _doubts(made: Inspection) -> Iterator[str]:
    told = [*made.contents.notes, *made.recognition.remarks, *_faults(made)]
    told += made.replayed if made.is_own else (f"guess: {line}" for line in made.proposal.guesses)
    if not made.is_own:
        told += [line for trial in made.trials for line in trial.warnings]
    yield from dict.fromkeys(told)


def _faults(made: Inspection) -> Iterator[str]:
    clocks: set[tuple[str, ...]] = set()
    time = made.recognition.roles.get("time")
    for content in made.contents.signals:
        yield from (f"'{content.label}': {line}" for line in value_faults(content))
        clock = clock_of_signal(made, content)
        if clock is None or not clock.faults or clock.faults in clocks:
            continue
        clocks.add(clock.faults)
        whose = content.label if time is None or content.times_s is not None else time.content.label
        yield from (f"'{whose}': {line}" for line in clock.faults)


def _verdict(made: Inspection) -> str:
    if made.is_own:
        return "This bag needs no import: replay, fit, evaluate and diagnose take it as it is."
    if made.proposal.missing:
        return f"An import needs {len(made.proposal.missing)} more; --mapping-out writes a mapping with room for them."
    if made.refused:
        return "Nothing is missing, but an import refuses it as it is; see above."
    return "Everything an import needs was recognised; --mapping-out writes the mapping."
