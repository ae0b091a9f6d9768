"""Which signal of a file is time, length, force, calcium or stimulation: by its name, by its unit, and why.

Values are a hint and decide nothing. Where several signals may be one thing, none is taken, and all are named.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from xb_muscle_ros.trials.inspecting.names import NamePattern, column_pattern
from xb_muscle_ros.trials.inspecting.words import OTHER_UNITS, Named, fitting, read_name, roles_of_unit, units_meant
from xb_muscle_ros.trials.readers.calcium import PCA_NUMBER, SAME_PCA, pcas_in
from xb_muscle_ros.trials.readers.columns import SIGNALS
from xb_muscle_ros.trials.readers.contents import Content, Contents
from xb_muscle_ros.trials.readers.units import KINDS, UNITS, volts_of

# Fields of joints that say how a number is sent, not what it is; a velocity is none of the roles.
_SENT_AS = ("position", "effort", "data", "velocity")
_SAME = 1e-5
_LEAST_FOR_SAME = 5


class Recognised(NamedTuple):
    """A signal and what it is taken for.

    Attributes:
        content: the signal.
        role: one of `columns.SIGNALS`.
        unit: as a mapping has it; empty where it is not known.
        why: in words.
        is_guess: the name says nothing of the role: its unit alone did.
        named: what the name tells.
    """

    content: Content
    role: str
    unit: str
    why: str
    is_guess: bool
    named: Named


@dataclass(frozen=True)
class Recognition:
    """What was recognised.

    Attributes:
        roles: one signal for a role.
        unclear: several for a role; none of them is taken.
        taken_for: for each signal by its label, what it is taken for, or why for nothing.
        units: of each signal by its label: that of its role, or as the file writes it; empty for none.
        remarks: what was decided and is worth a look, one line each.
        factors: of a role, how many of its base unit (m, N) make one of L0 or F0, where the file has both.
        patterns: of a role with a column for each trial, what their names have in common; `roles` has the first.
    """

    roles: dict[str, Recognised] = field(default_factory=dict)
    unclear: dict[str, tuple[Recognised, ...]] = field(default_factory=dict)
    taken_for: dict[str, str] = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)
    remarks: list[str] = field(default_factory=list)
    factors: dict[str, float] = field(default_factory=dict)
    patterns: dict[str, NamePattern] = field(default_factory=dict)


def recognise(contents: Contents, beside: bool = False) -> Recognition:
    """Find the role of each signal that has one.

    Args:
        contents: of a file.
        beside: an import of it can take a column for each trial.
    """
    found = Recognition()
    candidates: dict[str, list[Recognised]] = {role: [] for role in SIGNALS}
    for content in contents.signals:
        one, why_not = _looked_at(content)
        found.taken_for[content.label] = why_not
        told = content.unit or _named(content).unit
        found.units[content.label] = told if one is None else one.unit or volts_of(told, one.role)
        if one is not None and one.role == "time" and contents.rate is not None and not content.finite.size:
            found.taken_for[content.label] = f"holds no time; '{contents.rate[1]}' tells the rate"
        elif one is not None:
            candidates[one.role].append(one)
    for role, each in candidates.items():
        if role == "time" and any(content.times_s is not None for content in contents.signals):
            continue  # a bag's messages have stamps
        _settle(found, role, each, beside)
    if found.patterns and "calcium" in found.roles:
        label = found.roles.pop("calcium").content.label
        found.taken_for[label] = "is called calcium; the names of columns tell the pCa of each trial"
        found.remarks.append(f"'{label}' is left out, since the names of columns tell the pCa of each trial")
    return found


def _looked_at(content: Content) -> tuple[Recognised | None, str]:
    """What a signal may be, or why it is nothing."""
    named = _named(content)
    unit = content.unit or named.unit
    if content.told_role:
        why = f"{content.name if content.of else 'the format'} tells"
        return Recognised(content, content.told_role, fitting(unit, content.told_role), why, False, named), ""
    if content.told_not:
        return None, content.told_not
    if content.field.startswith("velocity"):
        return None, "is a velocity"
    if named.why_not:
        return None, named.why_not
    roles = tuple(role for role in named.roles if role in SIGNALS)
    if len(roles) > 1:
        by_unit = tuple(role for role in roles if unit and fitting(unit, role))
        if len(by_unit) > 1:  # mm may be mM, though not as it is written
            by_unit = tuple(role for role in by_unit if UNITS[units_meant(unit)[0]].kind in KINDS[role])
        if len(by_unit) != 1:
            return None, f"its name may be that of {' or '.join(roles)}"
        roles = by_unit
    if not set(roles) - {"calcium"} and _is_at_pca(content):
        role = _role_at_pca(content.name, unit)
        return Recognised(content, role, fitting(unit, role) if unit else "", "called by a pCa", True, named), ""
    if roles:
        return _by_name(content, roles[0], unit, named)
    of_unit = roles_of_unit(unit) if unit else ()
    if len(of_unit) == 1 and of_unit[0] != "stimulation":
        why = f"by its unit {unit} alone"
        return Recognised(content, of_unit[0], fitting(unit, of_unit[0]), why, True, named), ""
    return None, "is the number of the trial" if "trial" in named.roles else _other(unit)


def _is_at_pca(content: Content) -> bool:
    """Whether a column is called by a pCa and holds something else, which was recorded at that pCa."""
    told = () if content.field else pcas_in(content.name)
    return len(told) == 1 and bool(np.any(np.abs(content.finite - told[0]) > SAME_PCA))


def _role_at_pca(name: str, unit: str) -> str:
    """Of a column that is called by a pCa: by what stands before that (``L_pCa6.2``), by its unit, or else force."""
    before = PCA_NUMBER.split(name, maxsplit=1)[0].strip(" _-.:,")
    told = [*read_name(before).roles, *(role for role in ("force", "length") if unit and fitting(unit, role))]
    return next((role for role in told if role in ("force", "length")), "force")


def _by_name(content: Content, role: str, unit: str, named: Named) -> tuple[Recognised | None, str]:
    meant = fitting(unit, role) if unit else ""
    if not meant and volts_of(unit, role):
        return Recognised(content, role, "", f"by its name; it is in {unit}", False, named), ""
    if unit and not meant:
        allowed = ", ".join(known for known, each in UNITS.items() if each.kind in KINDS[role])
        other = OTHER_UNITS.get(unit.casefold(), "")
        if not other and not units_meant(unit):
            return Recognised(content, role, "", f"by its name; its unit '{unit}' is not known", False, named), ""
        return None, f"is called {role}, but its unit '{unit}' is none{f' ({other})' if other else ''}: {allowed}"
    if role == "stimulation" and not unit:
        meant = "V"
    return Recognised(content, role, meant, "by its name" + (" and unit" if unit else ""), False, named), ""


def _named(content: Content) -> Named:
    """What a column's name tells, or a topic's with its joint's."""
    if not content.field:
        return read_name(content.name)
    words = content.field.replace("[", " ").replace("]", " ").replace(".", " ").split()
    rest = [word for word in words if word not in _SENT_AS and not word.isdecimal()]
    return read_name(" ".join([*content.name.strip("/").split("/"), *rest]).replace("-", " "))


