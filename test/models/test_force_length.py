"""Models whose half-sarcomeres have active and passive force-length relations."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.mechanisms import Quantities
from xb_muscle_ros.mechanisms.extras.active_force_length import ActiveForceLength
from xb_muscle_ros.mechanisms.extras.passive_force_length import PassiveForceLength
from xb_muscle_ros.models.composition import Outputs
from xb_muscle_ros.models.fibre_file import changed, load_fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.models.registry import split_set

ACTIVE, BOTH = "+active_force_length", "+active_force_length+passive_force_length"
SLACK, RIGID = f"3state_coop_slack{BOTH}", f"3state_coop_rigid{BOTH}"
HILL, HILL_SE, HILL_SLACK = f"hill{BOTH}", f"hill_se{BOTH}", f"hill_se_slack{BOTH}"
MODELS = (SLACK, RIGID, HILL, HILL_SE, HILL_SLACK)
# Least strength of a Hill-type element with a series spring, of all heads' force: see `models.hill`.
LEAST = 1e-4
changes = st.floats(-0.5, 0.5)
pcas = st.floats(4.0, 9.0)
few = settings(max_examples=40, deadline=None)


@functools.cache
def muscle(model: str, **values: float) -> Muscle:
    fibre = load_fibre("18Dec2017a", model)
    return Muscle(changed(fibre, {"smoothing": 0.0, "kpe": 0.0, "Fpe0": 0.0, **values}, "test"))


def calcium(pca: float) -> float:
    return float(10.0 ** (6.0 - pca))


def curves(one: Muscle, change: float) -> tuple[float, float]:
    """Share of active force and passive force (F0) at a length change of the half-sarcomeres."""
    q = Quantities({**one.fibre.values, "sarcomere_change": float(change)}, "test", None)
    passive = PassiveForceLength().inner_force(q) if "fp_max" in one.fibre.values else 0.0
    return float(ActiveForceLength().force_share(q)[0]), float(passive * one.fibre.values["Fscale"])


@functools.cache
def without_lengths(model: str, pca: float) -> float:
    """Isometric force of the same fibre with neither relation, F0: it is the same at any length."""
    stem = model.split("+")[0]
    return muscle(stem).outputs(muscle(stem).settle(0.0, calcium(pca))).force_ce_f0


@pytest.mark.parametrize("model", MODELS)
@given(change=changes, pca=pcas)
@few
def test_isometric_force_is_in_proportion_to_the_share(model: str, change: float, pca: float) -> None:
    """At any length and calcium: the share at the half-sarcomeres' length times the force at the optimum."""
    one = muscle(model)
    out = one.outputs(one.settle(change, calcium(pca)))
    share, passive = curves(one, out.ce_length_change_l0)
    active = share * without_lengths(model, pca)
    # Where there is next to no active force, a series spring of a Hill-type model still finds 1e-4 of all heads' force.
    # At no velocity the force-velocity relation is at 1.002.
    spared = 1.01 * one.fibre.values["Fscale"] * LEAST if model in (HILL_SE, HILL_SLACK) else 0.0
    assert out.force_f0 == pytest.approx(active + passive, abs=1e-7 + spared)
    if active > spared:
        assert out.force_f0 == pytest.approx(active + passive, abs=1e-7)


