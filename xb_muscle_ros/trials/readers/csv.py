"""Trials from delimited text, by a mapping of columns and units."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials import ros_types
from xb_muscle_ros.trials.phases import detect_phases, initial_isometric
from xb_muscle_ros.trials.readers.force import read_force
from xb_muscle_ros.trials.readers.mapping import ImportMapping
from xb_muscle_ros.trials.readers.table import Table, read_table
from xb_muscle_ros.trials.trial import Array, Phase, Trial, TrialFacts

# Beyond these it is no muscle's recording, or its unit is wrong.
STEP_RANGE_S = (1e-6, 0.2)
LENGTH_RANGE_L0 = (0.2, 3.0)
CALCIUM_RANGE_UM = (0.0, 1e5)
FACT_RANGES = {"pca": (1.0, 12.0), "amplitude_l0": (0.0, 1.0), "recovery_s": (0.0, 1e4)}


class _Length(NamedTuple):
    length_m: Array
    reference_m: float
    phases: tuple[Phase, ...]


def read_csv(path: Path, mapping: ImportMapping, isometric_scaling: bool | None = None) -> Trial:
    """Read one trial.

    Lengths in m stay as they are and ``reference_length_m`` tells L0; lengths in L0 and half-sarcomere lengths are
    stored with L0 = 1 m. Forces in N stay and ``f0_n`` tells F0; stresses and forces in F0 are stored with F0 = 1 N.
    Phases are found in the length record; amplitude and recovery are taken from them where they are not given.
    Negative times are shifted to begin at 0.

    Args:
        path: CSV or TSV file; its name without ending names the trial.
        mapping: columns, units and facts.
        isometric_scaling: multiply the force so that its initial isometric part equals that of the matching
            isometric trial; None does so where the mapping has a table for it.

    Raises:
        UserError: a missing column, a cell that is no finite number, time that does not increase, values that no
            muscle has, or scaling that is asked for and cannot be done.
    """
    table = read_table(path)
    given = mapping.facts_of(path)
    for name, (low, high) in FACT_RANGES.items():
        value = given[name]
        if value is not None and not low <= value <= high:
            raise UserError(f"{path}: {name} is {value:g}; allowed is {low:g} to {high:g}; look at {mapping.where}")
    warnings: list[str] = []
    time_s = _time(table, mapping, warnings)
    length = _length(table, mapping, time_s, given, warnings)
    calcium_time_s, calcium_um, pca = _calcium(table, mapping, time_s, given["pca"])
    isometric = initial_isometric(time_s, length.phases)
    force = read_force(table, mapping, pca, isometric, isometric_scaling)
    amplitude_l0, recovery_s = _measured(time_s, length)
    facts = TrialFacts(
        fibre=mapping.fibre,
        trial=path.stem,
        pca=pca,
        amplitude_l0=amplitude_l0 if given["amplitude_l0"] is None else given["amplitude_l0"],
        recovery_s=recovery_s if given["recovery_s"] is None else given["recovery_s"],
        reference_length_m=length.reference_m,
        f0_n=force.f0_n,
        phases=length.phases,
        source="; ".join(text for text in (mapping.source, *force.notes) if text),
    )
    return Trial(
        facts=facts,
        time_s=time_s,
        length_m=length.length_m,
        calcium_time_s=calcium_time_s,
        calcium_um=calcium_um,
        force_time_s=time_s if force.force_n.size else np.empty(0),
        force_n=force.force_n,
        warnings=(*warnings, *force.warnings),
    )


def _time(table: Table, mapping: ImportMapping, warnings: list[str]) -> Array:
    column = mapping.time
    time_s = table.numbers(column.name) * column.unit.factor
    back = np.flatnonzero(np.diff(ros_types.to_ns(time_s - time_s[0])) <= 0)
    if back.size:
        i = int(back[0]) + 1
        raise UserError(
            f"{table.path}, line {table.line(i)}, column '{column.name}': {time_s[i]:.9g} s does not come after "
            f"{time_s[i - 1]:.9g} s; time has to increase from line to line; mend or remove the line"
        )
    step_s = float(np.median(np.diff(time_s))) if time_s.size > 1 else STEP_RANGE_S[0]
    if not STEP_RANGE_S[0] <= step_s <= STEP_RANGE_S[1]:
        raise UserError(
            f"{table.path}, column '{column.name}': samples are {step_s:.3g} s apart; allowed is "
            f"{STEP_RANGE_S[0]:g} to {STEP_RANGE_S[1]:g} s; is {column.unit_name} its unit?"
        )
    if time_s[0] < 0.0:
        warnings.append(f"{table.path}: times shifted by {-time_s[0]:.9g} s, because a stamp cannot be negative")
        time_s = time_s - time_s[0]
    return ros_types.to_s(ros_types.to_ns(time_s))  # as a bag keeps them


def _length(
    table: Table, mapping: ImportMapping, time_s: Array, given: dict[str, float | None], warnings: list[str]
) -> _Length:
    column = mapping.length
    length_m = table.numbers(column.name) * column.unit.factor
    relative = column.unit.kind == "relative length"
    reference_m = 1.0 if relative else None if mapping.reference_length is None else mapping.reference_length.value
    if mapping.length_is_change and reference_m is not None:
        length_m = length_m + reference_m
    phases = detect_phases(time_s, length_m, given["amplitude_l0"], given["recovery_s"])
    if reference_m is None:
        isometric = length_m[initial_isometric(time_s, phases)]
        if isometric.size == 0:
            warnings.append(f"{table.path} does not begin isometrically; L0 is the length of its first sample")
            isometric = length_m[:1]
        reference_m = float(np.mean(isometric))
    if reference_m <= 0.0:
        raise UserError(
            f"{table.path}, column '{column.name}' begins with {reference_m:.6g} m; a length is above 0; "
            "does the column hold a change of length?"
        )
    _within(table, column.name, length_m / reference_m, LENGTH_RANGE_L0, f"L0 (L0 = {reference_m:.6g} m)")
    if mapping.half_sarcomere:
        length_m, reference_m = length_m / reference_m, 1.0
    return _Length(length_m, reference_m, phases)


def _calcium(
    table: Table, mapping: ImportMapping, time_s: Array, pca: float | None
) -> tuple[Array, Array, float | None]:
    """Times and values of calcium where it changes (s, µM), and pCa where it does not."""
    column = mapping.calcium
    if column is None:
        if pca is None:
            raise UserError(f"{table.path}: calcium is not known; give --pca, a calcium column or a file name pattern")
        return time_s[:1], np.array([10.0 ** (6.0 - pca)]), pca
    values = table.numbers(column.name)
    is_pca = column.unit.kind == "pCa"
    calcium_um = 10.0 ** (6.0 - values) if is_pca else values * column.unit.factor
    _within(table, column.name, calcium_um, CALCIUM_RANGE_UM, "µM")
    changes = np.concatenate(([True], np.diff(calcium_um) != 0.0))
    if np.count_nonzero(changes) == 1 and calcium_um[0] > 0.0:
        pca = float(values[0]) if is_pca else float(6.0 - np.log10(calcium_um[0]))
    else:
        pca = None
    return time_s[changes], calcium_um[changes], pca


def _measured(time_s: Array, length: _Length) -> tuple[float | None, float | None]:
    """Amplitude of the conditioning stretch (L0; 0 for a reference trial) and recovery (s) as the record shows them."""
    found = {phase.name: phase for phase in length.phases}
    if "conditioning_stretch" not in found:
        return (0.0 if "test_stretch" in found else None), None
    peak = np.interp(found["conditioning_stretch"].end_s, time_s, length.length_m)
    recovery = found.get("recovery")
    recovery_s = round(recovery.end_s - recovery.start_s, 4) if recovery else 0.0
    return round(float(peak / length.reference_m - 1.0), 4), recovery_s


def _within(table: Table, column: str, values: Array, allowed: tuple[float, float], unit: str) -> None:
    bad = np.flatnonzero(~((values >= allowed[0]) & (values <= allowed[1])))
    if bad.size:
        i = int(bad[0])
        raise UserError(
            f"{table.path}, line {table.line(i)}, column '{column}' is {values[i]:.6g} {unit}; allowed is "
            f"{allowed[0]:g} to {allowed[1]:g}; check the column and its unit"
        )
