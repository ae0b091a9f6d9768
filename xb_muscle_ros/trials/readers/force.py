"""Measured force of a trial in N or relative to F0, scaled to that of the matching isometric trial where asked for.

A fibre runs down from trial to trial. The paper's data are therefore multiplied, trial by trial, so that the force
before the first stretch equals the one the fibre had in the isometric trial of that pCa.
"""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.phases import initial_isometric
from xb_muscle_ros.trials.readers.description import ImportMapping
from xb_muscle_ros.trials.readers.recording import Signal
from xb_muscle_ros.trials.trial import Array, Phase

# Beyond these it is no muscle's force, or its unit is wrong.
FORCE_RANGE_F0 = (-20.0, 20.0)
# Run-down and changes of preparation stay within these; beyond, the table or the unit is suspect.
EXPECTED_SCALING = (0.5, 2.0)
# Force has settled in this part of the slack after a release (from, to; as fractions of it).
SLACK_PART = (0.6, 0.9)


class Force(NamedTuple):
    """Force (N; empty where not measured) at its times (s), the force that is F0 (N), notes and warnings."""

    time_s: Array
    force_n: Array
    f0_n: float = 1.0
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()


class Context(NamedTuple):
    """What else is known of the trial when its force is read.

    Attributes:
        where: the trial, for messages.
        time_s: the force's own times, s.
        phases: of the trial.
        pca: None where calcium changes.
    """

    where: str
    time_s: Array
    phases: tuple[Phase, ...]
    pca: float | None


def read_force(signal: Signal | None, mapping: ImportMapping, context: Context, scaling: bool | None) -> Force:
    """Make force of the force column.

    Args:
        signal: as the file has it; None where it has no force.
        mapping: its unit, F0 and the isometric fractions.
        context: see there.
        scaling: scale to the isometric trial; None where the mapping has fractions.

    Raises:
        UserError: a force no muscle has, no slack to take zero from, or scaling that is wanted and cannot be done.
    """
    where, column = context.where, mapping.force
    if signal is None or column is None:
        if scaling:
            raise UserError(f"{where}: isometric scaling needs a force column; name it or leave the scaling out")
        return Force(np.empty(0), np.empty(0))
    force = signal.values * column.unit.factor
    notes: tuple[str, ...] = ()
    if mapping.force_zero_from_slack:
        zero = _slack_force(force, context)
        force = force - zero
        notes = (f"zero force is that of the slack fibre after its release, {zero:.6g} in the unit of the file",)
    if mapping.f0 is None:
        f0_n = 1.0
        notes = (*notes, "forces come relative to F0 and are stored with 1 N for F0")
    elif mapping.f0.kind == "stress":
        force, f0_n = force / mapping.f0.value, 1.0
        notes = (*notes, f"stress divided by F0 = {mapping.f0.value:.6g} Pa{mapping.f0_note}, stored with 1 N for F0")
    else:
        f0_n = mapping.f0.value
        notes = (*notes, f"F0 = {f0_n:.6g} N{mapping.f0_note}")
    bad = np.flatnonzero(~((force >= FORCE_RANGE_F0[0] * f0_n) & (force <= FORCE_RANGE_F0[1] * f0_n)))
    if bad.size:
        i = int(bad[0])
        raise UserError(
            f"{signal.place(where, i)} is {force[i] / f0_n:.6g} F0; allowed is "
            f"{FORCE_RANGE_F0[0]:g} to {FORCE_RANGE_F0[1]:g}; check its unit ({column.unit_name}) and f0"
        )
    made = Force(context.time_s, force, f0_n, notes)
    if scaling is False or (scaling is None and not mapping.isometric_fractions):
        return made
    return _scaled(made, mapping, context)


def isometric_force(force: Force, phases: tuple[Phase, ...]) -> float | None:
    """Mean force before the first change of length, N; None where the trial does not begin isometrically."""
    initial = force.force_n[initial_isometric(force.time_s, phases)]
    return float(np.mean(initial)) if initial.size else None


def _scaled(made: Force, mapping: ImportMapping, context: Context) -> Force:
    where = context.where
    fraction = _fraction(where, mapping, context.pca)
    mean_n = isometric_force(made, context.phases)
    if mean_n is None:
        warning = f"{where} does not begin isometrically; its force is not scaled to an isometric trial"
        return made._replace(notes=(*made.notes, "not scaled to an isometric trial"), warnings=(warning,))
    initial = mean_n / made.f0_n
    if initial <= 0.0:
        raise UserError(
            f"{where}: the initial isometric force is {initial:.4g} F0; scaling it to {fraction:.4g} F0 needs one "
            "above 0; use --no-isometric-scaling"
        )
    factor = fraction / initial
    note = f"force multiplied by {factor!r}, so that its initial isometric part is {fraction:.6g} F0"
    if mapping.isometric_source:
        note += f" ({mapping.isometric_source})"
    warnings: tuple[str, ...] = ()
    if not EXPECTED_SCALING[0] <= factor <= EXPECTED_SCALING[1]:
        warnings = (
            f"{where}: force was multiplied by {factor:.4g} to match the isometric trial; expected is "
            f"{EXPECTED_SCALING[0]:g} to {EXPECTED_SCALING[1]:g}; check f0 and pCa",
        )
    return made._replace(force_n=made.force_n * factor, notes=(*made.notes, note), warnings=warnings)


def _slack_force(force: Array, context: Context) -> float:
    """Mean force of the slack between a release and what follows it."""
    phases = context.phases
    for release, slack in itertools.pairwise(phases):
        if release.name == "release" and slack.name in ("hold", "recovery"):
            duration_s = slack.end_s - slack.start_s
            from_s, to_s = (slack.start_s + part * duration_s for part in SLACK_PART)
            inside = force[(context.time_s >= from_s) & (context.time_s <= to_s)]
            if inside.size:
                return float(np.mean(inside))
    raise UserError(
        f"{context.where}: no release leaves the fibre slack, so zero force is not known; use 'zero: as_recorded'"
    )


def _fraction(where: str, mapping: ImportMapping, pca: float | None) -> float:
    if not mapping.isometric_fractions:
        raise UserError(
            f"{where}: isometric scaling needs isometric_scaling.fractions_f0 in the mapping; add it or use "
            "--no-isometric-scaling"
        )
    near = [known for known in mapping.isometric_fractions if pca is not None and abs(known - pca) < 1e-6]
    if not near:
        found = "changes" if pca is None else f"is {pca:g}"
        known = ", ".join(f"{each:g}" for each in sorted(mapping.isometric_fractions))
        raise UserError(
            f"{where}: pCa {found}; isometric_scaling.fractions_f0 of {mapping.where} has {known}; add it or use "
            "--no-isometric-scaling"
        )
    return mapping.isometric_fractions[near[0]]
