"""Measured force of a trial in N or relative to F0, scaled to that of the matching isometric trial where asked for.

A fibre runs down from trial to trial. The paper's data are therefore multiplied, trial by trial, so that the force
before the first stretch equals the one the fibre had in the isometric trial of that pCa.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.readers.mapping import ImportMapping
from xb_muscle_ros.trials.readers.table import Table
from xb_muscle_ros.trials.trial import Array

# Beyond these it is no muscle's force, or its unit is wrong.
FORCE_RANGE_F0 = (-20.0, 20.0)
# Run-down and changes of preparation stay within these; beyond, the table or the unit is suspect.
EXPECTED_SCALING = (0.5, 2.0)


class Force(NamedTuple):
    """Force in N (empty where not measured), the force that is F0 in N, notes for the source, and warnings."""

    force_n: Array
    f0_n: float = 1.0
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()


def read_force(
    table: Table, mapping: ImportMapping, pca: float | None, isometric: slice, scaling: bool | None
) -> Force:
    """Read the force column.

    Args:
        table: the file.
        mapping: names the column, its unit, F0 and the isometric fractions.
        pca: of the trial; None where calcium changes.
        isometric: samples of the initial isometric phase; may be empty.
        scaling: scale to the isometric trial; None where the mapping has fractions.

    Raises:
        UserError: a force no muscle has, or scaling that is wanted and cannot be done.
    """
    column = mapping.force
    if column is None:
        if scaling:
            raise UserError(f"{table.path}: isometric scaling needs a force column; name it or leave the scaling out")
        return Force(np.empty(0))
    force = table.numbers(column.name) * column.unit.factor
    notes: tuple[str, ...] = ()
    if mapping.f0 is None:
        f0_n = 1.0
    elif mapping.f0.kind == "stress":
        force, f0_n = force / mapping.f0.value, 1.0
        notes = (f"stress divided by F0 = {mapping.f0.value:.6g} Pa",)
    else:
        f0_n = mapping.f0.value
    bad = np.flatnonzero(~((force >= FORCE_RANGE_F0[0] * f0_n) & (force <= FORCE_RANGE_F0[1] * f0_n)))
    if bad.size:
        i = int(bad[0])
        raise UserError(
            f"{table.path}, line {table.line(i)}, column '{column.name}' is {force[i] / f0_n:.6g} F0; allowed is "
            f"{FORCE_RANGE_F0[0]:g} to {FORCE_RANGE_F0[1]:g}; check its unit ({column.unit_name}) and f0"
        )
    if scaling is False or (scaling is None and not mapping.isometric_fractions):
        return Force(force, f0_n, notes)
    fraction = _fraction(table, mapping, pca)
    if force[isometric].size == 0:
        warning = f"{table.path} does not begin isometrically; its force is not scaled to an isometric trial"
        return Force(force, f0_n, (*notes, "not scaled to an isometric trial"), (warning,))
    initial = float(np.mean(force[isometric])) / f0_n
    if initial <= 0.0:
        raise UserError(
            f"{table.path}: the initial isometric force is {initial:.4g} F0; scaling it to {fraction:.4g} F0 needs one "
            "above 0; use --no-isometric-scaling"
        )
    factor = fraction / initial
    note = f"force multiplied by {factor!r}, so that its initial isometric part is {fraction:.6g} F0"
    if mapping.isometric_source:
        note += f" ({mapping.isometric_source})"
    warnings: tuple[str, ...] = ()
    if not EXPECTED_SCALING[0] <= factor <= EXPECTED_SCALING[1]:
        warnings = (
            f"{table.path}: force was multiplied by {factor:.4g} to match the isometric trial; expected is "
            f"{EXPECTED_SCALING[0]:g} to {EXPECTED_SCALING[1]:g}; check f0 and pCa",
        )
    return Force(force * factor, f0_n, (*notes, note), warnings)


def _fraction(table: Table, mapping: ImportMapping, pca: float | None) -> float:
    if not mapping.isometric_fractions:
        raise UserError(
            f"{table.path}: isometric scaling needs isometric_scaling.fractions_f0 in the mapping; add it or use "
            "--no-isometric-scaling"
        )
    near = [known for known in mapping.isometric_fractions if pca is not None and abs(known - pca) < 1e-6]
    if not near:
        found = "changes" if pca is None else f"is {pca:g}"
        known = ", ".join(f"{each:g}" for each in sorted(mapping.isometric_fractions))
        raise UserError(
            f"{table.path}: pCa {found}; isometric_scaling.fractions_f0 of {mapping.where} has {known}; add it or use "
            "--no-isometric-scaling"
        )
    return mapping.isometric_fractions[near[0]]
