"""The paper's grid of conditions through a model: SRS of every cell, isometric force and k_tr.

Trials of one fibre and pCa differ only in what follows the isometric phase, and test stretches only in what went
before their onset. So a fibre settles once for each pCa, stretches and shortens once for each amplitude, rests once
through all recovery times, and takes the ten milliseconds of test stretch that its SRS needs: 4,410 trials take about
a second.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from xb_muscle_ros.errors import UserError, naming
from xb_muscle_ros.evaluate.sets import ModelSet
from xb_muscle_ros.evaluate.srs_table import FibreSrs, SrsTable, place
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.models.plain import fibre_to_plain, muscle_of_plain
from xb_muscle_ros.protocols.ktr import RAMP_S, RELEASE_L0, SLACK_S
from xb_muscle_ros.scores.conditions import COMMON_AMPLITUDE_L0
from xb_muscle_ros.scores.estimate import Estimate, Missing
from xb_muscle_ros.scores.redevelopment import redevelopment
from xb_muscle_ros.simulation.stretches import followed, onset_stiffness, stretched_and_back
from xb_muscle_ros.trials.trial import Array
from xb_muscle_ros.work.plain import to_plain

AMPLITUDES_L0 = (0.0, 0.0012, 0.0038, 0.0121, 0.0216, 0.0288, 0.0383, 0.0532, 0.0682)
RECOVERIES_S = (0.001, 0.01, 0.05, 0.1, 0.2, 0.316, 0.5, 1.0, 3.16, 10.0)
PCAS = (4.5, 6.1, 6.2, 6.3, 6.4, 6.6, 9.0)
# Force is followed for this long after release and restretch.
_REDEVELOP_S = 5.0

Task = dict[str, Any]


def tasks(
    sets: Iterable[ModelSet],
    pcas: Sequence[float] = PCAS,
    recoveries_s: Sequence[float] = RECOVERIES_S,
    amplitudes_l0: Sequence[float] = AMPLITUDES_L0,
    settle_s: float | None = None,
) -> list[Task]:
    """One task for each set, fibre and pCa, in this order.

    Args:
        sets: what to simulate.
        pcas, recoveries_s, amplitudes_l0: axes of the grid; recoveries ascending, s; amplitudes in L0.
        settle_s: isometric time from rest before the protocol, s; None: until at rest.
    """
    return [
        {
            "fibre": fibre_to_plain(fibre),
            "pca": pca,
            "recoveries_s": list(recoveries_s),
            "amplitudes_l0": list(amplitudes_l0),
            "settle_s": settle_s,
        }
        for each in sets
        for fibre in each.fibres.values()
        for pca in pcas
    ]


@dataclass(frozen=True)
class Cells:
    """What one fibre shows at one pCa.

    Attributes:
        srs_test: F0/L0, recovery x amplitude.
        srs_conditioning: F0/L0.
        isometric_f0: F0.
        k_tr: rate of force redevelopment, 1/s, or why force does not redevelop or the release cannot be simulated.
    """

    srs_test: Sequence[Sequence[float]]
    srs_conditioning: float
    isometric_f0: float
    k_tr: Estimate


def simulate(task: Mapping[str, Any]) -> dict[str, Any]:
    """`Cells` of one fibre and pCa, a task of `tasks`, as plain data.

    Raises:
        UserError, StateViolation: see `Muscle.settle` and `Muscle.step`.
    """
    with naming(f"simulation at pCa {task['pca']:g}"):
        return to_plain(_simulated(muscle_of_plain(task["fibre"]), task))


def _simulated(muscle: Muscle, task: Mapping[str, Any]) -> Cells:
    calcium = 10.0 ** (6.0 - task["pca"])
    settled = muscle.settle(0.0, calcium, task["settle_s"])
    recoveries = np.array(task["recoveries_s"])
    srs_test = np.empty((recoveries.size, len(task["amplitudes_l0"])))
    for j, amplitude in enumerate(task["amplitudes_l0"]):
        state = stretched_and_back(muscle, settled, amplitude, calcium) if amplitude else settled
        for i, recovered in enumerate(followed(muscle, state, recoveries, 0.0 * recoveries, calcium)):
            srs_test[i, j] = onset_stiffness(muscle, recovered, calcium)
    try:
        k_tr = _redeveloped(muscle, settled, calcium)
    except UserError as error:
        # A hundred times as fast as the protocol: not every method follows, and nothing else depends on it.
        k_tr = Estimate(None, why=str(error))
    conditioning, isometric_f0 = onset_stiffness(muscle, settled, calcium), muscle.outputs(settled).force_f0
    return Cells(srs_test.tolist(), conditioning, isometric_f0, k_tr)


def table(label: str, fibres: Sequence[Fibre], made: Sequence[Task], results: Sequence[Cells]) -> SrsTable:
    """Results of one set's tasks as a table.

    Args:
        fibres: in the order of the tasks.
        made, results: tasks of these fibres, and what `simulate` made of them.
    """
    pcas = list(dict.fromkeys(task["pca"] for task in made))
    recoveries, amplitudes = np.array(made[0]["recoveries_s"]), np.array(made[0]["amplitudes_l0"])
    shape = (len(pcas), recoveries.size, amplitudes.size)
    column = place(amplitudes, COMMON_AMPLITUDE_L0)
    held = {}
    for k, fibre in enumerate(fibres):
        cells = results[k * len(pcas) : (k + 1) * len(pcas)]
        conditioning, isometric = np.full(shape, np.nan), np.full(shape, np.nan)
        isometric[:] = np.array([cell.isometric_f0 for cell in cells])[:, None, None]
        if column is not None:
            conditioning[:, :, column] = np.array([cell.srs_conditioning for cell in cells])[:, None]
        held[fibre.name] = FibreSrs(np.array([cell.srs_test for cell in cells]), conditioning, isometric)
    return SrsTable(label, np.array(pcas), recoveries, amplitudes, held)


def _redeveloped(muscle: Muscle, state: Array, calcium: float) -> Estimate:
    corner_s = np.cumsum([RAMP_S, SLACK_S, RAMP_S])
    away = followed(muscle, state, corner_s, np.array([-RELEASE_L0, -RELEASE_L0, 0.0]), calcium)[-1]
    time_s = np.arange(1, round(_REDEVELOP_S * 1e3) + 1) * 1e-3
    states = followed(muscle, away, time_s, 0.0 * time_s, calcium)
    force = muscle.outputs_of(states)["force_f0"]
    found = redevelopment(time_s, force, 0.0, _REDEVELOP_S)
    # Without noise there is no error.
    return Estimate(None, why=found.why) if isinstance(found, Missing) else Estimate(found.k_per_s)
