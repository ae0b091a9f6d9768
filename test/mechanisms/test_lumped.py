"""Activation and force-velocity relation of the Hill-type models, by hand."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from xb_muscle_ros.mechanisms import Contractile, Quantities
from xb_muscle_ros.mechanisms.activation.sigmoid import SigmoidActivation
from xb_muscle_ros.mechanisms.force_velocity.logarithmic import LogarithmicForceVelocity
from xb_muscle_ros.mechanisms.series.exponential import ExponentialSeries
from xb_muscle_ros.mechanisms.series.rigid import RigidSeries
from xb_muscle_ros.models.fibre_file import load_fibre
from xb_muscle_ros.models.muscle import Muscle

SHAPE = {"e1": -0.3183, "e2": -8.1492, "e3": -0.3741, "e4": 0.8856, "vmax": 78.0}
RELATION = LogarithmicForceVelocity()


def quantities(**values: float) -> Quantities:
    return Quantities({**SHAPE, **values}, "test", None)


@given(velocity=st.floats(-100.0, 1e4))
def test_velocity_is_the_inverse_of_force(velocity: float) -> None:
    force = RELATION.force(quantities(), velocity)
    y = SHAPE["e2"] * velocity / SHAPE["vmax"] + SHAPE["e3"]
    assert force == pytest.approx(SHAPE["e1"] * math.log(y + math.hypot(y, 1.0)) + SHAPE["e4"], abs=1e-6)
    assert RELATION.velocity(quantities(), force) == pytest.approx(velocity, rel=1e-9, abs=1e-9)


def test_force_falls_to_zero_near_vmax_and_rises_in_lengthening() -> None:
    q = quantities()
    assert RELATION.force(q, 0.0) == pytest.approx(1.002, abs=1e-3)
    assert RELATION.force(q, -SHAPE["vmax"]) == pytest.approx(0.0, abs=0.02)
    assert RELATION.force(q, SHAPE["vmax"]) == pytest.approx(1.79, abs=0.01)


def test_a_force_far_above_activation_has_a_finite_velocity() -> None:
    """Activation can fall a thousandfold at once: then F/a is 500, whose sinh no double holds."""
    q = quantities()
    steps = [RELATION.velocity(q, force) for force in (4.7, 4.71, 5.0, 500.0)]
    assert steps == sorted(steps)
    assert math.isfinite(steps[-1])
    assert steps[0] > 9e3 * SHAPE["vmax"]


@pytest.mark.parametrize(("calcium", "level"), [(0.8, 0.25), (0.0, 0.005), (1e6, 0.5)])
def test_activation(calcium: float, level: float) -> None:
    values = {"act_max": 0.5, "kappa": 0.8, "n": 3.0, "amin": 0.005}
    if calcium == 0.0:
        # Compiled code divides as IEEE does; plain Python does not divide by zero.
        calcium = 1e-9
    assert SigmoidActivation().level(quantities(calcium=calcium, **values)) == pytest.approx(level, abs=1e-9)


def test_series_elements_share_force_with_a_contractile_element() -> None:
    viscous = Contractile(force_at=lambda u: 0.5 + 0.1 * u, velocity_at=lambda force: (force - 0.5) / 0.1)
    q = quantities(gamma=130.0, velocity=0.2, l_se=3.0, kse=0.3, kse0=0.1)
    spring = ExponentialSeries().balance(q, viscous)
    assert spring.force == pytest.approx(0.1 * math.expm1(0.9))
    assert viscous.force_at(spring.ce_velocity) == pytest.approx(spring.force)
    assert spring.derivatives["l_se"] + spring.ce_velocity == pytest.approx(26.0)
    slack = ExponentialSeries().balance(quantities(gamma=130.0, velocity=0.2, l_se=-2.0, kse=0.3, kse0=0.1), viscous)
    assert slack.force == 0.0
    rigid = RigidSeries().balance(q, viscous)
    assert (rigid.ce_velocity, rigid.force, rigid.extension) == (26.0, pytest.approx(3.1), 0.0)


@pytest.mark.parametrize("model", ["hill", "hill_se"])
@pytest.mark.parametrize("pca", [4.5, 6.2, 6.6, 9.0])
def test_isometric_force_is_activation(model: str, pca: float) -> None:
    fibre = load_fibre("13Dec2017a", model)
    one = Muscle(fibre)
    out = one.outputs(one.settle(0.01, 10.0 ** (6.0 - pca)))
    v = fibre.values
    level = max(v["act_max"] / (1.0 + (v["kappa"] / 10.0 ** (6.0 - pca)) ** v["n"]), v["amin"])
    isometric = v["e1"] * math.asinh(v["e3"]) + v["e4"]
    assert out.n_on == pytest.approx(level, rel=1e-12)
    assert out.force_ce_f0 == pytest.approx(v["Fscale"] * level * isometric, rel=1e-7)
    assert (out.q0, out.q1, out.q2, out.drx, out.r) == (0.0, 0.0, 0.0, 0.0, 0.0)


def test_every_method_is_the_same_to_a_model_without_heads() -> None:
    forces = set()
    for method in ("gaussian", "characteristics", "fixed_grid"):
        one = Muscle(load_fibre("13Dec2017a", "hill_se", method))
        forces.add(one.outputs(one.step(one.settle(0.0, 1.0), 0.002, 1.0, 1e-3)).force_f0)
    assert len(forces) == 1


def test_calcium_that_vanishes_at_once_is_no_violation() -> None:
    one = Muscle(load_fibre("18Dec2017a", "hill_se"))
    state = one.step(one.settle(0.0, 31.6), 0.0, 0.0, 1e-3)
    assert one.outputs(state).n_on == one.fibre.values["amin"]
    assert 0.0 < one.outputs(state).force_ce_f0 < 0.05