def _other(unit: str) -> str:
    if not unit:
        return "not recognised"
    other = OTHER_UNITS.get(unit.casefold())
    return f"not recognised; its unit is {other}" if other else f"not recognised; its unit is '{unit}'"


def _settle(found: Recognition, role: str, candidates: list[Recognised], beside: bool) -> None:
    """Take the one candidate, or leave all of them open."""
    told = [one for one in candidates if one.content.told_role]
    named = told or [one for one in candidates if not one.is_guess]
    left = named or candidates
    for one in candidates:
        if not any(one is other for other in left):
            what = "may be" if one.is_guess and not one.unit else "has a unit of" if one.is_guess else "is called"
            other = "the format tells of another" if told else "another signal has its name"
            found.taken_for[one.content.label] = f"{what} {role}; {other}"
    left = _measured(found, role, left)
    left = _one_of_the_same(found, role, left)
    if len(left) == 1:
        found.roles[role] = left[0]
        found.taken_for[left[0].content.label] = f"{role} ({left[0].why})"
    elif left and beside and (pattern := _pattern(left)) is not None:
        found.roles[role], found.patterns[role] = left[0], pattern
        for one in left:
            found.taken_for[one.content.label] = f"{role} of a trial, whose pCa its name tells"
    elif left:
        found.unclear[role] = tuple(left)
        names = ", ".join(f"'{one.content.label}'" for one in left)
        for one in left:
            found.taken_for[one.content.label] = f"may be {role} ({one.why})"
        found.remarks.append(f"{names} may each be {role}; none is taken: name one in the mapping")


