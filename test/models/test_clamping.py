"""A fibre under a load: the load is held, by the same step as ever, or it is said why not."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_contract import CASES, fibre_for

from xb_muscle_ros.errors import StateViolation, UserError
from xb_muscle_ros.models.clamping import clamp, clamp_run
from xb_muscle_ros.models.fibre_file import load_fibre
from xb_muscle_ros.models.muscle import Muscle

FIBRE = "18Dec2017a"
# Both sides of isometric, the jump of the load included.
SHARES = (0.1, 0.5, 0.9, 1.0, 1.2)


def force_of(muscle: Muscle, states: np.ndarray) -> np.ndarray:
    return muscle.outputs_of(states)["force_f0"]


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES, ids=str)
def test_load_is_held_and_replaying_the_length_gives_the_same_states(case: tuple[str, str, float]) -> None:
    """Every model with every method, at 1 ms, at full and half activation."""
    muscle, n = Muscle(fibre_for(*case)), 31
    dt = np.full(n - 1, 1e-3)
    for calcium in (30.0, 1.0):
        start = muscle.settle(0.0, calcium)
        isometric = muscle.outputs(start).force_f0
        for share in SHARES:
            load, held, counts = np.full(n, share * isometric), np.full(n, calcium), list[int]()
            states = clamp_run(muscle, start, dt, load, held, counts=counts)
            assert np.abs(force_of(muscle, states[1:]) - load[1:]).max() < 1e-8
            steps, halvings = counts
            assert steps >= n - 1
            again = muscle.run(start, dt, states[:, -3].copy(), held)
            # With smaller steps within, in one of thousands, the two differ by the error of the larger from there on:
            # the guard lets no step err by more.
            assert halvings <= 1
            np.testing.assert_allclose(force_of(muscle, again), force_of(muscle, states), atol=1e-4 * halvings, rtol=0)
            if not halvings:
                np.testing.assert_array_equal(again, states)
            assert np.sign(round(states[-1, -3], 7)) == np.sign(share - 1.0)


def muscle_of(model: str = "3state_coop", method: str = "gaussian", **values: float) -> Muscle:
    fibre = load_fibre(FIBRE, model, method)
    return Muscle(replace(fibre, values={**fibre.values, "smoothing": 0.0, **values}))


@pytest.mark.parametrize("method", ["gaussian", "characteristics"])
def test_a_run_is_clamp_by_clamp_bit_for_bit_and_pure(method: str) -> None:
    muscle, rng = muscle_of(method=method), np.random.default_rng(2)
    dt, load, calcium = rng.uniform(2e-4, 2e-3, 60), rng.uniform(0.2, 0.9, 61), rng.uniform(0.8, 3.0, 61)
    start = muscle.settle(0.01, float(calcium[0]))
    before = start.copy()
    states = clamp_run(muscle, start, dt, load, calcium)
    np.testing.assert_array_equal(start, before)
    state = start
    for k in range(1, 61):
        state = clamp(muscle, state, float(load[k]), float(calcium[k]), float(dt[k - 1]))
        np.testing.assert_array_equal(state, states[k])
    np.testing.assert_array_equal(clamp_run(muscle, start, dt, load, calcium, every=7), states[::7])


def hill_velocity(muscle: Muscle, force_f0: float, activation: float) -> float:
    """Of Hill's contractile element under a force, L0/s: the closed form of De Groote et al. 2016."""
    v = muscle.fibre.values
    sinh = math.sinh((force_f0 / (v["Fscale"] * activation) - v["e4"]) / v["e1"])
    return v["vmax"] * (sinh - v["e3"]) / v["e2"] / v["gamma"]


@pytest.mark.parametrize("dt", [1e-3, 1e-5, 1e-7])
@pytest.mark.parametrize("share", [0.0, 0.02, 0.3, 0.7, 0.97, 1.1, 1.5])
def test_hill_moves_as_its_closed_form_says(share: float, dt: float) -> None:
    """Velocity to the share of the held force; without states the same in every step."""
    muscle = muscle_of("hill")
    start = muscle.settle(-0.1, 1.5)
    out = muscle.outputs(start)
    load = out.force_pe_f0 + share * out.force_ce_f0
    states = clamp_run(muscle, start, np.full(5, dt), np.full(6, load), np.full(6, 1.5))
    exact = hill_velocity(muscle, share * out.force_ce_f0, out.n_on)
    # Within 1e-9 F0, and where a last digit of the length is more: that digit.
    tolerance = 1e-8 * max(1.0, abs(exact)) + 4.0 * np.spacing(0.1) / dt
    np.testing.assert_allclose(states[1:, -2], exact, rtol=0.0, atol=tolerance)


