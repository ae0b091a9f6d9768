"""What every model with every method must do, whatever its blocks."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad

from xb_muscle_ros.errors import StateViolation
from xb_muscle_ros.mechanisms import Quantities
from xb_muscle_ros.mechanisms.extras.active_force_length import ActiveForceLength
from xb_muscle_ros.mechanisms.extras.passive_force_length import PassiveForceLength
from xb_muscle_ros.models.composition import Composition
from xb_muscle_ros.models.fibre_file import Fibre, load_fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.models.registry import BASE_OF, METHODS, MODELS, base_of, compose, model_of_set

# What its tests share takes long to make.
pytestmark = pytest.mark.slow

FIBRE = "18Dec2017a"
RELEASED = ("2state", "3state_coop", "4state_coop", "hill_se")
PCAS = (4.5, 6.1, 6.6, 9.0)


def fibre_for(model: str, method: str, smoothing: float) -> Fibre:
    """A fibre with a set for the model; sets that nobody released borrow the values of the full model."""
    from types import MappingProxyType

    full = load_fibre(FIBRE, "3state_coop", method)
    # Sets that were fitted here may change with every fit; the contract is to hold for the same fibre each time.
    if base_of(model) in RELEASED:
        fibre = load_fibre(FIBRE, model, method)
        values = dict(fibre.values)
    else:
        from xb_muscle_ros.models.parameters import complete

        names = {row.name for row in compose(model, method).parameters}
        values = complete({k: v for k, v in full.values.items() if k in names}, model, "test", method)
    values["smoothing"] = smoothing
    if "steepness" in values:
        # The moments take a sharp step; with the steepest one the distribution does nearly the same.
        values["steepness"] = 20.0
    return Fibre(**{**full.__dict__, "model": model, "method": method, "values": MappingProxyType(values)})


CROSS_BRIDGES = [m for m in MODELS if BASE_OF[m] == m and isinstance(compose(m), Composition)]
CASES = [(m, k, 0.0) for m in CROSS_BRIDGES for k in METHODS]
# The smooth functions of the released sets, with the method they were released for.
CASES += [(m, "gaussian", 100.0) for m in ("2state", "3state_coop", "4state_coop")]
# Bins with smoothing, and a spring that goes slack; every mechanism with both: see `test_every_mechanism`.
CASES += [("3state_coop", "characteristics", 100.0), ("3state_coop_slack", "gaussian", 0.0)]
# Nothing to smooth and no distribution in Hill-type models. Of the elastic variants a few stand for all: see the last
# test here.
CASES += [(m, "gaussian", 0.0) for m in ("hill_se", "hill", "hill_softplus", "3state_coop_rigid")]
CASES += [("4state_coop_rigid_softplus", "gaussian", 0.0)]
# Without a series element heads take the fibre's whole velocity: the hardest case for strain bins.
CASES += [(m, "characteristics", 0.0) for m in ("2state_rigid", "3state_coop_rigid")]
# Joints that move: active and passive force depend on the half-sarcomeres' length.
LENGTHS = "+active_force_length+passive_force_length"
CASES += [(f"{m}{LENGTHS}", "gaussian", 0.0) for m in ("3state_coop_slack", "4state_coop_rigid", "hill_se")]
CASES += [(f"3state_coop_slack{LENGTHS}", "characteristics", 0.0)]
# These carry heads along exactly; the others smear them a little with every step, so that smaller steps are no remedy.
EXACT_MOVEMENT = ("gaussian", "characteristics")


@pytest.fixture(scope="module", params=CASES, ids=str)
def muscle(request: pytest.FixtureRequest) -> Muscle:
    return Muscle(fibre_for(*request.param))


def some(wanted: Callable[[str], bool]) -> Any:
    """A fixture of the cases whose method is wanted."""

    @pytest.fixture(scope="module", params=[c for c in CASES if wanted(c[1])], ids=str)
    def chosen(request: pytest.FixtureRequest) -> Muscle:
        return Muscle(fibre_for(*request.param))

    return chosen


mover = some(lambda method: method in EXACT_MOVEMENT)
gridded = some(lambda method: method != "gaussian")
moving_grid = some(lambda method: method == "characteristics")


def calcium(pca: float) -> float:
    return float(10.0 ** (6.0 - pca))


def test_names_of_states_and_parameters_agree_with_the_registry(muscle: Muscle) -> None:
    composition = compose(model_of_set(muscle.fibre.model), muscle.fibre.method)
    states = composition.state_rows(muscle.fibre.values)
    assert muscle.state_names == (*(s.name for s in states), "length_change", "velocity", "calcium")
    rows = composition.parameters
    assert [muscle.fibre.values[p.name] for p in rows] == muscle.parameters[: len(rows)].tolist()


@pytest.mark.parametrize("pca", PCAS)
def test_settles_where_nothing_changes_any_more(muscle: Muscle, pca: float) -> None:
    state = muscle.settle(0.0, calcium(pca))
    later = muscle.step(state, 0.0, calcium(pca), 1.0)
    n = len(muscle.state_names) - 3
    np.testing.assert_allclose(later[:n], state[:n], atol=2e-7 if muscle.fibre.method == "gaussian" else 2e-5)


@pytest.mark.parametrize("pca", PCAS)
def test_heads_are_conserved_and_fractions_stay_fractions(muscle: Muscle, pca: float) -> None:
    """Attached, ready, torn off and super-relaxed heads make one; bound sites are available sites."""
    time = np.arange(301) * 1e-3
    length = np.interp(time, [0.0, 0.05, 0.13, 0.21, 0.3], [0.0, 0.0, 0.038, 0.0, 0.0])
    states = muscle.run(muscle.settle(0.0, calcium(pca)), np.diff(time), length, np.full(time.size, calcium(pca)))
    out = muscle.outputs_of(states)
    for name in ("q0", "n_on", "drx", "r"):
        assert out[name].min() >= -1e-6, name
        assert out[name].max() <= 1.0 + 1e-6, name
    assert np.all(out["q0"] + out["drx"] + out["r"] <= 1.0 + 1e-6)
    assert np.all(out["q0"] <= out["n_on"] + 1e-3)


def test_force_grows_with_calcium(muscle: Muscle) -> None:
    forces = [muscle.outputs(muscle.settle(0.0, calcium(pca))).force_ce_f0 for pca in (6.8, 6.4, 6.0, 5.0, 4.5)]
    assert np.all(np.diff(forces) > 0.0)


def at_length(change: float, v: Mapping[str, float]) -> tuple[float, float]:
    """Share of active force and passive cross-bridge force of half-sarcomeres; 1 and 0 without such relations."""
    if "fp_max" not in v:
        return 1.0, 0.0
    q = Quantities({**v, "sarcomere_change": change}, "test", None)
    return float(ActiveForceLength().force_share(q)[0]), float(PassiveForceLength().inner_force(q))


def compliance(force: float, v: Mapping[str, float]) -> float:
    """Of the smoothed series spring, power strokes per cross-bridge force."""
    sharp = v["smoothing"]
    return float(1.0 / (v["kse"] * (v["kse0"] + np.logaddexp(0.0, sharp * force) / sharp)))


def test_both_elements_bear_the_same_force(muscle: Muscle) -> None:
    """Series force computed from lengths alone equals the cross-bridges' force, also after long random movement."""
    rng = np.random.default_rng(5)
    state = muscle.settle(0.0, 1.0)
    v = muscle.fibre.values
    for k in range(2000):
        state = muscle.step(state, float(rng.uniform(-0.02, 0.03)), float(rng.uniform(0.3, 5.0)), 1e-3)
        out = muscle.outputs(state)
        extension = v["gamma"] * (state[-3] - out.ce_length_change_l0)
        force_xb = out.force_ce_f0 / v["Fscale"]
        if "kse" not in v:
            # No series element: the contractile element has the fibre's length and velocity.
            assert out.ce_length_change_l0 == state[-3]
            assert out.ce_velocity_l0_per_s == pytest.approx(state[-2], rel=1e-14)
            continue
        if "l_se" in muscle.state_names:
            # Slack bears nothing.
            extension = max(extension, 0.0)
        if "vmax" in v:
            # A third way to the force: by the velocity of the contractile element.
            y = v["e2"] * v["gamma"] * out.ce_velocity_l0_per_s / v["vmax"] + v["e3"]
            share, passive = at_length(out.ce_length_change_l0, v)
            assert force_xb == pytest.approx(share * out.n_on * (v["e1"] * np.arcsinh(y) + v["e4"]) + passive, abs=1e-9)
        if v["smoothing"] == 0.0:
            series = v["kse0"] * np.expm1(v["kse"] * extension) if extension > 0.0 else v["kse"] * v["kse0"] * extension
            assert abs(series - force_xb) < 1e-12
        else:
            # The smoothed spring has no closed form: integrate its compliance independently.
            if k % 200 == 0:
                total, _ = quad(compliance, 0.0, force_xb, args=(v,), epsabs=1e-13, epsrel=1e-13, limit=500)
                assert abs(total - extension) < 1e-9


