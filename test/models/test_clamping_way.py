"""Of several lengths that bear a load the clamp takes the first on the fibre's way, and says where there is none."""

from __future__ import annotations

import math

import numpy as np
import pytest
from test_clamping import FIBRE, force_of, muscle_of
from test_contract import fibre_for

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.clamping import clamp, clamp_run, is_load_refused
from xb_muscle_ros.models.fibre_file import load_fibre
from xb_muscle_ros.models.muscle import Muscle


def first_crossing(muscle: Muscle, state: np.ndarray, load: float, calcium: float, dt: float) -> tuple[float, float]:
    """Between which lengths, 2e-4 L0 apart, force first comes to a load on the way from the length that the fibre has.

    Scanned from there, longer where it bears too little and shorter where it bears too much; NaN where it never does.
    """

    def excess(length: float) -> float:
        try:
            return muscle.outputs(muscle.step(state, length, calcium, dt)).force_f0 - load
        except UserError:
            return math.nan

    at = float(state[-3])
    first = excess(at)
    stride = math.copysign(2e-4, -first)
    while abs(at + stride) <= 0.5:
        there = excess(at + stride)
        if math.isnan(there):
            break
        if (there < 0.0) != (first < 0.0):
            return min(at, at + stride), max(at, at + stride)
        at += stride
    return math.nan, math.nan


@pytest.mark.slow
@pytest.mark.parametrize(
    ("model", "method"),
    [
        ("3state_coop", "gaussian"),
        ("2state_coop", "gaussian"),
        ("4state_coop", "gaussian"),
        ("hill_se", "gaussian"),
        ("3state_coop_slack", "gaussian"),
        ("3state_coop_slack+passive_force_length", "gaussian"),
        ("3state_coop_rigid+passive_force_length", "gaussian"),
        ("3state_coop", "characteristics"),
        ("3state_coop", "fixed_grid"),
    ],
)
def test_the_length_is_the_first_on_the_way_and_what_is_refused_has_none(model: str, method: str) -> None:
    """Loads that come and go, by what every length on the way gives."""
    muscle, rng = Muscle(fibre_for(model, method, 0.0)), np.random.default_rng(7)
    held = 0
    for _ in range(12):
        calcium = float(rng.choice([30.0, 1.0, 0.8]))
        state = muscle.settle(0.0, calcium)
        isometric = muscle.outputs(state).force_f0
        for _ in range(10):
            share = rng.choice([rng.uniform(0.0, 0.1), rng.uniform(0.02, 1.3), 1.0, 0.8])
            load, dt = float(share * isometric), float(rng.choice([2e-4, 1e-3, 5e-3]))
            shorter, longer = first_crossing(muscle, state, load, calcium, dt)
            if math.isnan(shorter):
                with pytest.raises(UserError, match="than the fibre bears"):
                    clamp(muscle, state, load, calcium, dt)
                break
            state = clamp(muscle, state, load, calcium, dt)
            held += 1
            assert shorter - 1e-9 <= state[-3] <= longer + 1e-9
    assert held > 40


def test_a_load_that_comes_back_after_a_release_is_borne() -> None:
    """Regression: after fast lengthening the search began beyond force's peak, and went on from there."""
    muscle = Muscle(load_fibre(FIBRE))
    start = muscle.settle(0.0, 1.0)
    isometric = muscle.outputs(start).force_f0
    load = np.concatenate([np.zeros(21), np.full(2, isometric)])
    states = clamp_run(muscle, start, np.full(22, 1e-3), load, np.full(23, 1.0))
    np.testing.assert_allclose(force_of(muscle, states[1:]), load[1:], atol=1e-6)
    assert states[-1, -3] == pytest.approx(0.0178, abs=1e-3)
    muscle = muscle_of("2state_coop")
    start = muscle.settle(0.0, 1.0)
    isometric = muscle.outputs(start).force_f0
    released = clamp(muscle, start, 0.0, 1.0, 1e-3)
    assert clamp(muscle, released, 0.8 * isometric, 1.0, 1e-3)[-3] == pytest.approx(-0.0045, abs=1e-3)


