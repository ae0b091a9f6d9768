"""Blocks as plain Python: formulas with numbers in, and what happens when a link is missing."""

from __future__ import annotations

import math

import pytest

from xb_muscle_ros.mechanisms import GaussianSpread, Quantities, StepRate, ops
from xb_muscle_ros.mechanisms.detachment.forcible import ForcibleDetachment
from xb_muscle_ros.mechanisms.parallel.softplus import SoftplusParallel
from xb_muscle_ros.mechanisms.series.exponential import ExponentialSeries
from xb_muscle_ros.mechanisms.thick_filament.force_dependent import ForceDependentThickFilament
from xb_muscle_ros.mechanisms.thin_filament.cooperative import CooperativeThinFilament
from xb_muscle_ros.mechanisms.thin_filament.sigmoid import SigmoidThinFilament


def test_missing_link_fails_by_name() -> None:
    q = Quantities({"kon": 1.0}, "cooperative", None)
    with pytest.raises(AttributeError, match="mechanism cooperative asks for 'calcium'"):
        CooperativeThinFilament().derivatives(q)


def test_thin_filament_by_hand() -> None:
    q = Quantities({"kon": 2.0, "koff": 80.0, "koop": 3.0, "calcium": 5.0, "n_on": 0.5, "q0": 0.2}, "cooperative", None)
    # 2*5*(1-0.5)*(1+3*0.5) - 80*(0.5-0.2)*(1+3*0.5) = 12.5 - 60
    assert CooperativeThinFilament().derivatives(q)["n_on"] == pytest.approx(-47.5)


def test_sigmoid_is_half_at_kappa() -> None:
    q = Quantities({"kappa": 0.7, "n": 4.0, "tau_act": 0.005, "calcium": 0.7, "n_on": 0.0}, "sigmoid", None)
    assert SigmoidThinFilament().derivatives(q)["n_on"] == pytest.approx(0.5 / 0.005)


def test_thick_filament_by_hand() -> None:
    values = {"J1": 6.0, "J2": 200.0, "JF": 100.0, "q0": 0.3, "drx": 0.2, "forcibly_detached": 0.1}
    q = Quantities({**values, "force_xb": 0.35, "attachment_rate_net": 1.5, "recruitment": 0.0}, "", None)
    # 6*(1+100*0.35)*(1-0.3-0.2-0.1) - 200*0.2 - 1.5 = 86.4 - 40 - 1.5
    assert ForceDependentThickFilament().derivatives(q)["drx"] == pytest.approx(44.9)
    stretched = q.for_block("", recruitment=2.0)
    # 6*2*(1-0.3-0.2-0.1) more.
    assert ForceDependentThickFilament().derivatives(stretched)["drx"] == pytest.approx(49.7)
    assert ForceDependentThickFilament().rest(q)["drx"] == pytest.approx(6.0 / 206.0)


def test_forcible_detachment_by_hand() -> None:
    values = {"k": 1000.0, "b": 3000.0, "dLcrit": 2.0, "steepness": 3.0, "r": 0.1, "w": 0.3}
    q = Quantities({**values, "torn_off": 40.0, "reattached": 300.0}, "forcible", None)
    block = ForcibleDetachment()
    assert block.forcible_rates(q) == (StepRate(1000.0, 2.0, 3.0),)
    assert block.reattachment(q) == (GaussianSpread(pytest.approx(300.0), 0.3),)
    assert block.derivatives(q) == {"r": -260.0}
    assert block.forcibly_detached(q) == 0.1


def test_softplus_parallel_spring_is_half_a_sharpness_wide() -> None:
    block = SoftplusParallel()
    at = {"kpe": 0.002, "gamma": 130.0, "lpe0": 0.02, "pe_sharpness": 100.0}
    force = [block.force(Quantities({**at, "length_change": x}, "softplus", None)) for x in (-0.3, 0.02, 0.5)]
    assert force[0] == pytest.approx(0.0, abs=1e-14)
    assert force[1] == pytest.approx(0.26 * math.log(2.0) / 100.0)
    assert force[2] == pytest.approx(0.26 * 0.48)


def test_series_velocity_keeps_the_force_balance() -> None:
    values = {"kse": 0.3, "kse0": 0.1, "force_xb": 0.5, "stiffness_xb": 0.4, "gamma": 130.0, "velocity": 0.4545}
    q = Quantities({**values, "kinetic_force_rate": 7.0, "smoothing": 0.0}, "exponential", None)
    u = ExponentialSeries().ce_velocity(q)
    # d(cross-bridge force)/dt = kinetics + stiffness u must equal d(series force)/dt = k_se (gamma v - u).
    assert 7.0 + 0.4 * u == pytest.approx(0.3 * (0.5 + 0.1) * (130.0 * 0.4545 - u))


def test_series_extension_inverts_the_spring() -> None:
    q = Quantities({"kse": 0.3, "kse0": 0.1, "force_xb": 0.5, "smoothing": 0.0}, "exponential", None)
    extension = ExponentialSeries().extension(q)
    assert 0.1 * (ops.exp(0.3 * extension) - 1.0) == pytest.approx(0.5)


@pytest.mark.parametrize("z", [-3.0, -0.01, 0.0, 0.01, 3.0])
def test_softplus_with_numbers(z: float) -> None:
    import numpy as np

    assert ops.softplus(z, 100.0) == pytest.approx(np.logaddexp(0.0, 100.0 * z) / 100.0, abs=1e-15)
    assert ops.positive(z) == max(z, 0.0)
