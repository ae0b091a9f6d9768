"""How much of an effect ordinary measurement artefacts could explain as well."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from xb_muscle_ros.diagnose.names import Name
from xb_muscle_ros.prove.generator.artefacts import PRIORS
from xb_muscle_ros.prove.generator.refit import Refit, Refitted
from xb_muscle_ros.prove.generator.study import Planned
from xb_muscle_ros.prove.generator.truth import Truth, study_forces
from xb_muscle_ros.prove.generator.world import SAMPLE_S, World
from xb_muscle_ros.trials.trial import Array

_SHIFT, _GAIN = 0.01, 0.01
# Ten independent observations of 0.3 % F0 a trial.
_WORTH, _WORTH_SD = 10.0, 0.003


def residual_beside_nuisances(base: World, study: Sequence[Planned], refit: Refit, refitted: Refitted) -> list[Array]:
    """Residual, F0, by trial, when constants and ordinary artefacts together are fitted once more, linearly.

    Artefacts have their usual SDs as priors: pCa of each solution, length gain, run-down, offset and drift of each
    trial, delay (a transducer's lag is the same to first order).
    """
    residual = np.concatenate(refitted.residual)
    if not np.any(residual):
        return list(refitted.residual)
    truth, sizes = Truth(base), {name: prior.ordinary for name, prior in PRIORS.items()}
    columns = artefact_columns(
        lambda shift, gain: study_forces(truth, [trial.stimulus(shift, gain) for trial in study]),
        study, refit.plain(), sizes,
    )  # fmt: skip
    jacobian = np.column_stack([refit.jacobian, *columns])
    weight = np.sqrt(_WORTH * len(study) / residual.size) / _WORTH_SD
    a = np.vstack([weight * jacobian, np.eye(jacobian.shape[1])])
    b = np.concatenate([weight * residual, np.zeros(jacobian.shape[1])])
    solution: Array = np.linalg.lstsq(a, b, rcond=None)[0]
    return refit.split(residual - jacobian @ solution)


def artefact_columns(
    forces: Callable[[float, float], Sequence[Array]], study: Sequence[Planned], plain: Sequence[Array],
    sizes: Mapping[str, float],
) -> list[Array]:  # fmt: skip
    """Change of all forces by one SD of each measurement artefact.

    Args:
        forces: of every trial, F0, where pCa is so much higher and length changes are so much larger.
        plain: forces without artefacts.
        sizes: SD by name of the artefact: pCa of each solution, length gain, run-down, delay, offset and drift of each
            trial. Those that are not named are left out.
    """

    def of_trials(parts: Sequence[Array | None]) -> Array:
        return np.concatenate([np.zeros(f.size) if p is None else p for p, f in zip(parts, plain, strict=True)])

    columns = []
    if (sd := sizes.get(Name.PCA_SHIFT)) is not None:
        by_shift = [(a - b) * sd / _SHIFT for a, b in zip(forces(_SHIFT, 0.0), plain, strict=True)]
        for pca in sorted({trial.pca for trial in study}):
            columns.append(
                of_trials([part if trial.pca == pca else None for part, trial in zip(by_shift, study, strict=True)])
            )
    if (sd := sizes.get(Name.LENGTH_GAIN)) is not None:
        columns.append(of_trials([(a - b) * sd / _GAIN for a, b in zip(forces(0.0, _GAIN), plain, strict=True)]))
    if (sd := sizes.get(Name.RUN_DOWN)) is not None:
        columns.append(of_trials([-i * sd * force for i, force in enumerate(plain)]))
    if (sd := sizes.get(Name.TIME_SHIFT)) is not None:
        columns.append(of_trials([-sd * np.gradient(force, SAMPLE_S) for force in plain]))
    for i, force in enumerate(plain):
        for name, shape in (
            (Name.FORCE_OFFSET, np.ones(force.size)),
            (Name.FORCE_DRIFT, np.arange(force.size) * SAMPLE_S),
        ):
            if (sd := sizes.get(name)) is not None:
                columns.append(of_trials([sd * shape if j == i else None for j in range(len(plain))]))
    return columns
