"""Many fibres at once are many fibres one by one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from xb_muscle_ros.errors import StateViolation, UserError
from xb_muscle_ros.models.batch import MuscleBatch
from xb_muscle_ros.models.fibre_file import load_fibre
from xb_muscle_ros.models.muscle import Outputs

FIBRES = ("13Dec2017a", "13Dec2017b", "14Dec2017b", "18Dec2017a", "18Dec2017b", "19Dec2017a", "7Aug2018a")


@pytest.mark.slow
@pytest.mark.parametrize("method", ["gaussian", "characteristics"])
def test_batch_equals_single_steps_to_the_bit(method: str) -> None:
    batch = MuscleBatch([load_fibre(name, method=method) for name in FIBRES])
    rng = np.random.default_rng(3)
    states = batch.settle(np.zeros(7), np.full(7, 0.8))
    single = [state.copy() for state in states]
    for _ in range(50):
        length, calcium = rng.uniform(-0.01, 0.03, 7), rng.uniform(0.1, 30.0, 7)
        states = batch.step(states, length, calcium, 1e-3)
        for k, muscle in enumerate(batch.muscles):
            single[k] = muscle.step(single[k], float(length[k]), float(calcium[k]), 1e-3)
    np.testing.assert_array_equal(states, np.stack(single))
    out = batch.outputs(states)
    assert [muscle.outputs(s).force_f0 for muscle, s in zip(batch.muscles, single, strict=True)] == out[
        "force_f0"
    ].tolist()


def test_a_violation_names_its_fibre_and_leaves_the_states_alone() -> None:
    batch = MuscleBatch([load_fibre(name) for name in FIBRES[:3]])
    states = batch.settle(np.zeros(3), np.ones(3))
    states[1, batch.state_names.index("drx")] = 3.0
    before = states.copy()
    with pytest.raises(StateViolation, match="fibre 13Dec2017b: state drx"):
        batch.step(states, np.zeros(3), np.ones(3), 1e-3)
    np.testing.assert_array_equal(states, before)


def test_mixed_batches_are_refused() -> None:
    one = load_fibre("18Dec2017a")
    exact = replace(one, values={**one.values, "smoothing": 0.0})
    with pytest.raises(UserError, match="differ in model, method, smoothing or grid"):
        MuscleBatch([one, exact])
    with pytest.raises(UserError, match="at least one fibre"):
        MuscleBatch([])


def test_one_step_for_all_fibres() -> None:
    batch = MuscleBatch([load_fibre(name) for name in FIBRES[:2]])
    states = batch.settle(np.zeros(2), np.ones(2))
    with pytest.raises(UserError, match="step of 2 fibres is an array; needed is one number of seconds"):
        batch.step(states, np.zeros(2), np.ones(2), np.full(2, 1e-3))


def test_step_and_outputs_in_one_pass_are_those_of_two() -> None:
    batch = MuscleBatch([load_fibre("18Dec2017a"), load_fibre("13Dec2017a")])
    calcium = np.array([0.8, 1.5])
    states = batch.settle(np.zeros(2), calcium)
    length = np.array([0.001, -0.002])
    after = batch.step(states, length, calcium, 1e-3)
    out, table = np.empty_like(states), np.empty((2, len(Outputs._fields)))
    batch.step_into(states, length, calcium, 1e-3, out, table)
    assert out.tobytes() == after.tobytes()
    assert table.tobytes() == batch.output_table(after).tobytes()
    with pytest.raises(UserError, match="fibre 13Dec2017a: length change is -2 L0"):
        batch.step_into(states, np.array([0.0, -2.0]), calcium, 1e-3, out, table)


def test_after_warming_nothing_is_left_to_compile() -> None:
    batch = MuscleBatch([load_fibre(name) for name in FIBRES[:2]])
    batch.warm()
    compiled = {f: len(f.signatures) for f in (batch._code.advance_many, batch._code.outputs_many)}
    assert all(compiled.values())
    states = batch.step(batch.settle(np.zeros(2), np.ones(2)), np.zeros(2), np.ones(2), 1e-3)
    batch.outputs(states)
    assert compiled == {f: len(f.signatures) for f in compiled}
