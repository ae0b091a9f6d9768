"""Compiled loops take states as they are given: what is none of the fibre is refused at every door."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from test_clamping import FIBRE, muscle_of

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.batch import MuscleBatch
from xb_muscle_ros.models.clamping import clamp, clamp_run
from xb_muscle_ros.models.fibre_file import load_fibre


def test_what_is_no_state_of_the_fibre_is_refused() -> None:
    """Regression: compiled loops read beyond a short state, and whole numbers cut what they wrote."""
    muscle = muscle_of()
    start = muscle.settle(0.0, 1.0)
    dt, ones = np.full(3, 1e-3), np.ones(4)
    calls: list[Any] = [
        lambda state: clamp(muscle, state, 0.3, 1.0, 1e-3),
        lambda state: clamp_run(muscle, state, dt, 0.3 * ones, ones),
        lambda state: muscle.step(state, 0.0, 1.0, 1e-3),
        lambda state: muscle.run(state, dt, 0.0 * ones, ones),
        lambda state: muscle.follow(state, np.arange(4.0), 0.0 * ones, ones, np.arange(4.0)),
        muscle.outputs,
        lambda state: muscle.hold(state, 1.0, 1e-3),
    ]
    for call in calls:
        call(start)
        for wrong in (start[:-1], start.astype(int), start[None], [0.0]):
            with pytest.raises(UserError, match=r"model 3state_coop: a state is float64 of shape \(\d+,\), not"):
                call(wrong)


def test_what_are_no_states_of_the_fibres_is_refused() -> None:
    batch = MuscleBatch([load_fibre(FIBRE), load_fibre(FIBRE)])
    states = batch.settle(np.zeros(2), np.ones(2))
    batch.step(states, np.zeros(2), np.ones(2), 1e-3)
    muscle = batch.muscles[0]
    for wrong in (states[:, :-1], states.astype(int), states.astype(np.float32)):
        for call in (lambda given: batch.step(given, np.zeros(2), np.ones(2), 1e-3), batch.outputs, muscle.outputs_of):
            with pytest.raises(UserError, match=r"states of 2 fibres have shape \(2, \d+\) of (float|int)"):
                call(wrong)
    with pytest.raises(UserError, match="states of 2 fibres"):
        batch.outputs(states[:1])
