"""The mapping that would import a file, as YAML with comments: what is a guess says so, what is missing waits."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from xb_muscle_ros.trials.inspecting.facts import facts_of, hint
from xb_muscle_ros.trials.inspecting.mapping_text import Proposal, scalar
from xb_muscle_ros.trials.inspecting.names import NamePattern, name_pattern
from xb_muscle_ros.trials.inspecting.recognition import Recognised, Recognition, unrecognised
from xb_muscle_ros.trials.readers.base import Reader
from xb_muscle_ros.trials.readers.calcium import PCA_RANGE
from xb_muscle_ros.trials.readers.columns import BAG
from xb_muscle_ros.trials.readers.contents import Content, Contents
from xb_muscle_ros.trials.readers.description import name_of
from xb_muscle_ros.trials.readers.units import KINDS, UNITS, calibration, volts_of

_TEXTS = ("fibre", "trial", "data_set", "source", "reference_length", "f0")


def propose(
    paths: Sequence[Path],
    reader: Reader,
    contents: Contents,
    found: Recognition,
    facts_of_each: Sequence[Mapping[str, str]] | None = None,
) -> Proposal:
    """The mapping for files of one layout.

    Args:
        paths: the files; what their names tell has to be in all of them.
        contents: of the first.
        found: signals of it.
        facts_of_each: of each file, see `facts_of`; None for those of the one file.
    """
    made = Proposal()
    by_format = bool(reader.defaults) and reader.kind != BAG
    each: list[Mapping[str, str]] = [facts_of(contents)] if facts_of_each is None else list(facts_of_each)
    if by_format:  # its reader knows them
        each = [{}]
    everywhere = [key for key in each[0] if all(key in one for one in each)]
    facts = {key: each[0][key] for key in everywhere}
    apart = [key for key in everywhere if any(one[key] != facts[key] for one in each)]
    shown = paths[0].name if len(paths) == 1 else f"{paths[0].name} and {len(paths) - 1} more"
    made.add(0, f"# Mapping of {shown}, as xb_muscle inspect recognised it. Look at each 'guess'; 'fill in' is needed.")
    made.add(0, f"format: {reader.name}")
    _names(made, reader, facts, len(paths))
    made.add(0, "columns:")
    _time(made, reader, contents, found)
    change = _length(made, reader, contents, found)
    _force(made, reader, found)
    calcium = _calcium(made, reader, found)
    for key in contents.in_header:
        made.add(0, f"{key}:", "the header of each file tells it; what stands here goes before", active=False)
    if "reference_length" not in contents.in_header:
        _reference(made, found, facts, change)
    if "f0" not in contents.in_header:
        _f0(made, reader, found, facts)
    if not by_format:
        _facts(made, facts, name_pattern(paths), calcium)
    if apart:
        _per_file(made, paths, each, apart)
    return made


def _per_file(made: Proposal, paths: Sequence[Path], each: Sequence[Mapping[str, str]], apart: Sequence[str]) -> None:
    """Facts that differ from file to file; they go before those above."""
    made.add(0, "per_file:", "as each file tells")
    for path, facts in zip(paths, each, strict=True):
        made.add(1, f"- files: {scalar(f'^{re.escape(name_of(path))}$')}")
        for key in apart:
            made.add(2, f"{key}: {scalar(facts[key]) if key in _TEXTS else facts[key]}")


def _names(made: Proposal, reader: Reader, facts: Mapping[str, str], files: int) -> None:
    default = str(reader.defaults.get("fibre", "{file}" if files == 1 else "{folder}"))
    if "fibre" in facts:
        made.add(0, f"fibre: {scalar(facts['fibre'])}", "as the file tells")
    else:
        whose = "the folder's name" if "{folder}" in default else "the file's name"
        made.guess(0, "fibre", scalar(default), f"{whose}; give the fibre's own")
    for key in ("trial", "data_set", "source"):
        if key in facts:
            made.add(0, f"{key}: {scalar(facts[key])}", "as the file tells")
    if "source" not in facts:
        made.add(0, "source:", "may be filled in: where the data come from", active=False)


def _place(made: Proposal, reader: Reader, one: Content, active: bool = True, comment: str = "") -> None:
    """Where a signal is."""
    made.add(2, f"{'topic' if reader.kind == BAG else 'column'}: {scalar(one.name)}", comment, active)
    if one.field:
        made.add(2, f"field: {scalar(one.field)}", "", active)


def _signal(made: Proposal, reader: Reader, one: Recognised) -> None:
    """A signal that was recognised, with its unit or a line that asks for it."""
    made.add(1, f"{one.role}:")
    comment = ""
    if one.is_guess:
        comment = f"guess: {one.why}"
        made.guesses.append(f"{one.content.label} is {one.role}, {one.why}")
    _place(made, reader, one.content, comment=comment)
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


def _time(made: Proposal, reader: Reader, contents: Contents, found: Recognition) -> None:
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


def _length(made: Proposal, reader: Reader, contents: Contents, found: Recognition) -> bool:
    """The length; returns whether it is a change."""
    one = found.roles.get("length")
    if one is None:
        _open(made, reader, "length", found, True, _moving(contents))
        return False
    _signal(made, reader, one)
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


def _force(made: Proposal, reader: Reader, found: Recognition) -> None:
    if "force" in found.roles:
        _signal(made, reader, found.roles["force"])
    else:
        _open(made, reader, "force", found, "force" in found.unclear)
        if "force" not in found.unclear:
            made.guesses.append("no force was recognised; the trial has none then")


def _calcium(made: Proposal, reader: Reader, found: Recognition) -> bool:
    """Calcium or stimulation; returns whether the file has either."""
    if "calcium" in found.roles:
        _signal(made, reader, found.roles["calcium"])
    else:
        _open(made, reader, "calcium", found, "calcium" in found.unclear)
    stimulation = found.roles.get("stimulation")
    if stimulation is None:
        return "calcium" in found.roles
    why = "with activation (below) in place of calcium and pCa"
    made.add(1, "stimulation:", why, active=False)
    _place(made, reader, stimulation.content, active=False)
    made.add(2, f"unit: {scalar(stimulation.unit)}", active=False)
    return "calcium" in found.roles


def _reference(made: Proposal, found: Recognition, facts: Mapping[str, str], change: bool) -> None:
    one = found.roles.get("length")
    kind = UNITS[one.unit].kind if one is not None and one.unit else ""
    if "reference_length" in facts:
        made.add(0, f"reference_length: {scalar(facts['reference_length'])}", "as the file tells")
    elif kind == "relative length":
        told = "may be filled in: how long one L0 is, for example '1.2 mm'; the bag has 1 m for it else"
        made.add(0, "reference_length:", told, active=False)
    elif "length" in found.factors:
        made.add(0, f"reference_length: {found.factors['length']:.9g} m", "from length in both units")
    elif change and kind == "length":
        made.fill_in(0, "reference_length", "the length that is L0, for example '1.2 mm', since length is a change")
    elif kind == "length":
        made.guess(0, "reference_length", "first_isometric", "the mean before the first change of length; or '1.2 mm'")


def _f0(made: Proposal, reader: Reader, found: Recognition, facts: Mapping[str, str]) -> None:
    one = found.roles.get("force")
    if one is None:
        return
    relative = bool(one.unit) and UNITS[one.unit].kind == "relative force"
    if "f0" in facts and (not relative or UNITS[facts["f0"].split()[-1]].kind == "force"):
        made.add(0, f"f0: {scalar(facts['f0'])}", "as the file tells")
    elif relative:
        told = "may be filled in: the force that one F0 is, for example '0.5 mN'; the bag has 1 N for it else"
        made.add(0, "f0:", told, active=False)
    elif "force" in found.factors:
        made.add(0, f"f0: {found.factors['force']:.9g} N", "from force in both units")
    elif "f0" in reader.defaults:
        made.add(0, f"f0: {scalar(reader.defaults['f0'])}", "as the format has it")
    elif one.unit:
        made.fill_in(
            0, "f0", f"the force or stress that is F0 (isometric at pCa 4.5), for example '0.5 {one.unit}'; "
            f"force goes up to {one.content.finite.max() if one.content.finite.size else math.nan:.6g} {one.unit}; "
            "or {isometric_at_pca: 4.5}, that of a trial in the same folder",
        )  # fmt: skip
    else:
        made.fill_in(0, "f0", "the force that is F0, with its unit; leave it out where force is in F0")


def _facts(made: Proposal, facts: Mapping[str, str], pattern: NamePattern | None, calcium: bool) -> None:
    for key in ("amplitude_l0", "recovery_s"):
        if key in facts:
            made.add(0, f"{key}: {facts[key]}", "as the file tells")
    if calcium:
        return
    if "pca" in facts:
        made.add(0, f"pca: {facts['pca']}", "as the file tells")
    elif pattern is not None:
        told = ", ".join(f"{key} {value:g}" for key, value in pattern.found.items())
        made.add(0, "file_name:", f"guess: the file's name tells {told}")
        made.add(1, f"pattern: {scalar(pattern.pattern)}")
        if pattern.factors:
            made.add(1, f"factors: {{{', '.join(f'{key}: {value:g}' for key, value in pattern.factors.items())}}}")
        made.guesses.append(f"{told}: as the file's name tells")
    else:
        made.fill_in(
            0,
            "pca",
            f"-log10 of free calcium in M, {PCA_RANGE[0]:g} to {PCA_RANGE[1]:g}; or columns.calcium, or activation by "
            "stimulation",
        )
        made.add(0, "activation: {rest: 0.05 uM, tetanus: 8 uM, rise: 50 ms, decay: 30 ms, begin: 1 s, end: 2 s}",
                 "stimulated muscle, in place of pca; examples; begin and end only without columns.stimulation",
                 active=False)  # fmt: skip
