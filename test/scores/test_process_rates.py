"""Rates put into made moduli come out, with intervals that hold them, and no process is invented."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from xb_muscle_ros.scores.estimate import Missing
from xb_muscle_ros.scores.process_rates import Processes, fit_processes

FREQUENCY_HZ = np.geomspace(0.1, 250.0, 30)
# H, then signed magnitudes and rates, as of a fast fibre.
THREE = (12.0, ((20.0, 6.0), (-45.0, 80.0), (60.0, 600.0)))
TWO = (15.0, ((-12.0, 15.0), (30.0, 90.0)))
ONE = (0.2, ((33.0, 7.5),))
Put = tuple[float, tuple[tuple[float, float], ...]]


def modulus(put: Put, frequency: np.ndarray = FREQUENCY_HZ) -> np.ndarray:
    """By Laplace's transform of the answer to a step: H + sum of magnitude · s/(s + rate) at s = i 2π f."""
    s = 2j * np.pi * frequency
    return put[0] + sum(size * s / (s + rate) for size, rate in put[1])


@pytest.mark.parametrize(("put", "names"), [(ONE, "C"), (TWO, "BC"), (THREE, "ABC")])
def test_rates_and_magnitudes_come_out(put: Put, names: str) -> None:
    found = fit_processes(FREQUENCY_HZ, modulus(put))
    assert isinstance(found, Processes)
    assert "".join(process.name for process in found.processes) == names
    assert found.base == pytest.approx(put[0], rel=1e-4)
    for process, (size, rate) in zip(found.processes, put[1], strict=True):
        assert process.rate_per_s == pytest.approx(rate, rel=1e-4)
        assert process.magnitude == pytest.approx(abs(size), rel=1e-4)
    assert found.at(FREQUENCY_HZ) == pytest.approx(modulus(put), rel=1e-4)


@pytest.mark.parametrize("known", [True, False])
def test_intervals_hold_the_rates_as_often_as_they_say(known: bool) -> None:
    rng = np.random.default_rng(11)
    held, all_of_them, counts = 0, 0, []
    se = np.full(FREQUENCY_HZ.size, 0.4 + 0.4j) if known else None
    for _ in range(40):
        noise = 0.4 * (rng.standard_normal(30) + 1j * rng.standard_normal(30))
        found = fit_processes(FREQUENCY_HZ, modulus(THREE) + noise, se)
        assert isinstance(found, Processes)
        counts.append(len(found.processes))
        if counts[-1] < 3:
            continue
        for process, (_, rate) in zip(found.processes, THREE[1], strict=True):
            held += abs(math.log(process.rate_per_s / rate)) <= found.width * process.rate_log_se
            all_of_them += 1
    assert np.mean(np.array(counts) == 3) > 0.9
    # 95 % of some 120: within 4 standard deviations of their count.
    assert held / all_of_them >= 0.95 - 0.08


def test_no_process_is_made_of_noise() -> None:
    rng = np.random.default_rng(7)
    for put in (ONE, TWO):
        counts = []
        for _ in range(25):
            found = fit_processes(FREQUENCY_HZ, modulus(put) + 0.4 * rng.standard_normal((30, 2)) @ np.array([1, 1j]))
            assert isinstance(found, Processes)
            counts.append(len(found.processes))
        assert np.mean(np.array(counts) > len(put[1])) <= 0.05


@settings(deadline=None, max_examples=15)
@given(st.floats(2.0, 500.0), st.floats(1.0, 100.0), st.floats(0.0, 20.0))
def test_one_process_is_one(rate: float, size: float, base: float) -> None:
    found = fit_processes(FREQUENCY_HZ, modulus((base, ((size, rate),))))
    assert isinstance(found, Processes)
    assert [process.name for process in found.processes] == ["C"]
    assert found.processes[0].rate_per_s == pytest.approx(rate, rel=1e-4)
    assert "less than 0.5 %" in found.why


@pytest.mark.parametrize(
    ("frequency", "values", "why"),
    [
        (FREQUENCY_HZ[:2], modulus(ONE)[:2], "at 2 frequencies; 3 are needed"),
        (FREQUENCY_HZ, np.full(30, 3.0 + 0.0j), "a spring of 3 F0/L0 leaves"),
        (FREQUENCY_HZ, modulus((1.0, ((30.0, 2e5),))), "outside those measured"),
    ],
)
def test_what_has_no_process_is_told(frequency: np.ndarray, values: np.ndarray, why: str) -> None:
    found = fit_processes(frequency, values)
    assert isinstance(found, Missing)
    assert why in found.why


def test_few_frequencies_give_few_processes() -> None:
    chosen = FREQUENCY_HZ[::8]
    found = fit_processes(chosen, modulus(THREE, chosen))
    assert not isinstance(found, Processes) or "frequencies" in found.why
