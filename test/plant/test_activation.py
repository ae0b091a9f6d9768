"""The activation stage and the calcium that sustains an activation."""

from __future__ import annotations

import numpy as np
import pytest

from xb_muscle_ros.models.fibre_file import load_fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.plant.activation import FALL_S, RISE_S, CalciumTable, ReflexActivation, reflex_calcium


def test_the_stage_is_mujocos() -> None:
    """Rising from the start, with excitation that comes and goes."""
    mujoco = pytest.importorskip("mujoco", reason="needs the extra mujoco")
    rng = np.random.default_rng(1)
    start = rng.random(50)
    stage, parameters, expected = ReflexActivation(start, 1e-3), np.array([RISE_S, FALL_S, 0.0]), start
    for _ in range(100):
        added = 0.5 * np.maximum(rng.random(50) - 0.5, 0.0)
        wanted = np.minimum(start + added, 1.0)
        rate = [mujoco.mju_muscleDynamics(u, a, parameters) for u, a in zip(wanted, expected, strict=True)]
        expected = expected + 1e-3 * np.array(rate)
        assert stage(added) == pytest.approx(expected, rel=1e-12)


def test_the_stage_rests_where_nothing_is_added() -> None:
    activation = np.random.default_rng(2).random(80)
    stage = ReflexActivation(activation, 1e-3)
    for _ in range(10):
        assert stage(np.zeros(80)).tobytes() == activation.tobytes()


@pytest.mark.parametrize("model", ["3state_coop", "hill"])
@pytest.mark.parametrize("length", [0.0, 0.05])
def test_calcium_sustains_the_activation_that_it_is_read_for(model: str, length: float) -> None:
    """At the length of the table; between its points to 0.1 % of F0."""
    muscle = Muscle(load_fibre("18Dec2017a", model))
    table = CalciumTable(muscle, length)
    passive = muscle.outputs(muscle.settle(length, 1e-3)).force_f0
    for activation in (0.05, 0.2, 0.5, 0.8):
        calcium = table.calcium_um(activation)
        settled = muscle.outputs(muscle.settle(length, calcium)).force_f0
        assert settled - passive == pytest.approx(activation, abs=1e-3)
        assert table.activation(calcium) == pytest.approx(activation, rel=1e-9)


def test_calcium_is_that_of_the_start_to_the_bit_until_something_is_added() -> None:
    muscle = Muscle(load_fibre("18Dec2017a"))
    table, start = CalciumTable(muscle, 0.0), np.array([1.2345, 1e-3])
    activation = np.array([table.activation(c) for c in start])
    level = reflex_calcium(activation, start, lambda a: np.array([table.calcium_um(x) for x in a]), 1e-3)
    for _ in range(100):
        assert level(np.zeros(2)).tobytes() == start.tobytes()
    excited = level(np.array([0.1, 0.0]))
    assert excited[0] > start[0]
    assert excited[1] == start[1]
