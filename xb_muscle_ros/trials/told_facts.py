"""Are amplitude and recovery that a bag tells those of its lengths? Each fault is one line with both values."""

from __future__ import annotations

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.trial import Phase, Trial

_AMPLITUDE_L0 = 0.5
_PERCENT = 0.25
_SHORTEST_COMPARED_S, _SMALLEST_COMPARED_L0 = 0.02, 0.01


def check_told_facts(trial: Trial, where: str) -> None:
    """Refuse facts in another unit, or of another trial.

    Args:
        trial: with all facts.
        where: the bag, for messages.

    Raises:
        UserError: the amplitude is no fraction of L0, or amplitude or recovery differ from what the phases have.
    """
    facts = trial.facts
    amplitude, recovery = facts.amplitude_l0, facts.recovery_s
    if amplitude is not None and not 0.0 <= amplitude <= _AMPLITUDE_L0:
        raise UserError(
            f"bag {where}: amplitude_l0 is {amplitude:g}; allowed is 0 to {_AMPLITUDE_L0:g}: amplitudes are fractions "
            "of L0, not percent"
        )
    phases = {name: phase for name, phase in trial.phases_by_name().items() if _is_recorded(trial, phase)}
    stretch, rest = phases.get("conditioning_stretch"), phases.get("recovery")
    if amplitude is not None and stretch is not None and amplitude >= _SMALLEST_COMPARED_L0:
        at = np.interp([stretch.start_s, stretch.end_s], trial.time_s, trial.length_change_l0)
        _compare(float(at[1] - at[0]), amplitude, "amplitude_l0", "L0", where, stretch)
    if recovery is not None and rest is not None and rest.end_s - rest.start_s >= _SHORTEST_COMPARED_S:
        _compare(rest.end_s - rest.start_s, recovery, "recovery_s", "s", where, rest)


def _is_recorded(trial: Trial, phase: Phase) -> bool:
    """Whether lengths cover a phase; a bag that was cut short may end within."""
    return bool(trial.time_s[0] <= phase.start_s and phase.end_s <= trial.time_s[-1])


def _compare(found: float, told: float, name: str, unit: str, where: str, phase: Phase) -> None:
    if abs(found - told) > _PERCENT * abs(found):
        raise UserError(
            f"bag {where}: {name} is {told:g} {unit}, but the {phase.name.replace('_', ' ')} at {phase.start_s:.4f} s "
            f"has {found:.4g} {unit}; correct the one that is wrong"
        )
