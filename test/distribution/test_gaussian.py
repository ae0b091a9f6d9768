"""Moments of detachment against numerical integrals over strain."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad, trapezoid

from xb_muscle_ros.distribution.gaussian import Gaussian
from xb_muscle_ros.mechanisms.base import ExponentialRate, GaussianSpread, Quantities


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


def test_attachment() -> None:
    x = np.linspace(-5.0, 5.0, 20001)
    density = 40.0 * np.exp(-0.5 * (x / 0.3) ** 2) / (0.3 * math.sqrt(2.0 * math.pi))
    for power, ours in enumerate(Gaussian().inflow(GaussianSpread(40.0, 0.3))):
        assert ours == pytest.approx(trapezoid(x**power * density, x), abs=1e-9)


def test_unknown_rate_is_refused() -> None:
    with pytest.raises(TypeError, match="GaussianSpread"):
        Gaussian().outflow(Quantities({"q0": 1.0, "q1": 0.0, "q2": 1.0}, "test", None), GaussianSpread(1.0, 1.0))  # type: ignore[arg-type]