def test_hill_with_a_spring_comes_to_the_same_velocity() -> None:
    """Once the spring has its new length, the fibre moves as its contractile element does."""
    muscle = muscle_of("hill_se")
    start = muscle.settle(-0.05, 3.0)
    out = muscle.outputs(start)
    load = out.force_pe_f0 + 0.4 * out.force_ce_f0
    states = clamp_run(muscle, start, np.full(50, 1e-3), np.full(51, load), np.full(51, 3.0))
    exact = hill_velocity(muscle, 0.4 * out.force_ce_f0, out.n_on)
    np.testing.assert_allclose(states[5:, -2], exact, atol=1e-6)
    # The jump is the spring's: what the two forces ask of it, and what the element moves meanwhile.
    v = muscle.fibre.values
    forces = out.force_ce_f0 / v["Fscale"] * np.array([1.0, 0.4])
    recoil = np.diff(np.log1p(forces / v["kse0"]) / v["kse"])[0] / v["gamma"]
    fine = clamp_run(muscle, start, np.full(1, 1e-7), np.full(2, load), np.full(2, 3.0))
    assert fine[1, -3] - start[-3] == pytest.approx(recoil, rel=1e-4)


def test_a_slack_spring_under_no_load_is_just_not_slack() -> None:
    """Any shorter length gives the same force, of nothing but the parallel element; the fibre shortens unloaded."""
    muscle = muscle_of("3state_coop_slack", **{"Fpe0": 0.0})
    start = muscle.settle(0.0, 30.0)
    states = clamp_run(muscle, start, np.full(40, 1e-3), np.zeros(41), np.full(41, 30.0))
    spring = states[1:, muscle.state_names.index("l_se")]
    assert np.all((spring > 0.0) & (spring < 1e-7))
    assert np.abs(force_of(muscle, states[1:])).max() < 1e-8
    # Faster than under 2 % of the isometric force, by little.
    loaded = clamp_run(muscle, start, np.full(40, 1e-3), np.full(41, 0.02), np.full(41, 30.0))
    assert states[-1, -2] < loaded[-1, -2] < 0.5 * states[-1, -2] < 0.0
    with pytest.raises(
        UserError, match=r"load of -0.01 F0 is less than the fibre bears at any length change from its own down to"
    ):
        clamp(muscle, start, -0.01, 30.0, 1e-3)


def jump_of_force(muscle: Muscle, start: np.ndarray, calcium: float) -> tuple[float, float, float]:
    """A length at which one step becomes two, as the error passes its guard, and the forces on both sides."""

    def steps(length: float) -> int:
        counts = list[int]()
        muscle.run(start, np.array([1e-3]), np.array([start[-3], length]), np.full(2, calcium), counts=counts)
        return counts[0]

    one, more = float(start[-3]), float(start[-3]) - 0.03
    assert steps(one) == 1 < steps(more)
    while abs(one - more) > 1e-16 and 0.5 * (one + more) not in (one, more):
        middle = 0.5 * (one + more)
        one, more = (middle, more) if steps(middle) == 1 else (one, middle)
    forces = [muscle.outputs(muscle.step(start, x, calcium, 1e-3)).force_f0 for x in (one, more)]
    return one, *forces


@pytest.mark.parametrize(("method", "calcium"), [("characteristics", 3.0), ("fixed_grid", 30.0)])
def test_a_load_that_step_size_control_jumps_over_is_held(method: str, calcium: float) -> None:
    """Regression: between one step's force and two steps' lies their error, and no length gives what is between."""
    muscle = muscle_of(method=method)
    start = muscle.settle(0.0, calcium)
    length, longer, shorter = jump_of_force(muscle, start, calcium)
    assert 1e-6 < longer - shorter < 1e-5
    load, counts = 0.5 * (longer + shorter), list[int]()
    ends = np.array([1e-3]), np.full(2, load), np.full(2, calcium)
    state = clamp_run(muscle, start, *ends, counts=counts)[-1]
    assert state[-3] == pytest.approx(length, abs=1e-6)
    if longer - shorter < 2e-6:
        # Either side holds it within 1e-6 F0, by the one step.
        assert counts[1] == 0
        assert muscle.outputs(state).force_f0 == pytest.approx(load, abs=1e-6)
        np.testing.assert_array_equal(muscle.step(start, float(state[-3]), calcium, 1e-3), state)
    else:
        assert counts[1] == 1
        assert muscle.outputs(state).force_f0 == pytest.approx(load, abs=1e-8)
        again = muscle.step(start, float(state[-3]), calcium, 1e-3)
        assert muscle.outputs(again).force_f0 == pytest.approx(load, abs=1e-5)


