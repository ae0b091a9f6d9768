"""The mapping that would import a file, as YAML with comments: what is a guess says so, what is missing waits."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from xb_muscle_ros.trials.inspecting.facts import facts_of
from xb_muscle_ros.trials.inspecting.mapping_text import Proposal, scalar
from xb_muscle_ros.trials.inspecting.names import NamePattern, name_pattern, sheet_pattern
from xb_muscle_ros.trials.inspecting.recognition import Recognition
from xb_muscle_ros.trials.inspecting.signal_lines import calcium_line, force_line, length_line, time_line
from xb_muscle_ros.trials.readers.base import Reader
from xb_muscle_ros.trials.readers.calcium import PCA_RANGE, pcas_in
from xb_muscle_ros.trials.readers.columns import BAG
from xb_muscle_ros.trials.readers.contents import Contents
from xb_muscle_ros.trials.readers.description import name_of
from xb_muscle_ros.trials.readers.units import UNITS

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
    elif len(paths) > 1 and not found.patterns and "calcium" not in found.roles:
        each = _with_names(paths, each)
    everywhere = [key for key in each[0] if all(key in one for one in each)]
    facts = {key: each[0][key] for key in everywhere}
    apart = [key for key in everywhere if any(one[key] != facts[key] for one in each)]
    shown = paths[0].name if len(paths) == 1 else f"{paths[0].name} and {len(paths) - 1} more"
    made.add(0, f"# Mapping of {shown}, as xb_muscle inspect recognised it. Look at each 'guess'; 'fill in' is needed.")
    made.add(0, f"format: {reader.name}")
    _names(made, reader, facts, len(paths))
    made.add(0, "columns:")
    time_line(made, reader, contents, found)
    change = length_line(made, reader, contents, found)
    force_line(made, reader, found)
    calcium = calcium_line(made, reader, found)
    for key in contents.in_header:
        made.add(0, f"{key}:", "the header of each file tells it; what stands here goes before", active=False)
    if "reference_length" not in contents.in_header:
        _reference(made, found, facts, change)
    if "f0" not in contents.in_header:
        _f0(made, reader, found, facts)
    sheets = sheet_pattern(contents.sheets) if not calcium and len(paths) == 1 else None
    if sheets is not None:
        out = [f"'{sheet}'" for sheet in contents.sheets if not pcas_in(sheet)]
        why = f"their names tell the pCa of their trials{'; left out: ' if out else ''}{', '.join(out)}"
        made.add(0, "sheet:", f"guess: {why}")
        made.pattern(1, sheets)
        made.guesses.append(f"sheets: {why}")
    told = by_format and any(pcas_in(f"{name} {text}") for name, text in contents.facts.items())
    _facts(made, facts, name_pattern(paths), calcium or told or sheets is not None)
    if apart:
        _per_file(made, paths, each, apart)
    return made


def _with_names(paths: Sequence[Path], each: Sequence[Mapping[str, str]]) -> list[Mapping[str, str]]:
    """Facts of files with the pCa that each name tells, where all tell one and no pattern reads all of them."""
    own = [name_pattern([path]) for path in paths]
    if name_pattern(paths) is not None or any(pattern is None for pattern in own):
        return list(each)
    told = [{"pca": f"{pattern.found['pca']:g}"} for pattern in own if pattern is not None]
    return [{**name, **facts} for name, facts in zip(told, each, strict=True)]


def _per_file(made: Proposal, paths: Sequence[Path], each: Sequence[Mapping[str, str]], apart: Sequence[str]) -> None:
    """Facts that differ from file to file; they go before those above."""
    made.add(0, "per_file:", "as each file, or its name, tells")
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
        made.pattern(1, pattern)
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
