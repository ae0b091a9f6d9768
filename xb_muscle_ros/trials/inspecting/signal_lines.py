"""Lines of a mapping on signals: where each is, in which unit, and what waits to be filled in."""

from __future__ import annotations

import numpy as np

from xb_muscle_ros.trials.inspecting.facts import hint
from xb_muscle_ros.trials.inspecting.mapping_text import Proposal, scalar
from xb_muscle_ros.trials.inspecting.names import NamePattern
from xb_muscle_ros.trials.inspecting.recognition import Recognised, Recognition, unrecognised
from xb_muscle_ros.trials.readers.base import Reader
from xb_muscle_ros.trials.readers.columns import BAG
from xb_muscle_ros.trials.readers.contents import Content, Contents
from xb_muscle_ros.trials.readers.units import KINDS, UNITS, calibration, volts_of


def _place(made: Proposal, reader: Reader, one: Content, active: bool = True, comment: str = "") -> None:
    """Where a signal is."""
    made.add(2, f"{'topic' if reader.kind == BAG else 'column'}: {scalar(one.name)}", comment, active)
    if one.field:
        made.add(2, f"field: {scalar(one.field)}", "", active)


def _signal(made: Proposal, reader: Reader, one: Recognised, pattern: NamePattern | None = None) -> None:
    """A signal that was recognised, with its unit or a line that asks for it."""
    told = f"'{one.content.label}' and columns like it are {one.role}, each of a trial" if pattern is not None else ""
    if one.is_guess:
        told = told or f"{one.content.label} is {one.role}, {one.why}"
    if told:
        made.guesses.append(told)
    made.add(1, f"{one.role}:", f"guess: {told}" if pattern is not None else "")
    if pattern is not None:
        made.pattern(2, pattern)
    else:
        _place(made, reader, one.content, comment=f"guess: {one.why}" if one.is_guess else "")
    if one.unit:
        made.add(2, f"unit: {scalar(one.unit)}")
    else:
        allowed = ", ".join(name for name, unit in UNITS.items() if unit.kind in KINDS[one.role])
        volts = volts_of(one.content.unit or one.named.unit, one.role)
        needed = calibration(one.role, volts) if volts else f"one of {allowed}"
        told = f"{needed}; {_range(one.content)}{'' if volts else hint(one)}"
        made.add(2, "unit:", f"fill in: {told}", active=False)
        made.missing.append(f"unit of {one.role} ({one.content.label}): {told}")
    for key, value in one.content.told_more.items():
        made.add(2, f"{key}: {scalar(value)}", "as the format has it")


def _range(one: Content) -> str:
    values = one.finite
    return "it holds no number" if not values.size else f"it holds {values.min():.6g} to {values.max():.6g}"


def _open(made: Proposal, reader: Reader, role: str, found: Recognition, needed: bool, hint: str = "") -> None:
    """A role without a signal, or with several that may be it."""
    candidates = found.unclear.get(role, ())
    if not needed and not candidates:
        return
    place = "a topic and its field" if reader.kind == BAG else "a column"
    names = " or ".join(f"'{one.content.label}'" for one in candidates)
    allowed = f"one of {names}" if names else f"{place} of {role} and its unit{hint}"
    comment = f"{'fill in' if needed else 'may be filled in'}: {allowed}"
    made.add(1, f"{role}:", comment, active=False)
    for one in candidates:
        _place(made, reader, one.content, active=False, comment="one of them")
        made.add(2, f"unit: {scalar(one.unit)}" if one.unit else "unit:", active=False)
    if needed:
        made.missing.append(f"{role}: {allowed}")


def time_line(made: Proposal, reader: Reader, contents: Contents, found: Recognition) -> None:
    if reader.kind == BAG:
        chosen = [one.content for one in found.roles.values()]
        clock = "log" if any(one.clock == "log" for one in chosen) else "header"
        made.add(1, f"time: {{stamp: {clock}}}")
    elif "time" in found.roles:
        _signal(made, reader, found.roles["time"])
    elif contents.rate is not None and "time" not in found.unclear:
        made.add(1, f"time: {{rate: {contents.rate[0]:.9g} Hz}}", f"as '{contents.rate[1]}' tells")
    else:
        even = [one.label for one in unrecognised(found, contents) if _is_even(one)]
        hint = f" ({', '.join(even)} increases evenly)" if even else ""
        _open(made, reader, "time", found, True, f"{hint}, or 'rate: 1000 Hz' in its place")


def _is_even(one: Content) -> bool:
    steps = np.diff(one.values)
    return steps.size > 2 and bool(np.all(steps > 0.0)) and float(np.ptp(steps)) <= 0.01 * float(np.median(steps))


def length_line(made: Proposal, reader: Reader, contents: Contents, found: Recognition) -> bool:
    """The length; returns whether it is a change."""
    one = found.roles.get("length")
    if one is None:
        _open(made, reader, "length", found, True, _moving(contents))
        return False
    _signal(made, reader, one, found.patterns.get("length"))
    if "is" in one.content.told_more:
        return one.content.told_more["is"] == "change"
    values = one.content.finite
    if one.named.length_of and "of" not in one.content.told_more:
        made.add(2, f"of: {one.named.length_of}", "by its name")
    below = bool(values.size) and float(values.min()) <= 0.0
    if below or one.named.is_change:
        why = "it goes down to 0 or below" if below else "its name says so"
        if below:
            made.guess(2, "is", "change", f"{why}, which no length of a muscle does", "columns.length.")
        else:
            made.guess(2, "is", "change", f"{why}; 'absolute' else", "columns.length.")
        return True
    if volts_of(one.content.unit or one.named.unit, "length"):
        told = "what 0 V is: 'change' where it is the reference length, 'absolute' where it is no length at all"
        made.add(2, "is:", f"fill in: {told}", active=False)
        made.missing.append(f"columns.length.is: {told}")
    return False


def _moving(contents: Contents) -> str:
    """Positions of joints that change; whether they are lengths or angles no message tells."""
    named = [
        one.label
        for one in contents.signals
        if one.field.startswith("position") and one.finite.size and np.ptp(one.finite) > 0.0
    ]
    return f" (positions that change: {', '.join(named)}; m, or rad where the joint turns)" if named else ""


def force_line(made: Proposal, reader: Reader, found: Recognition) -> None:
    if "force" in found.roles:
        _signal(made, reader, found.roles["force"], found.patterns.get("force"))
    else:
        _open(made, reader, "force", found, "force" in found.unclear)
        if "force" not in found.unclear:
            made.guesses.append("no force was recognised; the trial has none then")


def calcium_line(made: Proposal, reader: Reader, found: Recognition) -> bool:
    """Calcium or stimulation; returns whether calcium of each trial is told, by a signal or the names of columns."""
    if "calcium" in found.roles:
        _signal(made, reader, found.roles["calcium"])
    else:
        _open(made, reader, "calcium", found, "calcium" in found.unclear)
    stimulation = found.roles.get("stimulation")
    told = "calcium" in found.roles or bool(found.patterns)
    if stimulation is None:
        return told
    why = "with activation (below) in place of calcium and pCa"
    made.add(1, "stimulation:", why, active=False)
    _place(made, reader, stimulation.content, active=False)
    made.add(2, f"unit: {scalar(stimulation.unit)}", active=False)
    return told
