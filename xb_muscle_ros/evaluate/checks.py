"""Is a recording fit to be evaluated? Each fault is one line that names the bag, the value and the remedy."""

from __future__ import annotations

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.completing import pca_of
from xb_muscle_ros.trials.trial import Phase, Trial

_AMPLITUDE_L0 = 0.5
_PERCENT = 0.25
_SHORTEST_COMPARED_S, _SMALLEST_COMPARED_L0 = 0.02, 0.01


def check_trial(trial: Trial, where: str) -> None:
    """Refuse a trial that cannot be evaluated, though its values are those of a muscle (`trials.checks`).

    Args:
        trial: as read, complete.
        where: the bag, for messages.

    Raises:
        UserError: no measured force, or none where the length has its stretches; amplitude or recovery time in another
            unit than its fact has; pCa missing.
    """
    if trial.force_time_s.size == 0:
        raise UserError(
            f"bag {where}: there is no measured force on /muscle/measured_force; evaluate compares with measurements"
        )
    _check_pca(trial, where)
    _check_protocol(trial, where)
    _check_cover(trial, where)


def _check_pca(trial: Trial, where: str) -> None:
    calcium = trial.calcium_um
    if pca_of(trial) is None and np.ptp(calcium) == 0.0:
        raise UserError(
            f"bag {where}: pCa is missing: custom_data has no 'pca' and calcium is {calcium[0]:g} µM; add one of them"
        )


def _check_protocol(trial: Trial, where: str) -> None:
    facts = trial.facts
    amplitude, recovery = facts.amplitude_l0, facts.recovery_s
    if amplitude is not None and not 0.0 <= amplitude <= _AMPLITUDE_L0:
        raise UserError(
            f"bag {where}: amplitude_l0 is {amplitude:g}; allowed is 0 to {_AMPLITUDE_L0:g}: amplitudes are fractions "
            "of L0, not percent"
        )
    phases = trial.phases_by_name()
    stretch, rest = phases.get("conditioning_stretch"), phases.get("recovery")
    if amplitude is not None and stretch is not None and amplitude >= _SMALLEST_COMPARED_L0:
        at = np.interp([stretch.start_s, stretch.end_s], trial.time_s, trial.length_change_l0)
        _compare(float(at[1] - at[0]), amplitude, "amplitude_l0", "L0", where, stretch)
    if recovery is not None and rest is not None and rest.end_s - rest.start_s >= _SHORTEST_COMPARED_S:
        _compare(rest.end_s - rest.start_s, recovery, "recovery_s", "s", where, rest)


def _compare(found: float, told: float, name: str, unit: str, where: str, phase: Phase) -> None:
    if abs(found - told) > _PERCENT * abs(found):
        raise UserError(
            f"bag {where}: {name} is {told:g} {unit}, but the {phase.name.replace('_', ' ')} at {phase.start_s:.4f} s "
            f"has {found:.4g} {unit}; correct the one that is wrong"
        )


def _check_cover(trial: Trial, where: str) -> None:
    """Force has to be there where length moves."""
    stretches = [
        phase for phase in trial.facts.phases if "stretch" in phase.name or phase.name in ("shortening", "release")
    ]
    first = min((p.start_s for p in stretches), default=float(trial.time_s[0]))
    last = max((p.end_s for p in stretches), default=float(trial.time_s[-1]))
    step = float(np.max(np.diff(trial.force_time_s), initial=0.0))
    usual = float(np.median(np.diff(trial.force_time_s))) if trial.force_time_s.size > 1 else np.inf
    begin, end = float(trial.force_time_s[0]), float(trial.force_time_s[-1])
    if begin > first + 2.0 * usual or end < last - 2.0 * usual or trial.force_time_s.size < 2:
        raise UserError(
            f"bag {where}: measured force covers {begin:.4g} to {end:.4g} s, lengths move from {first:.4g} to "
            f"{last:.4g} s; give both over the same time"
        )
    if step > max(20.0 * usual, 0.02):
        at = float(trial.force_time_s[int(np.argmax(np.diff(trial.force_time_s)))])
        raise UserError(
            f"bag {where}: measured force has no sample for {step:.3g} s after t = {at:.4g} s; allowed is "
            f"{max(20.0 * usual, 0.02):.3g} s; fill the gap or cut the trial there"
        )
