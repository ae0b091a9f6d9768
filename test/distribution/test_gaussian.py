"""Moments of detachment against numerical integrals over strain."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad, trapezoid

from xb_muscle_ros.distribution.gaussian import Gaussian
from xb_muscle_ros.mechanisms import ExponentialRate, GaussianSpread, Quantities, StepRate, ops


@given(
    q0=st.floats(0.01, 1.0),
    mean=st.floats(-3.0, 3.0),
    deviation=st.floats(0.05, 1.0),
    scale=st.floats(0.0, 100.0),
    slope=st.floats(-2.5, 2.5),
)
def test_exponential_detachment(q0: float, mean: float, deviation: float, scale: float, slope: float) -> None:
    q = Quantities({"q0": q0, "q1": q0 * mean, "q2": q0 * (deviation**2 + mean**2)}, "test", None)
    flux = Gaussian().outflow(q, ExponentialRate(scale, slope))
    for power, ours in enumerate(flux):

        def integrand(z: float, power: int = power) -> float:
            x = mean + deviation * z
            return x**power * scale * math.exp(slope * x - 0.5 * z * z) / math.sqrt(2.0 * math.pi)

        # exp(slope x) moves the bell by slope times its variance: integrate around where it then stands.
        middle = slope * deviation
        theirs, _ = quad(integrand, middle - 12.0, middle + 12.0, epsabs=1e-12, epsrel=1e-11, limit=200)
        # 1e-9 heads keep Q1/Q0 defined at rest; with 0.01 heads and more they show in the seventh digit at most.
        size = scale * math.exp(slope * mean + 0.5 * (slope * deviation) ** 2) * (1 + abs(mean) + deviation) ** 4
        assert ours == pytest.approx(q0 * theirs, rel=1e-5, abs=1e-6 * size + 1e-12)


def head_quantities(q0: float, mean: float, variance: float, smoothing: float | None = None) -> Quantities:
    """Moments of heads with a mean and a variance of strain."""
    return Quantities({"q0": q0, "q1": q0 * mean, "q2": q0 * (variance + mean**2)}, "test", smoothing)


@given(
    q0=st.floats(0.01, 1.0),
    mean=st.floats(-3.0, 3.0),
    deviation=st.floats(0.05, 1.0),
    height=st.floats(0.0, 3000.0),
    threshold=st.floats(-2.0, 4.0),
)
def test_forcible_detachment_is_a_truncated_normal(
    q0: float, mean: float, deviation: float, height: float, threshold: float
) -> None:
    flux = Gaussian().outflow(head_quantities(q0, mean, deviation**2), StepRate(height, threshold, 3.0))
    first = (threshold - mean) / deviation
    for power, ours in enumerate(flux):

        def integrand(z: float, power: int = power) -> float:
            return (mean + deviation * z) ** power * height * math.exp(-0.5 * z * z) / math.sqrt(2.0 * math.pi)

        theirs = 0.0
        if first < 12.0:
            theirs, _ = quad(integrand, max(first, -12.0), 12.0, epsabs=1e-12, epsrel=1e-11, limit=200)
        # See above for the 1e-9 heads; the least deviation of 1e-3 shows in the seventh digit.
        assert ours == pytest.approx(
            q0 * theirs, rel=1e-5, abs=1e-5 * height * (1 + abs(mean) + deviation) ** 3 + 1e-12
        )


@given(mean=st.floats(-3.0, 3.0), deviation=st.floats(0.2, 1.0), threshold=st.floats(0.5, 4.0))
def test_forcible_detachment_of_the_released_sets(mean: float, deviation: float, threshold: float) -> None:
    """Tanh in place of erf, and 10 power strokes in place of infinity, in all three moments."""
    q0, k, sharp = 0.4, 1000.0, 100.0
    ours = Gaussian().outflow(head_quantities(q0, mean, deviation**2, sharp), StepRate(k, threshold, 3.0))
    p = q0 * mean / (np.logaddexp(0.0, sharp * q0) / sharp)
    v = np.logaddexp(0.0, sharp * (q0 * (deviation**2 + mean**2) / q0 - p**2)) / sharp
    width = math.sqrt(2.0 * v)

    def primitive(x: float) -> np.ndarray:
        z = (x - p) / width
        bell = width / math.sqrt(math.pi) * math.exp(-z * z)
        share = math.tanh(z)
        return 0.5 * q0 * np.array([share, share * p - bell, share * (p**2 + v) - bell * (p + x)])

    np.testing.assert_allclose(ours, k * (primitive(10.0) - primitive(threshold)), rtol=1e-4, atol=1e-3)


@given(mean=st.floats(-3.0, 3.0), variance=st.floats(-5.0, 1e-12), distance=st.floats(0.02, 3.0))
def test_a_variance_lost_in_rounding_puts_all_heads_at_one_strain(
    mean: float, variance: float, distance: float
) -> None:
    """Neither a NaN nor a share beyond 0 to 1: all heads are past the threshold, or none."""
    for sign, share in ((-1.0, 1.0), (1.0, 0.0)):
        flux = Gaussian().outflow(head_quantities(0.5, mean, variance), StepRate(1000.0, mean + sign * distance, 3.0))
        assert flux.m0 == pytest.approx(500.0 * share, abs=1e-6)
        assert np.isfinite(flux).all()


@pytest.mark.parametrize("v", [-1e3, -1.0, -1e-6, 0.0, 1e-9, 1e-3, 0.04, 1.0])
def test_deviation_and_its_slope(v: float) -> None:
    import sympy

    from xb_muscle_ros.symbolic.symbols import Deviation

    assert ops.deviation(v) > 0.0
    if v >= 1e-3:
        assert ops.deviation(v) == pytest.approx(math.sqrt(v), rel=1e-6)
    z = sympy.Symbol("z", real=True)
    slope = sympy.lambdify(z, sympy.diff(Deviation(z), z), [{"Deviation": ops.deviation}, "math"])
    h = 1e-4 * max(abs(v), 1e-6)
    assert slope(v) == pytest.approx((ops.deviation(v + h) - ops.deviation(v - h)) / (2.0 * h), rel=1e-5)


def test_attachment() -> None:
    x = np.linspace(-5.0, 5.0, 20001)
    density = 40.0 * np.exp(-0.5 * (x / 0.3) ** 2) / (0.3 * math.sqrt(2.0 * math.pi))
    for power, ours in enumerate(Gaussian().inflow(GaussianSpread(40.0, 0.3))):
        assert ours == pytest.approx(trapezoid(x**power * density, x), abs=1e-9)


def test_unknown_rate_is_refused() -> None:
    with pytest.raises(TypeError, match="GaussianSpread"):
        # The wrong type is what is tried.
        Gaussian().outflow(Quantities({"q0": 1.0, "q1": 0.0, "q2": 1.0}, "test", None), GaussianSpread(1.0, 1.0))
