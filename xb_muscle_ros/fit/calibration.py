"""A held-out trial's own bathing solution: its pCa shift from the force before anything moves, and from nothing else.

On the steep part of the force-pCa curve the error that solutions have (SD 0.05) is worth 6 % F0 and more. A prediction
of what a stretch does can be judged only once that is out of the way; the isometric force before the stretch tells it.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.optimize import minimize_scalar

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.fit.data import FitTrial
from xb_muscle_ros.fit.problem import Problem
from xb_muscle_ros.measurement.faults import FAULTS
from xb_muscle_ros.measurement.recording import recorded_force
from xb_muscle_ros.models.muscle import Muscle

Array = npt.NDArray[np.float64]

_SHIFT = FAULTS["pca_shift"]
# How well the model is trusted to know isometric force, F0: far better than the shift's prior says.
_FORCE_SD_F0 = 0.005
_MOST = 4.0


def calibrated_force(problem: Problem, z: Array, trial: FitTrial) -> tuple[Array, float] | None:
    """Force of a trial with the pCa shift that its isometric force asks for.

    Args:
        problem: of the fit; its faults other than the shift stay as they are.
        z: fitted point.
        trial: one whose solution the fit did not see.

    Returns:
        recorded force at the times that count, F0, and the shift; None where the trial has no steady isometric force
        before the first change of length, or the model no solution.
    """
    inside = trial.steady
    if np.count_nonzero(inside) < 3:
        return None
    muscle, faults = Muscle(problem.fibre_at(z)), problem.faults_at(z, trial)
    measured = float(np.mean(trial.measured_f0[inside]))

    def force(shift: float) -> Array:
        calcium = trial.calcium_um * 10.0**-shift
        state = muscle.settle(float(trial.length_l0[0]), float(calcium[0]))
        states = muscle.run(state, trial.dt_s, trial.length_l0, calcium)
        out = recorded_force(trial.time_s, muscle.outputs_of(states)["force_f0"], faults, trial.order)
        return np.interp(trial.force_time_s, trial.time_s, out)

    def distance(shift: float) -> float:
        try:
            difference = float(np.mean(force(shift)[inside])) - measured
        except UserError:
            return 1e6
        return (difference / _FORCE_SD_F0) ** 2 + (shift / _SHIFT.sd) ** 2

    reach = _MOST * _SHIFT.sd
    # Cooperative fibres may answer with a jump: look everywhere before closing in.
    rough = np.linspace(-reach, reach, 33)
    best = float(rough[int(np.argmin([distance(float(shift)) for shift in rough]))])
    step = float(rough[1] - rough[0])
    found: Any = minimize_scalar(distance, bounds=(best - step, best + step), method="bounded")  # type: ignore[call-overload]
    try:
        return force(float(found.x)), float(found.x)
    except UserError:
        return None
