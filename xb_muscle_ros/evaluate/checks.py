"""Is a recording fit to be evaluated? What is wrong is one line with the bag, the value and the remedy."""

from __future__ import annotations

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.completing import pca_of
from xb_muscle_ros.trials.trial import Phase, Trial


def check_trial(trial: Trial, where: str) -> None:
    """Refuse a trial that cannot be evaluated, though its values are those of a muscle (`trials.checks`).

    Raises:
        UserError: no measured force, or none where the length has its stretches; pCa missing.
    """
    if trial.force_time_s.size == 0:
        raise UserError(
            f"bag {where}: there is no measured force on /muscle/measured_force; evaluate compares with measurements"
        )
    calcium = trial.calcium_um
    if pca_of(trial) is None and np.ptp(calcium) == 0.0:
        raise UserError(
            f"bag {where}: pCa is missing: custom_data has no 'pca' and calcium is {calcium[0]:g} µM; add one of them"
        )
    _check_cover(trial, where)


def moving(trial: Trial) -> list[Phase]:
    """Phases in which the length changes."""
    return [phase for phase in trial.facts.phases if "stretch" in phase.name or phase.name in ("shortening", "release")]


def _check_cover(trial: Trial, where: str) -> None:
    """Force has to be there where length moves."""
    first = min((p.start_s for p in moving(trial)), default=float(trial.time_s[0]))
    last = min(max((p.end_s for p in moving(trial)), default=np.inf), float(trial.time_s[-1]))
    step = float(np.max(np.diff(trial.force_time_s), initial=0.0))
    usual = float(np.median(np.diff(trial.force_time_s)))
    begin, end = float(trial.force_time_s[0]), float(trial.force_time_s[-1])
    if begin > first + 2.0 * usual or end < last - 2.0 * usual:
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
