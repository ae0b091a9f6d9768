"""Ordinary error of the measurement, which every composite has, and artefacts that are beyond it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from xb_muscle_ros.diagnose.names import Name
from xb_muscle_ros.prove.generator.recording import Faults
from xb_muscle_ros.prove.generator.study import Planned

ORDINARY: Mapping[str, float] = MappingProxyType(
    {
        Name.PCA_SHIFT.value: 0.04,
        Name.RUN_DOWN.value: 0.003,
        Name.FORCE_OFFSET.value: 0.003,
        Name.LENGTH_GAIN.value: 0.01,
        Name.TIME_SHIFT.value: 7e-4,
    }
)
"""Size of every ordinary error: SD of pCa of a solution, of the offset of a trial (F0), of a study's length gain and
time shift (s); the most that run-down takes of the force from trial to trial."""


class Artefact(NamedTuple):
    """How large an artefact is.

    Attributes:
        unit: what an ordinary one is; drift and lag have no ordinary size, so it is what one would overlook.
        least, most: multiples of it.
    """

    unit: float
    least: float
    most: float


ARTEFACTS: Mapping[str, Artefact] = MappingProxyType(
    {
        Name.PCA_SHIFT.value: Artefact(ORDINARY[Name.PCA_SHIFT.value], 3.0, 6.0),
        Name.RUN_DOWN.value: Artefact(ORDINARY[Name.RUN_DOWN.value], 3.0, 7.0),
        Name.FORCE_OFFSET.value: Artefact(ORDINARY[Name.FORCE_OFFSET.value], 3.0, 8.0),
        Name.FORCE_DRIFT.value: Artefact(0.002, 3.0, 10.0),
        Name.LENGTH_GAIN.value: Artefact(ORDINARY[Name.LENGTH_GAIN.value], 4.0, 10.0),
        Name.TIME_SHIFT.value: Artefact(ORDINARY[Name.TIME_SHIFT.value], 3.0, 6.0),
        Name.TRANSDUCER_LAG.value: Artefact(7e-4, 3.0, 6.0),
    }
)
"""By name."""
# Nobody keeps a fibre that has lost more of its force than this.
_LOST = 0.3


def draw_ordinary(random: np.random.Generator, study: Sequence[Planned]) -> Faults:
    """Errors as any careful study has them."""
    solutions = sorted({trial.pca for trial in study})
    return Faults(
        pca_shift={pca: float(random.normal(0.0, ORDINARY[Name.PCA_SHIFT.value])) for pca in solutions},
        length_gain=float(random.normal(0.0, ORDINARY[Name.LENGTH_GAIN.value])),
        run_down=float(random.uniform(0.0, ORDINARY[Name.RUN_DOWN.value])),
        offset=tuple(float(random.normal(0.0, ORDINARY[Name.FORCE_OFFSET.value])) for _ in study),
        delay_s=float(random.normal(0.0, ORDINARY[Name.TIME_SHIFT.value])),
    )


def with_artefacts(
    names: Sequence[str], random: np.random.Generator, study: Sequence[Planned], ordinary: Faults
) -> Faults:
    """Ordinary errors, but for artefacts that take the place of some."""
    faults = ordinary
    for name in names:
        faults = _with_one(Name(name), random, study, faults)
    return faults


def _with_one(name: Name, random: np.random.Generator, study: Sequence[Planned], faults: Faults) -> Faults:
    unit, least, most = ARTEFACTS[name.value]
    if name is Name.RUN_DOWN:
        most = max(min(most, _LOST / unit / (len(study) - 1)), least)

    def size() -> float:
        return float(unit * random.uniform(least, most))

    def signed() -> float:
        return size() * float(random.choice([-1.0, 1.0]))

    if name is Name.PCA_SHIFT:
        between = sorted({trial.pca for trial in study if 4.5 < trial.pca < 9.0})
        chosen = random.choice(between, int(random.integers(1, 3)), replace=False)
        return replace(faults, pca_shift={**faults.pca_shift, **{float(pca): signed() for pca in chosen}})
    if name is Name.RUN_DOWN:
        return replace(faults, run_down=size())
    if name is Name.FORCE_OFFSET:
        # Of some trials only, or of all.
        count = len(study) if random.random() < 0.5 else max(2, round(0.4 * len(study)))
        moved = {int(i) for i in random.choice(len(study), count, replace=False)}
        return replace(faults, offset=tuple(signed() if i in moved else o for i, o in enumerate(faults.offset)))
    if name is Name.FORCE_DRIFT:
        return replace(faults, drift=tuple(signed() for _ in study))
    if name is Name.LENGTH_GAIN:
        return replace(faults, length_gain=signed())
    if name is Name.TIME_SHIFT:
        return replace(faults, delay_s=signed())
    return replace(faults, lag_s=size())
