"""Fibres and what is compiled of them go into pickles and copies, and step on with the same bits."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import xb_muscle_ros as xb

WAYS: dict[str, Callable[[Any], Any]] = {
    "pickle": lambda whole: pickle.loads(pickle.dumps(whole)),
    "deepcopy": copy.deepcopy,
}


@pytest.mark.parametrize("way", WAYS.values(), ids=WAYS)
def test_a_fibre_is_the_same_and_stays_read_only(way: Callable[[Any], Any]) -> None:
    fibre = xb.changed(xb.load_fibre("18Dec2017a"), {"f": 95.0})
    made = way(fibre)
    assert made == fibre
    assert made.values["f"] == 95.0
    with pytest.raises(TypeError):
        made.values["f"] = 1.0


@pytest.mark.parametrize("way", WAYS.values(), ids=WAYS)
def test_muscles_and_batches_step_on_with_the_same_bits(way: Callable[[Any], Any]) -> None:
    fibres = [xb.load_fibre("18Dec2017a"), xb.changed(xb.load_fibre("13Dec2017a"), {"f": 95.0})]
    muscle, batch = xb.Muscle(fibres[1]), xb.MuscleBatch(fibres)
    state, states = muscle.settle(0.0, 0.8), batch.settle(np.zeros(2), np.full(2, 0.8))
    assert way(muscle).step(state, 0.01, 0.8, 1e-3).tobytes() == muscle.step(state, 0.01, 0.8, 1e-3).tobytes()
    made, length = way(batch), np.array([0.01, -0.01])
    assert (
        made.step(states, length, np.ones(2), 1e-3).tobytes() == batch.step(states, length, np.ones(2), 1e-3).tobytes()
    )
    # Scratch of its own: both may step at the same time.
    assert not np.shares_memory(made._work, batch._work)
