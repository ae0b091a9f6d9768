"""A trial as it travels through ROS: stamps in whole ns, and which calcium acts when."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.trials.stamps import to_ns
from xb_muscle_ros.trials.trial import Trial


class Plan(NamedTuple):
    """A trial as it travels: stamps in ns, and the index of the calcium that acts in the step to each sample."""

    stamps: npt.NDArray[np.int64]
    calcium_stamps: npt.NDArray[np.int64]
    held: npt.NDArray[np.intp]

    @classmethod
    def of(cls, trial: Trial) -> Plan:
        """Plan of a trial.

        Raises:
            UserError: no samples, stamps that do not ascend, or no calcium at the first sample.
        """
        stamps = _stamps(trial.time_s, trial, "length")
        calcium_stamps = _stamps(trial.calcium_time_s, trial, "calcium")
        starts = np.concatenate([stamps[:1], stamps[:-1]])
        held = np.searchsorted(calcium_stamps, starts, side="right") - 1
        if stamps.size == 0 or held[0] < 0:
            raise UserError(
                f"trial {trial.facts.trial}: no calcium is known at its first length sample; "
                "give the calcium that the fibre starts with"
            )
        return cls(stamps, calcium_stamps, held)


def _stamps(time_s: npt.NDArray[np.float64], trial: Trial, what: str) -> npt.NDArray[np.int64]:
    """Times as whole ns, as they travel."""
    stamps: npt.NDArray[np.int64] = to_ns(time_s)
    if np.any(np.diff(stamps) <= 0):
        k = int(np.flatnonzero(np.diff(stamps) <= 0)[0]) + 1
        raise UserError(f"trial {trial.facts.trial}: {what} stamps do not ascend at {time_s[k]:.9f} s; mend the trial")
    return stamps