@pytest.mark.parametrize("fp_max", [0.0, 1.3])
@given(speed=st.floats(0.1, 10.0), pca=st.floats(4.5, 6.6), down=st.booleans())
@few
def test_the_spring_bears_what_heads_and_passive_force_do(fp_max: float, speed: float, pca: float, down: bool) -> None:
    """Through 0.6 to 1.4 L0 and back, at any speed: spring = share * heads + passive, taut to 0.01 % F0."""
    one = muscle(SLACK, fp_max=fp_max)
    far = 0.4 / speed
    time = np.arange(int(4.0 * far / 1e-3) + 2) * 1e-3
    length = np.interp(time, [0.0, far, 3.0 * far, 4.0 * far], [0.0, 0.4, -0.4, 0.0]) * (-1.0 if down else 1.0)
    held = np.full(time.size, calcium(pca))
    states = one.run(one.settle(0.0, float(held[0])), np.diff(time), length, held)
    out = one.outputs_of(states)
    both = np.array([curves(one, change) for change in out["ce_length_change_l0"]])
    heads = one.fibre.values["Fscale"] * both[:, 0] * (out["q0"] + out["q1"]) + both[:, 1]
    l_se, v = states[:, one.state_names.index("l_se")], one.fibre.values
    spring = v["Fscale"] * v["kse0"] * np.expm1(v["kse"] * np.maximum(l_se, 0.0))
    np.testing.assert_allclose(out["force_ce_f0"], spring, rtol=0.0, atol=1e-12)
    unequal, taut = np.abs(heads - spring), l_se > 0.0
    assert unequal[taut].max() < 1e-4
    # When a spring goes slack its stiffness jumps: without either relation the same shortening leaves 0.03 % F0.
    assert unequal[~taut].max(initial=0.0) < 5e-4
    assert out["force_f0"].min() >= 0.0
    # Lengths add up: half-sarcomeres and spring are the fibre.
    np.testing.assert_allclose(out["ce_length_change_l0"] + l_se / v["gamma"], length, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("fp_max", [0.0, 1.3])
def test_comes_to_rest_at_any_length_and_calcium(model: str, fp_max: float) -> None:
    """Also where there is no active force at all, below 0.5 L0 and above 1.6 L0."""
    one = muscle(model, fp_max=fp_max)
    for change in (*np.linspace(-0.5, 0.5, 21), -0.55, 0.6, 0.7):
        for pca in (4.0, 5.0, 6.0, 6.5, 7.0, 9.0):
            out = one.outputs(one.settle(float(change), calcium(pca)))
            assert 0.0 <= out.force_f0 < 2.5


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("fp_max", [0.0, 1.3])
@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=15, deadline=None)
def test_steps_of_1_ms_at_10_lengths_a_second(model: str, fp_max: float, seed: int) -> None:
    """Back and forth between 0.5 and 1.6 L0 while calcium jumps; nothing raises, and no slack element pushes."""
    one, random = muscle(model, fp_max=fp_max), np.random.default_rng(seed)
    length = [float(random.uniform(-0.5, 0.6))]
    held = [calcium(random.uniform(4.0, 9.0))]
    while len(length) < 300:
        speed, level = float(random.choice([-10.0, -1.0, 0.0, 1.0, 10.0])), calcium(random.uniform(4.0, 9.0))
        for _ in range(random.integers(3, 60)):
            if not -0.5 <= length[-1] + speed * 1e-3 <= 0.6:
                speed = -speed
            length.append(length[-1] + speed * 1e-3)
            held.append(level)
    time = np.full(len(length) - 1, 1e-3)
    out = one.outputs_of(one.run(one.settle(length[0], held[0]), time, np.array(length), np.array(held)))
    assert np.isfinite(out["force_f0"]).all()
    assert out["force_f0"].max() < 5.0
    if model not in (RIGID, HILL):
        assert out["force_f0"].min() >= 0.0


def test_a_length_without_active_force_bears_the_passive_one_alone() -> None:
    for model in (SLACK, RIGID):
        one = muscle(model)
        for change in (0.7, 0.9):
            out = one.outputs(one.settle(change, calcium(4.5)))
            share, passive = curves(one, out.ce_length_change_l0)
            assert share == 0.0
            assert passive > 1.0
            assert out.force_f0 == pytest.approx(passive, abs=1e-9)
        assert one.outputs(one.settle(-0.6, calcium(4.5))).force_f0 == 0.0


def test_fixed_steps_of_1_ms_are_accurate_across_the_curves() -> None:
    """From the ascending limb to the descending one and back at a walking muscle's speeds."""
    one = muscle(SLACK)
    time = np.arange(801) * 1e-3
    length = np.interp(time, [0.0, 0.4, 0.8], [-0.3, 0.3, -0.3])
    held = np.full(time.size, calcium(6.0))
    start = one.settle(-0.3, float(held[0]))
    coarse, fine = (one.outputs_of(one.run(start, np.diff(time), length, held, n))["force_f0"] for n in (1, 32))
    assert np.abs(coarse - fine).max() < 1e-4