@pytest.mark.parametrize("pca", PCAS)
@pytest.mark.parametrize("dt", [1e-3, 5e-4])
def test_fixed_steps_up_to_1_ms_are_accurate(mover: Muscle, pca: float, dt: float) -> None:
    """Against 32 times smaller steps over the same samples: the bar of the paper for 1e-4 s is 0.01 % F0."""
    time = np.arange(round(0.2 / dt) + 1) * dt
    length = np.interp(time, [0.0, 0.02, 0.1, 0.18, 0.2], [0.0, 0.0, 0.036, 0.0, 0.0])
    start = mover.settle(0.0, calcium(pca))
    held = np.full(time.size, calcium(pca))
    coarse, fine = (mover.run(start, np.diff(time), length, held, n) for n in (1, 32))
    force = [mover.outputs_of(states)["force_f0"] for states in (coarse, fine)]
    assert np.abs(force[0] - force[1]).max() < (1e-4 if mover.code.ORDER == 3 else 3e-4)


@pytest.mark.parametrize("pca", PCAS)
def test_variable_steps_land_where_fixed_steps_do(mover: Muscle, pca: float) -> None:
    corner, length = np.array([0.0, 0.02, 0.1, 0.18, 0.2]), np.array([0.0, 0.0, 0.036, 0.0, 0.0])
    time = np.linspace(0.0, 0.2, 201)
    start = mover.settle(0.0, calcium(pca))
    held = np.full(time.size, calcium(pca))
    fixed = mover.run(start, np.diff(time), np.interp(time, corner, length), held, 32)
    variable = mover.follow(start, corner, length, held[:5], time, 1e-6 if mover.code.ORDER == 3 else 1e-7)
    force = [mover.outputs_of(states)["force_f0"] for states in (fixed, variable)]
    if len(mover.state_names) == 3:
        # Force follows velocity at once: at the corners themselves it has two values.
        inside = np.abs(time[:, None] - corner).min(axis=1) > 1e-9
        force = [f[inside] for f in force]
    assert np.abs(force[0] - force[1]).max() < 2e-5


