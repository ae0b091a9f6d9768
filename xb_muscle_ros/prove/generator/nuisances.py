"""How much of an effect usual faults of the measurement could explain as well."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.diagnose.names import Name
from xb_muscle_ros.prove.generator.recording import PRIORS
from xb_muscle_ros.prove.generator.refit import Refit, Refitted
from xb_muscle_ros.prove.generator.study import Planned
from xb_muscle_ros.prove.generator.truth import Truth, study_forces
from xb_muscle_ros.prove.generator.world import SAMPLE_S, World

Array = npt.NDArray[np.float64]

_SHIFT, _GAIN = 0.01, 0.01
# Ten independent observations of 0.3 % F0 a trial.
_WORTH, _WORTH_SD = 10.0, 0.003


def left_beside_nuisances(base: World, study: Sequence[Planned], refit: Refit, refitted: Refitted) -> list[Array]:
    """What is left, F0, by trial, when constants and usual faults together are fitted once more, linearly.

    Faults have their usual SDs as priors: pCa of each solution, length gain, run-down, offset and drift of each
    trial, delay (a transducer's lag is the same to first order).
    """
    left = np.concatenate(refitted.left)
    if not np.any(left):
        return list(refitted.left)
    faults = _columns(base, study, refit.plain())
    jacobian = np.column_stack([refit.jacobian, *faults])
    weight = np.sqrt(_WORTH * len(study) / left.size) / _WORTH_SD
    a = np.vstack([weight * jacobian, np.eye(jacobian.shape[1])])
    b = np.concatenate([weight * left, np.zeros(jacobian.shape[1])])
    solution: Array = np.linalg.lstsq(a, b, rcond=None)[0]
    return refit.split(left - jacobian @ solution)


def _columns(base: World, study: Sequence[Planned], plain: list[Array]) -> list[Array]:
    """Change of all forces by one SD of each fault."""
    truth = Truth(base)
    sd = {name: prior.sd for name, prior in PRIORS.items()}

    def of_trials(parts: Sequence[Array | None]) -> Array:
        return np.concatenate([np.zeros(f.size) if p is None else p for p, f in zip(parts, plain, strict=True)])

    shifted = study_forces(truth, [trial.stimulus(shift=_SHIFT) for trial in study])
    by_shift = [(a - b) * sd[Name.PCA_SHIFT.value] / _SHIFT for a, b in zip(shifted, plain, strict=True)]
    gained = study_forces(truth, [trial.stimulus(gain=_GAIN) for trial in study])
    columns = [
        of_trials([part if trial.pca == pca else None for part, trial in zip(by_shift, study, strict=True)])
        for pca in sorted({trial.pca for trial in study})
    ]
    columns.append(
        of_trials([(a - b) * sd[Name.LENGTH_GAIN.value] / _GAIN for a, b in zip(gained, plain, strict=True)])
    )
    columns.append(of_trials([-i * sd[Name.RUN_DOWN.value] * force for i, force in enumerate(plain)]))
    columns.append(of_trials([-sd[Name.TIME_SHIFT.value] * np.gradient(force, SAMPLE_S) for force in plain]))
    for i, force in enumerate(plain):
        for name, shape in (
            (Name.FORCE_OFFSET, np.ones(force.size)),
            (Name.FORCE_DRIFT, np.arange(force.size) * SAMPLE_S),
        ):
            columns.append(of_trials([sd[name.value] * shape if j == i else None for j in range(len(plain))]))
    return columns
