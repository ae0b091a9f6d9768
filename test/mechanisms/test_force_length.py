"""Curves of active and passive force over the half-sarcomeres' length, by their formulas alone."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from xb_muscle_ros.mechanisms import Quantities
from xb_muscle_ros.mechanisms.extras.active_force_length import ActiveForceLength
from xb_muscle_ros.mechanisms.extras.passive_force_length import PassiveForceLength

# MuJoCo's defaults, the narrowest and the widest curves allowed, and lopsided ones.
CURVES = ((0.5, 1.6), (0.95, 1.05), (0.0, 4.0), (0.2, 1.1), (0.9, 2.5))
FSCALE, GAMMA = 2.0, 130.0
lengths = st.floats(-1.0, 3.5)
curves = st.tuples(st.floats(0.0, 0.95), st.floats(1.05, 4.0), st.floats(-0.5, 0.5))


def quantities(change: float, fl_min: float, fl_max: float, optimum: float = 0.0, fp_max: float = 1.3) -> Quantities:
    values = {"fl_min": fl_min, "fl_max": fl_max, "fl_optimum": optimum, "fp_max": fp_max, "fp_onset": 0.0}
    return Quantities({**values, "sarcomere_change": change, "Fscale": FSCALE, "gamma": GAMMA}, "test", None)


def share(change: float, *curve: float) -> tuple[float, float]:
    value, slope = ActiveForceLength().force_share(quantities(change, *curve))
    return float(value), float(slope)


def passive_f0(change: float, fl_min: float, fl_max: float, optimum: float = 0.0, fp_max: float = 1.3) -> float:
    return float(PassiveForceLength().inner_force(quantities(change, fl_min, fl_max, optimum, fp_max)) * FSCALE)


@pytest.mark.parametrize(("fl_min", "fl_max"), CURVES)
def test_both_curves_are_mujoco_s(fl_min: float, fl_max: float) -> None:
    mujoco = pytest.importorskip("mujoco", reason="needs the extra mujoco")
    # Range 0 to 1 of a length range 0 to 1: lengths are in units of the optimum. Velocity 0: force-velocity is at 1.
    f0, fp_max = 1.0, 1.3
    prm = np.array([0.0, 1.0, f0, 200.0, fl_min, fl_max, 1.5, fp_max, 1.2])
    found = np.linspace(-0.2, 4.5, 4001)
    for length in (*found, fl_min, 1.0, fl_max, 0.5 * (fl_min + 1.0), 0.5 * (1.0 + fl_max)):
        active = -mujoco.mju_muscleGain(length, 0.0, np.array([0.0, 1.0]), 1.0, prm)
        passive = -mujoco.mju_muscleBias(length, np.array([0.0, 1.0]), 1.0, prm)
        assert share(length - 1.0, fl_min, fl_max)[0] == pytest.approx(active, rel=0.0, abs=1e-12)
        assert passive_f0(length - 1.0, fl_min, fl_max) == pytest.approx(passive, rel=1e-12, abs=1e-12)


@given(lengths, curves)
def test_the_share_is_one_and_none_beyond_the_limits(change: float, curve: tuple[float, float, float]) -> None:
    fl_min, fl_max, optimum = curve
    value, slope = share(change, *curve)
    assert -1e-15 <= value <= 1.0 + 1e-15
    length = 1.0 + change - optimum
    if length < fl_min - 1e-12 or length > fl_max + 1e-12:
        assert (value, slope) == (0.0, 0.0)
    assert share(optimum, *curve) == (1.0, 0.0)
    # It rises up to the optimum and falls from there on.
    assert slope * (change - optimum) <= 0.0


@given(lengths, curves, st.floats(1e-7, 1e-2))
def test_slopes_are_continuous_and_those_of_the_curves(
    change: float, curve: tuple[float, float, float], by: float
) -> None:
    """Two points closer than `by` differ in slope by no more than the largest curvature times `by`."""
    fl_min, fl_max, _ = curve
    curvature = max(1.0 / ((1.0 - fl_min) / 2.0) ** 2, 1.0 / ((fl_max - 1.0) / 2.0) ** 2)
    (behind, first), (ahead, second) = share(change, *curve), share(change + by, *curve)
    assert abs(second - first) <= curvature * by * (1.0 + 1e-6) + 1e-9
    # The mean of a slope that is straight between its corners.
    assert abs((ahead - behind) - 0.5 * (first + second) * by) <= 0.5 * curvature * by**2 + 1e-12
    q = [quantities(change + more, *curve) for more in (0.0, by)]
    block = PassiveForceLength()
    forces = [float(block.inner_force(each)) for each in q]
    rates = [block.inner_kinetics(each) for each in q]
    assert [rate for rate, _ in rates] == [0, 0]
    slopes = [float(stiffness) * GAMMA for _, stiffness in rates]
    bend = 1.3 / FSCALE / ((fl_max - 1.0) / 2.0) ** 2
    assert abs(slopes[1] - slopes[0]) <= bend * by * (1.0 + 1e-6) + 1e-9
    assert abs((forces[1] - forces[0]) - 0.5 * sum(slopes) * by) <= 0.5 * bend * by**2 + 1e-12


@given(st.floats(1.05, 4.0), st.floats(-0.5, 0.5), st.floats(0.0, 100.0))
def test_passive_force_is_fp_max_three_quarters_of_the_way(fl_max: float, optimum: float, fp_max: float) -> None:
    whole = fl_max - 1.0
    for way, force in ((0.75, 1.0), (0.5, 0.5), (0.25, 0.125), (1.0, 1.5)):
        found = passive_f0(optimum + way * whole, 0.5, fl_max, optimum, fp_max)
        assert found == pytest.approx(force * fp_max, rel=1e-9)
    assert passive_f0(optimum, 0.5, fl_max, optimum, fp_max) == 0.0
    assert passive_f0(-1.0, 0.5, fl_max, optimum, fp_max) == 0.0


def test_the_curve_s_corners_in_numbers() -> None:
    """By hand from the piecewise formulas: half the share lies halfway to either limit."""
    assert share(-0.25, 0.5, 1.6)[0] == pytest.approx(0.5, abs=1e-15)
    assert share(0.3, 0.5, 1.6)[0] == pytest.approx(0.5, abs=1e-15)
    assert share(0.02, 0.5, 1.6, 0.02) == (1.0, 0.0)
    assert passive_f0(0.3, 0.5, 1.6) == pytest.approx(1.3 / 2.0, abs=1e-15)
    assert passive_f0(0.9, 0.5, 1.6) == pytest.approx(1.3 * 2.5, rel=1e-12)