@pytest.mark.parametrize("pca", PCAS)
def test_variable_steps_sample_where_they_are_asked_to(mover: Muscle, pca: float) -> None:
    """Samples at odd times, doubled, and on the corners: the same states whatever else is sampled."""
    corner, length = np.array([0.1, 0.13, 0.2, 0.21]), np.array([0.0, 0.0, 0.03, 0.03])
    odd = np.sort(np.concatenate([corner, 0.1 + 0.11 * np.random.default_rng(3).uniform(size=40)]))
    start = mover.settle(0.0, calcium(pca))
    held = np.full(4, calcium(pca))
    many = mover.follow(start, corner, length, held, np.repeat(odd, 2), 1e-7)
    np.testing.assert_array_equal(many[0::2], many[1::2])
    np.testing.assert_allclose(many[0::2, -3], np.interp(odd, corner, length), atol=1e-15)
    few = mover.follow(start, corner, length, held, corner, 1e-7)
    force = [mover.outputs_of(states)["force_f0"] for states in (many[::2][np.isin(odd, corner)], few)]
    np.testing.assert_allclose(force[0], force[1], atol=2e-6)


def test_order_of_convergence(mover: Muscle) -> None:
    """Slope of log error on log step, by regression: 3 for the moments' stepper, 2 for the grids'."""
    start = mover.settle(0.0, 2.0)
    errors, steps = [], []
    end = 0.016

    def after(count: int) -> np.ndarray:
        time = np.linspace(0.0, end, count + 1)
        states = mover.run(start, np.diff(time), 0.45 * time, np.full(count + 1, 3.0))
        out = mover.outputs(states[-1])
        return np.array([out.force_ce_f0, out.q0, out.q1, out.n_on, out.drx, out.r])

    exact = after(4096)
    for count in (32, 64, 128, 256):
        errors.append(np.abs(after(count) - exact).max())
        steps.append(end / count)
    if len(mover.state_names) == 3:
        # Nothing is integrated, and there is no error that a step could make.
        assert max(errors) < 1e-12
        return
    slope = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert mover.code.ORDER - 0.3 < slope < mover.code.ORDER + 0.4


@pytest.mark.parametrize("method", [k for k in METHODS if k not in EXACT_MOVEMENT])
def test_order_of_convergence_of_interpolation_on_fixed_grids(method: str) -> None:
    """With bins halved, the linear remap's error halves at least; the conservative one's falls by four and more."""
    time = np.arange(101) * 1e-3
    length, held = 0.45 * time, np.full(101, 1.0)

    def force(method: str, bins: float) -> np.ndarray:
        # Interpolation knows nothing of the model: one stands for all.
        fibre = fibre_for("3state_coop", method, 0.0)
        one = Muscle(Fibre(**{**fibre.__dict__, "values": {**fibre.values, "bins": bins}}))
        states = one.run(one.settle(0.0, 1.0), np.diff(time), length, held)
        return one.outputs_of(states)["force_f0"]

    exact = force("characteristics", 1001.0)
    errors = [np.abs(force(method, bins) - exact).max() for bins in (251.0, 501.0, 1001.0)]
    factor = 1.5 if method == "fixed_grid" else 4.0
    assert errors[0] > factor * errors[1] > factor**2 * errors[2]


