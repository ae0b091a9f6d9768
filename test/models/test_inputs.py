"""What no muscle can be given is refused by name, value and range, before anything is computed."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.batch import MuscleBatch
from xb_muscle_ros.models.fibre_file import load_fibre
from xb_muscle_ros.models.muscle import Muscle

FIBRES = ("13Dec2017a", "18Dec2017a")
NAN = float("nan")
# Length change (L0), calcium (µM), step (s), and what the message must say of it.
ABSURD = [
    (-1.2, 1.0, 1e-3, r"length change is -1\.2 L0; allowed is -1 to 10"),
    (11.0, 1.0, 1e-3, r"length change is 11 L0; allowed is -1 to 10"),
    (NAN, 1.0, 1e-3, r"length change is nan L0; allowed is -1 to 10.*missing"),
    (0.0, -0.5, 1e-3, r"calcium is -0\.5 µM; allowed is 0 to 1e\+06"),
    (0.0, NAN, 1e-3, r"calcium is nan µM"),
    (0.0, float("inf"), 1e-3, r"calcium is inf µM"),
    (0.0, 1.0, -1e-3, r"step is -0\.001 s; allowed is above 0"),
    (0.0, 1.0, 0.0, r"step is 0 s; allowed is above 0"),
    (0.0, 1.0, NAN, r"step is nan s"),
]


@pytest.fixture(scope="module")
def batch() -> MuscleBatch:
    return MuscleBatch([load_fibre(name) for name in FIBRES])


@pytest.fixture(scope="module")
def muscle(batch: MuscleBatch) -> Muscle:
    return batch.muscles[1]


@pytest.mark.parametrize(("length", "calcium", "dt_s", "told"), ABSURD)
def test_a_batch_names_the_fibre(batch: MuscleBatch, length: float, calcium: float, dt_s: float, told: str) -> None:
    states = batch.settle(np.zeros(2), np.ones(2))
    before = states.copy()
    # A duration is that of all fibres: the first stands for them.
    name = FIBRES[1] if dt_s > 0.0 else FIBRES[0]
    with pytest.raises(UserError, match=f"^fibre {name}: {told}"):
        batch.step(states, np.array([0.0, length]), np.array([1.0, calcium]), dt_s)
    np.testing.assert_array_equal(states, before)


@pytest.mark.parametrize(("length", "calcium", "dt_s", "told"), ABSURD)
def test_one_muscle_does_too(muscle: Muscle, length: float, calcium: float, dt_s: float, told: str) -> None:
    with pytest.raises(UserError, match=f"^fibre {FIBRES[1]}: {told}"):
        muscle.step(muscle.rest(), length, calcium, dt_s)
    with pytest.raises(UserError, match=f"^fibre {FIBRES[1]}: {told}"):
        muscle.settle(length, calcium, dt_s)


@pytest.mark.parametrize(("length", "calcium", "dt_s", "told"), ABSURD)
def test_a_run_names_the_sample(muscle: Muscle, length: float, calcium: float, dt_s: float, told: str) -> None:
    lengths, held, steps = np.zeros(5), np.ones(5), np.full(4, 1e-3)
    lengths[3], held[3], steps[2] = length, calcium, dt_s
    with pytest.raises(UserError, match=f"^fibre {FIBRES[1]}, sample 3: {told}"):
        muscle.run(muscle.rest(), steps, lengths, held)
    if dt_s > 0.0:
        with pytest.raises(UserError, match=f"^fibre {FIBRES[1]}, sample 3: {told}"):
            muscle.follow(muscle.rest(), np.arange(5) * 1e-3, lengths, held, np.arange(5) * 1e-3)


def test_times_that_go_back_are_refused(muscle: Muscle) -> None:
    with pytest.raises(UserError, match=r"sample 2: step is -0\.01 s"):
        muscle.follow(muscle.rest(), np.array([0.0, 0.02, 0.01]), np.zeros(3), np.ones(3), np.zeros(1))


@pytest.mark.parametrize(
    "call",
    [
        lambda b: b.step(b.settle(np.zeros(2), np.ones(2)), np.zeros(3), np.ones(2), 1e-3),
        lambda b: b.step(b.settle(np.zeros(2), np.ones(2)), np.zeros(2), np.ones(1), 1e-3),
        lambda b: b.step(b.settle(np.zeros(2), np.ones(2))[:1], np.zeros(2), np.ones(2), 1e-3),
        lambda b: b.muscles[0].run(b.muscles[0].rest(), np.full(4, 1e-3), np.zeros(5), np.ones(4)),
        lambda b: b.muscles[0].run(b.muscles[0].rest(), np.full(5, 1e-3), np.zeros(5), np.ones(5)),
    ],
)
def test_arrays_that_do_not_fit_are_refused(batch: MuscleBatch, call: Callable[[MuscleBatch], object]) -> None:
    """Compiled loops do not look where an array ends."""
    with pytest.raises(UserError, match="needed"):
        call(batch)


def test_the_edges_of_the_ranges_are_taken(muscle: Muscle) -> None:
    for length, calcium in ((-0.999, 0.0), (0.5, 1e4)):
        assert np.isfinite(muscle.step(muscle.rest(), length, calcium, 1.0)).all()