def test_a_load_beyond_what_a_fibre_bears_says_so_with_its_time() -> None:
    """Heads detach the faster the further they are strained: the fibre lengthens ever faster and gives way."""
    muscle = Muscle(fibre_for("2state_coop", "gaussian", 0.0))
    start = muscle.settle(0.0, 1.0)
    load = np.full(201, 1.6 * muscle.outputs(start).force_f0)
    with pytest.raises(UserError) as error:
        clamp_run(muscle, start, np.full(200, 1e-3), load, np.full(201, 1.0))
    assert "fibre 18Dec2017a: load of 1.31047 F0 at t = 0.0" in str(error.value)
    assert "is more than the fibre bears at any length change from its own up to 0.5 L0: the most is " in str(
        error.value
    )
    # As far as it is borne, it is held.
    time = float(str(error.value).split("t = ")[1].split(" s")[0])
    count = round(time / 1e-3)
    states = clamp_run(muscle, start, np.full(count - 1, 1e-3), load[:count], np.full(count, 1.0))
    assert np.abs(force_of(muscle, states[1:]) - load[0]).max() < 1e-8
    with pytest.raises(UserError, match=r"load of 1\.31047 F0 at t = 0\.0"):
        clamp_run(muscle, start, np.full(200, 1e-3), load, np.full(201, 1.0), limits_l0=(-0.5, 0.05))
    with pytest.raises(UserError, match=r"load of 50 F0 is more than the fibre bears .* give a smaller load"):
        clamp(muscle_of("hill"), muscle_of("hill").settle(0.0, 1.0), 50.0, 1.0, 1e-3)


def test_a_state_at_fault_is_named_as_by_a_step() -> None:
    muscle = muscle_of()
    start = muscle.settle(0.0, 1.0)
    start[muscle.state_names.index("drx")] = 3.0
    with pytest.raises(StateViolation, match="state drx became 3 at t = 0 s"):
        clamp(muscle, start, 0.3, 1.0, 1e-3)
    with pytest.raises(StateViolation, match="state drx"):
        clamp_run(muscle, start, np.full(3, 1e-3), np.full(4, 0.3), np.full(4, 1.0))


def test_values_that_no_clamp_takes_are_refused() -> None:
    muscle = muscle_of()
    start = muscle.settle(0.0, 1.0)
    good: dict[str, Any] = {"load_f0": 0.3, "calcium_um": 1.0, "dt_s": 1e-3}
    for wrong, message in (
        ({"load_f0": math.nan}, "fibre 18Dec2017a: load is nan F0"),
        ({"load_f0": math.inf}, "fibre 18Dec2017a: load is inf F0"),
        ({"calcium_um": -1.0}, "calcium is -1 µM"),
        ({"dt_s": 0.0}, "step is 0 s"),
        ({"limits_l0": (0.1, -0.1)}, "limits of the length change are 0.1 and -0.1 L0"),
        ({"limits_l0": (-2.0, 0.1)}, "limits of the length change are -2 and 0.1 L0"),
    ):
        with pytest.raises(UserError, match=message):
            clamp(muscle, start, **{**good, **wrong})
    many = np.full(3, 1e-3), np.full(4, 0.3), np.full(4, 1.0)
    with pytest.raises(UserError, match="every is 0; allowed is 1 and above"):
        clamp_run(muscle, start, *many, every=0)
    for k, values, message in (
        (1, np.array([0.3, 0.3, math.nan, 0.3]), "fibre 18Dec2017a, sample 2: load is nan F0"),
        (1, np.full(3, 0.3), "3 loads and 4 values of calcium"),
        (2, np.array([1.0, 1.0, 1.0, -1.0]), "sample 3: calcium is -1 µM"),
        (0, np.array([1e-3, 0.0, 1e-3]), "sample 2: step is 0 s"),
    ):
        arguments = list(many)
        arguments[k] = values
        with pytest.raises(UserError, match=message):
            clamp_run(muscle, start, *arguments)


@settings(max_examples=200)
@given(
    st.lists(st.tuples(st.floats(-0.2, 3.0), st.floats(0.0, 100.0), st.floats(1e-5, 5e-3)), min_size=1, max_size=6),
    st.sampled_from(["3state_coop", "4state_coop", "hill_se", "3state_coop_slack", "2state_rigid"]),
)
def test_whatever_is_asked_for_is_held_or_refused(asked: list[tuple[float, float, float]], model: str) -> None:
    """Loads, calcium and steps that jump about: never a state whose force is another."""
    muscle = muscle_of(model)
    state = muscle.settle(0.0, 0.5)
    for load, calcium, dt in asked:
        try:
            state = clamp(muscle, state, load, calcium, dt)
        except UserError:
            # Held before, and no more.
            return
        assert abs(muscle.outputs(state).force_f0 - load) < 1.1e-6
        assert -0.5 <= state[-3] <= 0.5
        assert state[-1] == calcium