def _pattern(candidates: list[Recognised]) -> NamePattern | None:
    """What the names of columns have in common that hold one signal at several pCa."""
    alike = len({one.unit for one in candidates}) == 1
    return column_pattern([one.content.name for one in candidates]) if alike else None


def _measured(found: Recognition, role: str, candidates: list[Recognised]) -> list[Recognised]:
    """Without commands, where a measured signal stands beside them."""
    measured = [one for one in candidates if not one.named.is_command]
    commands = [one for one in candidates if one.named.is_command]
    if not measured:
        for one in commands:
            found.remarks.append(f"'{one.content.label}' is a command by its name; no measured {role} stands beside it")
        return candidates
    for one in commands:
        found.taken_for[one.content.label] = f"is the command of {role} by its name"
        found.remarks.append(
            f"'{one.content.label}' is taken for what was commanded, and is left out; "
            f"{', '.join(repr(each.content.label) for each in measured)} for what was measured"
        )
    return measured


def _one_of_the_same(found: Recognition, role: str, candidates: list[Recognised]) -> list[Recognised]:
    """One signal in two units is one: that in the absolute unit stays, and its line on the other tells L0 or F0."""
    absolute = [one for one in candidates if one.unit and not UNITS[one.unit].kind.startswith("relative")]
    relative = [one for one in candidates if one.unit and UNITS[one.unit].kind.startswith("relative")]
    if len(candidates) != 2 or len(absolute) != 1 or len(relative) != 1:
        return candidates
    factor = _slope(relative[0].content.values, absolute[0].content.values)
    if factor is None:
        return candidates
    scale = factor * UNITS[absolute[0].unit].factor / UNITS[relative[0].unit].factor
    found.factors[role] = scale
    # 1 m for L0 is how normalised lengths are kept: those are in L0.
    normalised = role == "length" and abs(scale - 1.0) <= _SAME
    kept, other = (relative[0], absolute[0]) if normalised else (absolute[0], relative[0])
    found.taken_for[other.content.label] = f"is '{kept.content.label}' in another unit"
    found.remarks.append(
        f"'{relative[0].content.label}' is '{absolute[0].content.label}' in another unit: "
        f"{'L0' if role == 'length' else 'F0'} is {scale / UNITS[absolute[0].unit].factor:.9g} {absolute[0].unit}"
    )
    return [kept]


def _slope(
    x: np.ndarray[tuple[int], np.dtype[np.float64]], y: np.ndarray[tuple[int], np.dtype[np.float64]]
) -> float | None:
    """How often y has the step of x, where it is a straight line of x; None where it is not."""
    both = np.isfinite(x) & np.isfinite(y) if x.shape == y.shape else np.zeros(0, dtype=bool)
    if np.count_nonzero(both) < _LEAST_FOR_SAME or np.ptp(x[both]) == 0.0:
        return None
    slope, offset = np.polyfit(x[both], y[both], 1)
    apart = np.abs(y[both] - slope * x[both] - offset).max()
    return float(slope) if slope > 0.0 and apart <= _SAME * np.ptp(y[both]) else None


def unrecognised(recognition: Recognition, contents: Contents) -> Sequence[Content]:
    """Signals that are taken for nothing, for example as hints at what is missing."""
    taken = {one.content.label for one in recognition.roles.values()}
    return [content for content in contents.signals if content.label not in taken]
