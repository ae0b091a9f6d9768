"""Measured force of a trial in N or relative to F0, scaled to that of the matching isometric trial where asked for.

A fibre runs down from trial to trial. The paper's data are therefore multiplied, trial by trial, so that the force
before the first stretch equals the one the fibre had in the isometric trial of that pCa.
"""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.checks import FORCE_F0
from xb_muscle_ros.trials.phases import initial_isometric
from xb_muscle_ros.trials.readers.base import Draft
from xb_muscle_ros.trials.readers.description import ImportMapping
from xb_muscle_ros.trials.trial import Array, Phase

# Run-down and changes of preparation stay within these; beyond, the table or the unit is suspect.
EXPECTED_SCALING = (0.5, 2.0)
# Force has settled in this part of the slack after a release (from, to; as fractions of it).
SLACK_PART = (0.6, 0.9)


# Base units, for notes.
_BASE = {"force": "N", "stress": "Pa", "relative force": "F0"}


class Force(NamedTuple):
    """Force (N; empty where not measured) at its times (s), and the force that is F0 (N)."""

    time_s: Array
    force_n: Array
    f0_n: float = 1.0


def read_force(
    draft: Draft, time_s: Array, phases: tuple[Phase, ...], pca: float | None, scaling: bool | None
) -> Force:
    """Make force of the force column.

    Args:
        time_s: the force's own times, s.
        pca: None where calcium changes.
        scaling: scale to the isometric trial; None where the mapping has fractions.

    Raises:
        UserError: a force no muscle has, no slack to take zero from, or scaling that is wanted and cannot be done.
    """
    where, mapping, signal = draft.where, draft.mapping, draft.recording.signals.get("force")
    if signal is None or mapping.force is None:
        if scaling:
            raise UserError(f"{where}: isometric scaling needs a force column; name it or leave the scaling out")
        return Force(np.empty(0), np.empty(0))
    force = signal.values * mapping.force.unit.factor
    if mapping.force_zero is not None:
        # The signal has been multiplied with the gear ratio by its reader.
        force = force - mapping.force_zero.value * (mapping.gear_ratio or 1.0)
        draft.notes.append(
            f"{mapping.force_zero.value:.6g} {_BASE[mapping.force_zero.kind]} of the recorded force are its zero"
        )
    if mapping.force_zero_from_slack:
        zero = _slack_force(where, time_s, force, phases)
        force = force - zero
        how = "that of the slack fibre after its release"
        draft.notes.append(f"zero force is {how}, {zero:.6g} in the unit of the file")
    f0_n, f0 = 1.0, mapping.f0
    if f0 is None:
        draft.notes.append("forces come relative to F0 and are stored with 1 N for F0")
    elif f0.kind == "stress":
        force = force / f0.value
        draft.notes.append(f"stress divided by F0 = {f0.value:.6g} Pa{mapping.f0_note}, stored with 1 N for F0")
    else:
        f0_n = f0.value
        relative = mapping.force.unit.kind == "relative force"
        force = force * (f0_n if relative else 1.0)
        draft.notes.append(f"{'forces come relative to ' * relative}F0 = {f0_n:.6g} N{mapping.f0_note}")
    if f0 is not None or mapping.force.unit.kind == "relative force":  # F0 that is sought is not known here
        remedy = f"check its unit ({mapping.force.unit_name}) and f0, or mend or cut the record"
        signal.check(where, force / f0_n, FORCE_F0, "{:.6g} F0", remedy)
    if scaling or (scaling is None and mapping.isometric_fractions):
        force = force * _scaling(draft, Force(time_s, force, f0_n), phases, pca)
    return Force(time_s, force, f0_n)


def isometric_force(force: Force, phases: tuple[Phase, ...]) -> float | None:
    """Mean force before the first change of length, N; None where the trial does not begin isometrically."""
    initial = force.force_n[initial_isometric(force.time_s, phases)]
    return float(np.mean(initial)) if initial.size else None


def _scaling(draft: Draft, force: Force, phases: tuple[Phase, ...], pca: float | None) -> float:
    """What force is multiplied by, so that its initial isometric part is that of the isometric trial."""
    where, mapping = draft.where, draft.mapping
    fraction = _fraction(where, mapping, pca)
    mean_n = isometric_force(force, phases)
    if mean_n is None:
        draft.warnings.append(f"{where} does not begin isometrically; its force is not scaled to an isometric trial")
        draft.notes.append("not scaled to an isometric trial")
        return 1.0
    initial = mean_n / force.f0_n
    if initial <= 0.0:
        raise UserError(
            f"{where}: the initial isometric force is {initial:.4g} F0; scaling it to {fraction:.4g} F0 needs one "
            "above 0; use --no-isometric-scaling"
        )
    factor = fraction / initial
    source = f" ({mapping.isometric_source})" if mapping.isometric_source else ""
    draft.notes.append(
        f"force multiplied by {factor!r}, so that its initial isometric part is {fraction:.6g} F0{source}"
    )
    low, high = EXPECTED_SCALING
    if not low <= factor <= high:
        draft.warn(
            f"force was multiplied by {factor:.4g} to match the isometric trial; expected is {low:g} to {high:g}; "
            "check f0 and pCa"
        )
    return factor


def _slack_force(where: str, time_s: Array, force: Array, phases: tuple[Phase, ...]) -> float:
    """Mean force of the slack between a release and what follows it."""
    for release, slack in itertools.pairwise(phases):
        if release.name == "release" and slack.name in ("hold", "recovery"):
            duration_s = slack.end_s - slack.start_s
            from_s, to_s = (slack.start_s + part * duration_s for part in SLACK_PART)
            inside = force[(time_s >= from_s) & (time_s <= to_s)]
            if inside.size:
                return float(np.mean(inside))
    raise UserError(f"{where}: no release leaves the fibre slack, so zero force is not known; use 'zero: as_recorded'")


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
