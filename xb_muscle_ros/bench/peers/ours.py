"""Our models in the same comparison."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

import numpy as np

from xb_muscle_ros.bench.papers_trial import PapersTrial
from xb_muscle_ros.bench.peers.muscle import Cost, loosest
from xb_muscle_ros.evaluate import grid
from xb_muscle_ros.evaluate.sets import ModelSet
from xb_muscle_ros.evaluate.srs_table import SrsTable
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.scores.conditions import AMPLITUDES_L0, RECOVERIES_S
from xb_muscle_ros.work.plain import from_plain

_DEFAULT, _REFERENCE = 1e-6, 1e-10
_TOLERANCES = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7)


def simulate(models: ModelSet, fibres: Sequence[str], done: Callable[[], None] = lambda: None) -> SrsTable:
    """A parameter set at the paper's conditions and all pCa, its activation that of its own thin filament.

    Raises:
        UserError, StateViolation: see `grid.simulate`.
    """
    of = ModelSet(models.name, {name: models.fibres[name] for name in fibres}, (), models.borrowed_from)
    made = grid.tasks([of], recoveries_s=RECOVERIES_S, amplitudes_l0=(0.0, *AMPLITUDES_L0))
    found = []
    for k, task in enumerate(made):
        found.append(from_plain(grid.Cells, grid.simulate(task)))
        if (k + 1) % len(grid.PCAS) == 0:
            done()
    return grid.table(of.title, list(of.fibres.values()), made, found)


def cost(muscle: Muscle, repeats: int) -> list[Cost]:
    """The paper's trial with variable steps, force at 1 kHz included; see `muscle.PeerMuscle.cost`."""
    trial = PapersTrial(muscle)
    exact = trial.force_f0(trial.variable(_REFERENCE))
    errors = {
        tolerance: float(np.max(np.abs(trial.force_f0(trial.variable(tolerance)) - exact))) for tolerance in _TOLERANCES
    }

    def seconds(tolerance: float) -> float:
        begin = time.perf_counter()
        trial.force_f0(trial.variable(tolerance))
        return time.perf_counter() - begin

    return [
        Cost(
            f"Rosenbrock, tolerance {tolerance:g}", [seconds(tolerance) for _ in range(repeats)], errors[tolerance], own
        )
        for tolerance, own in ((_DEFAULT, True), (loosest(errors), False))
    ]