@pytest.mark.parametrize("pca", PCAS)
def test_gaussian_and_distribution_agree_for_slow_changes(moving_grid: Muscle, pca: float) -> None:
    gaussian = Muscle(fibre_for(moving_grid.fibre.model, "gaussian", 0.0))
    time = np.arange(401) * 1e-3
    length, held = 0.01 * time, np.full(401, calcium(pca))
    force = []
    for one in (moving_grid, gaussian):
        states = one.run(one.settle(0.0, calcium(pca)), np.diff(time), length, held)
        force.append(one.outputs_of(states)["force_f0"])
    assert np.abs(force[0] - force[1]).max() < 0.01


def test_large_movements_never_leave_the_grid(gridded: Muscle) -> None:
    """Half a fibre length either way is 65 power strokes, four times the grid's half width."""
    time = np.arange(1001) * 2e-3
    length = 0.3 * np.sin(np.pi * time)
    states = gridded.run(gridded.settle(0.0, 3.0), np.diff(time), length, np.full(1001, 3.0), every=10)
    assert np.abs(states[:, gridded.state_names.index("grid_shift")]).max() < 0.1
    assert np.isfinite(gridded.outputs_of(states)["force_f0"]).all()


def test_a_grid_that_may_not_follow_says_when_it_is_left(moving_grid: Muscle) -> None:
    fibre = fibre_for(moving_grid.fibre.model, "characteristics", 0.0)
    stuck = Muscle(Fibre(**{**fibre.__dict__, "values": {**fibre.values, "regrid": 0.0}}))
    start, length = stuck.settle(0.0, 3.0), 0.001 * np.arange(200)
    with pytest.raises(StateViolation, match="grid_shift"):
        stuck.run(start, np.full(199, 2e-3), length, np.full(200, 3.0))


def test_calcium_jump_from_rest_at_full_calcium_and_1_ms(muscle: Muscle) -> None:
    """The stiffest thing a control loop can do: the thin filament switches on within a fraction of one step."""
    state = muscle.rest()
    for _ in range(2000):
        state = muscle.step(state, 0.0, calcium(4.5), 1e-3)
    exact = muscle.settle(0.0, calcium(4.5), 2.0)
    assert abs(muscle.outputs(state).force_f0 - muscle.outputs(exact).force_f0) < 1e-4


def test_step_is_pure(muscle: Muscle) -> None:
    state = muscle.settle(0.0, 1.0)
    before = state.copy()
    one = muscle.step(state, 0.01, 1.0, 1e-3)
    two = muscle.step(state, 0.01, 1.0, 1e-3)
    np.testing.assert_array_equal(state, before)
    np.testing.assert_array_equal(one, two)


def test_run_is_step_by_step_bit_for_bit(muscle: Muscle) -> None:
    rng = np.random.default_rng(1)
    time = np.cumsum(rng.uniform(2e-4, 2e-3, 200))
    length = np.cumsum(rng.normal(0.0, 2e-4, 200))
    ca = rng.uniform(0.2, 4.0, 200)
    start = muscle.settle(float(length[0]), float(ca[0]))
    states = muscle.run(start, np.diff(time), length, ca)
    state = start
    for k in range(1, 200):
        state = muscle.step(state, float(length[k]), float(ca[k]), float(time[k] - time[k - 1]))
        np.testing.assert_array_equal(state, states[k])


@pytest.mark.parametrize("model", MODELS)
def test_variants_differ_from_their_base_in_the_one_element_only(model: str) -> None:
    """All of them, written out but not compiled: what the base models pass, they pass with them."""
    ours, base = compose(model), compose(BASE_OF[model])
    if not isinstance(base, Composition):
        return
    e, b = ours.equations(False), base.equations(False)
    same = len(b.states)
    # A spring that goes slack has its length as one more state, behind the others.
    assert [s.name for s in e.states[same:]] == (["l_se"] if "slack" in model else [])
    assert e.derivatives[:same] == b.derivatives[:same]
    expected = e.symbols["gamma"] * e.symbols["velocity"] if "rigid" in model else b.derivatives[same]
    assert (e.derivatives[len(e.states)] == expected) == ("slack" not in model)
    assert (e.arrival[:same], e.rest[:same]) == (b.arrival, b.rest)
    names = {row.name for row in ours.parameters}
    assert ("kse" in names) == ("rigid" not in model)
    assert ("lpe0" in names) == ("softplus" in model) == ("Fpe0" not in names)
