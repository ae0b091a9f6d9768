"""What a component does to the force, in plain words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.diagnose.noise.cells import Residual
from xb_muscle_ros.diagnose.words import percent, phase_words

Array = npt.NDArray[np.float64]

# Less is not reported, F0.
_LEAST_F0 = 5e-4


def direction(adds_f0: Mapping[str, Sequence[tuple[Residual, Array]]]) -> str:
    """Where a component raises force most and where it lowers it most.

    Args:
        adds_f0: by fibre, for each trial what the component adds to the force at the residual's times.
    """
    sums: dict[str, list[float]] = {}
    for trials in adds_f0.values():
        for residual, adds in trials:
            for phase in residual.phases:
                inside = (residual.time_s >= phase.start_s) & (residual.time_s <= phase.end_s)
                if np.any(inside):
                    sums.setdefault(phase_words(phase.name), []).append(float(np.mean(adds[inside])))
    if not sums:
        return ""
    means = {phase: float(np.mean(values)) for phase, values in sums.items()}
    up, down = max(means, key=lambda p: means[p]), min(means, key=lambda p: means[p])
    parts = []
    if means[up] > _LEAST_F0:
        parts.append(f"raises force in the {up} by {percent(means[up])} % F0")
    if means[down] < -_LEAST_F0:
        parts.append(f"lowers it in the {down} by {percent(-means[down])} % F0")
    if len(parts) == 1 and means[up] <= _LEAST_F0:
        parts = [parts[0].replace("lowers it", "lowers force")]
    text = " and ".join(parts)
    return f"{text} on average" if text else "changes force by less than 0.05 % F0 on average in every phase"