def test_a_fibre_does_not_jump_to_where_its_passive_element_bears_the_load() -> None:
    """Regression: secants grew along the slack part and went over force's peak, by 0.3 L0 within 1 ms."""
    muscle = Muscle(fibre_for("3state_coop_slack+passive_force_length", "gaussian", 0.0))
    start = muscle.settle(0.0, 30.0)
    isometric = muscle.outputs(start).force_f0
    released = clamp(muscle, start, 0.02 * isometric, 30.0, 1e-3)
    assert clamp(muscle, released, 0.8 * isometric, 30.0, 1e-3)[-3] == pytest.approx(-0.0067, abs=1e-3)


@pytest.mark.parametrize("model", ["3state_coop", "3state_coop_slack+passive_force_length", "2state_coop"])
def test_past_the_peak_the_way_is_that_of_the_force_at_the_own_length(model: str) -> None:
    """Regression: where force falls with length the first trial, a stride on, sent the search to the passive branch."""
    muscle = Muscle(fibre_for(model, "gaussian", 0.0))
    start = muscle.settle(0.0, 30.0)
    forces = [muscle.outputs(muscle.step(start, x, 30.0, 1e-3)).force_f0 for x in np.arange(0.0, 0.3, 1e-3)]
    state = clamp(muscle, start, 0.999 * max(forces), 30.0, 1e-3)
    own, on = (muscle.outputs(muscle.step(state, state[-3] + by, 30.0, 1e-3)).force_f0 for by in (0.0, 2e-3))
    assert on < own
    assert state[-2] > 2.0
    for share in (0.1, 0.5, 0.9):
        load = own + share * (on - own)
        shorter, longer = first_crossing(muscle, state, load, 30.0, 1e-3)
        assert longer < state[-3]
        assert shorter - 1e-9 <= clamp(muscle, state, load, 30.0, 1e-3)[-3] <= longer + 1e-9


def test_a_length_beyond_the_limits_is_no_begin() -> None:
    muscle = muscle_of()
    state = muscle.step(muscle.settle(0.0, 1.0), 0.6, 1.0, 1.0)
    with pytest.raises(UserError, match=r"its length change is 0.6 L0, beyond the limits -0.5 to 0.5"):
        clamp(muscle, state, 0.55, 1.0, 1e-3)
    with pytest.raises(UserError, match="beyond the limits"):
        clamp_run(muscle, state, np.full(1, 1e-3), np.full(2, 0.5), np.ones(2))
    assert clamp(muscle, state, 0.55, 1.0, 1e-3, limits_l0=(-0.5, 1.0))[-3] < 1.0


def test_the_most_that_is_borne_is_told() -> None:
    """A load just below force's peak within a step is held, and one above it is refused with the peak."""
    muscle = muscle_of()
    start = muscle.settle(0.0, 30.0)
    forces = [muscle.outputs(muscle.step(start, x, 30.0, 1e-3)).force_f0 for x in np.arange(0.0, 0.3, 1e-3)]
    below, peak = max(forces) - 0.05, max(forces)
    assert muscle.outputs(clamp(muscle, start, below, 30.0, 1e-3)).force_f0 == pytest.approx(below, abs=1e-8)
    with pytest.raises(UserError, match="the most is ") as error:
        clamp(muscle, start, 10.0, 30.0, 1e-3)
    assert float(str(error.value).split("the most is ")[1].split(" F0")[0]) == pytest.approx(peak, rel=2e-3)
    with pytest.raises(UserError, match=r"load of 1e\+300 F0 is more .*: the most is [1-9]"):
        clamp(muscle, start, 1e300, 30.0, 1e-3)
    assert is_load_refused(str(error.value))
    assert not is_load_refused("fibre f: state drx became 3 at t = 0 s")