def test_bins_bear_the_same_share_as_moments() -> None:
    """On a strain grid the same relations act on the sums over bins."""
    time = np.arange(401) * 1e-3
    length, held = np.interp(time, [0.0, 0.2, 0.4], [0.0, 0.02, 0.02]) - 0.2, np.full(401, calcium(6.0))
    force = []
    for method in ("gaussian", "characteristics"):
        fibre = load_fibre("18Dec2017a", SLACK, method)
        one = Muscle(changed(fibre, {"smoothing": 0.0, "kpe": 0.0, "Fpe0": 0.0}, "test"))
        states = one.run(one.settle(-0.2, float(held[0])), np.diff(time), length, held)
        out = one.outputs_of(states)
        both = np.array([curves(one, change) for change in out["ce_length_change_l0"]])
        heads = one.fibre.values["Fscale"] * both[:, 0] * (out["q0"] + out["q1"]) + both[:, 1]
        assert np.abs(heads - out["force_ce_f0"]).max() < 1e-4
        force.append(out["force_f0"])
    assert np.abs(force[0] - force[1]).max() < 0.01


def test_two_half_sarcomeres_have_each_its_own_share() -> None:
    model = f"3state_coop_slack{BOTH}+half_sarcomere_spread"
    one = muscle(model, hs_spread=0.1)
    time = np.arange(601) * 1e-3
    length = np.interp(time, [0.0, 0.3, 0.6], [0.0, 0.3, -0.2])
    held = np.full(time.size, calcium(5.5))
    states = one.run(one.settle(0.0, float(held[0])), np.diff(time), length, held)
    out, v = one.outputs_of(states), one.fibre.values
    column = {name: states[:, i] for i, name in enumerate(one.state_names)}
    apart = column["hs_difference"] / 2.0
    tie = v["hs_stiffness"] * apart
    mean = out["ce_length_change_l0"]
    own, other = (np.array([curves(one, c)[0] for c in mean + side * apart / v["gamma"]]) for side in (1.0, -1.0))
    strong = 1.1 * own * (column["q0"] + column["q1"]) + tie
    weak = 0.9 * other * (column["other_q0"] + column["other_q1"]) - tie
    passive = np.array([curves(one, c)[1] for c in mean])
    assert np.abs(apart).max() > 1.0
    np.testing.assert_allclose(strong, weak, atol=1e-4)
    np.testing.assert_allclose(v["Fscale"] * strong + passive, out["force_ce_f0"], atol=2e-4)


@pytest.mark.parametrize("model", ["3state_coop", "hill_se"])
def test_the_optimum_moves_both_curves(model: str) -> None:
    """A fibre that is longer by as much as its optimum is: the same force."""
    name = f"{model}{'' if model.startswith('hill') else '_slack'}{BOTH}"
    here, there = muscle(name), muscle(name, fl_optimum=0.03)
    for change in (-0.3, 0.0, 0.25):
        forces = [
            Outputs(*one.outputs(one.settle(change + by, 1.0))).force_f0 for one, by in ((here, 0.0), (there, 0.03))
        ]
        assert forces[0] == pytest.approx(forces[1], abs=1e-9)


@pytest.mark.parametrize(
    ("name", "remedy"),
    [
        (f"3state_coop{ACTIVE}", "take 3state_coop_slack or 3state_coop_rigid in its place"),
        ("2state_softplus+passive_force_length", "take 2state_slack_softplus or 2state_rigid_softplus in its place"),
        (f"2state_rigid{ACTIVE}+series_compliance", "take 2state_slack or 2state_rigid in its place"),
    ],
)
def test_a_spring_whose_length_follows_from_force_is_refused_with_the_remedy(name: str, remedy: str) -> None:
    with pytest.raises(UserError) as caught:
        split_set(name)
    told = str(caught.value)
    assert "needs a series element whose length does not follow from the heads' force" in told
    assert remedy in told
    assert "\n" not in told
