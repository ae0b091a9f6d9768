"""Complex stiffness of made records, and its standard errors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from xb_muscle_ros.protocols.base import settings_of
from xb_muscle_ros.protocols.registry import PROTOCOLS
from xb_muscle_ros.scores.complex_stiffness import ComplexStiffness, Trace, complex_stiffness
from xb_muscle_ros.scores.estimate import Missing
from xb_muscle_ros.scores.standard_error import force_noise

TIME_S = np.arange(3001) * 1e-3


def made(frequency: float, elastic: float, viscous: float, second: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    angle = 2.0 * np.pi * frequency * TIME_S + 0.7
    length = 0.02 + 0.00125 * np.sin(angle)
    force = 0.5 + 0.03 * TIME_S + 0.00125 * (elastic * np.sin(angle) + viscous * np.cos(angle))
    return length, force + 0.00125 * second * abs(complex(elastic, viscous)) * np.sin(2.0 * angle)


@given(st.floats(0.4, 100.0), st.floats(-50.0, 50.0), st.floats(-50.0, 50.0), st.floats(0.0, 0.3))
def test_a_spring_and_a_dashpot_beside_drift_come_out(f: float, elastic: float, viscous: float, second: float) -> None:
    size = abs(complex(elastic, viscous))
    length, force = made(f, elastic, viscous, second)
    found = complex_stiffness(Trace(TIME_S, length), Trace(TIME_S, force), f)
    assert isinstance(found, ComplexStiffness)
    assert found.value == pytest.approx(complex(elastic, viscous), abs=1e-7 * (1.0 + size))
    assert found.amplitude_l0 == pytest.approx(0.00125)
    if size > 1.0:
        assert found.second == pytest.approx(second, abs=1e-5)
        turned = np.exp(1j * np.radians(found.phase_deg.value))
        assert found.magnitude.value * turned == pytest.approx(complex(elastic, viscous), abs=1e-6 * size)


@pytest.mark.parametrize(("rate", "late"), [(1000.0, 5e-4), (1000.0, 0.0), (500.0, 1.3e-4), (2000.0, 1e-4)])
@pytest.mark.parametrize("frequency", [2.0, 100.0])
def test_length_and_force_have_times_of_their_own(frequency: float, rate: float, late: float) -> None:
    """Regression: length was read between its samples, which took up to a fifth of its amplitude."""
    length_s = np.arange(int(1.5 * rate)) / rate
    force_s = np.arange(0, 1400) * 1e-3 + late

    def at(t: np.ndarray, sine: float, cosine: float) -> np.ndarray:
        angle = 2.0 * np.pi * frequency * t
        return 0.002 * (sine * np.sin(angle) + cosine * np.cos(angle))

    force = 0.8 + at(force_s, 20.0, 8.0) + 1e-6 * np.random.default_rng(1).standard_normal(force_s.size)
    found = complex_stiffness(Trace(length_s, at(length_s, 1.0, 0.0)), Trace(force_s, force), frequency, measured=True)
    assert isinstance(found, ComplexStiffness)
    assert found.value == pytest.approx(20.0 + 8.0j, abs=1e-3)
    assert found.from_scatter is (frequency == 100.0)
    if found.from_scatter:
        assert abs(found.elastic.value - 20.0) < 4.0 * found.elastic.se < 1e-3


def test_too_little_is_told() -> None:
    length, force = made(0.2, 10.0, 5.0)
    whole = Trace(TIME_S, length)
    for length_, frequency, why in (
        (whole, 0.2, "0.60 of a cycle"),
        (whole, 400.0, "2.5 samples of force for each cycle"),
        (Trace(TIME_S[::50], length[::50]), 10.0, "2 samples of length for each cycle"),
        (Trace(TIME_S[:1], length[:1]), 10.0, "there is no stiffness in 1 sample of length"),
    ):
        found = complex_stiffness(length_, Trace(TIME_S, force), frequency)
        assert isinstance(found, Missing)
        assert why in found.why
    assert isinstance(complex_stiffness(Trace(TIME_S, 0.0 * length), Trace(TIME_S, force), 2.0), Missing)


@pytest.mark.parametrize(
    ("slow", "cycles", "quiet"), [(0.0, 10, True), (0.95, 10, True), (0.0, 4, False), (0.0, 3, True), (0.95, 3, True)]
)
def test_standard_errors_are_those_of_repeated_noise(slow: float, cycles: int, quiet: bool) -> None:
    """White and slow noise: from the scatter among cycles, and from the quiet time, which tells rather too much."""
    protocol = PROTOCOLS["sinusoid"]
    options = {"pca": 4.5, "frequency": 10.0, "cycles": float(cycles)}
    trial = protocol.plan("made", settings_of(protocol, options))[0].trial
    phases = trial.phases_by_name()
    inside = trial.time_s >= phases["oscillation"].start_s - 1e-9
    angle = 2.0 * np.pi * 10.0 * (trial.time_s - phases["onset"].start_s)
    clean = 0.5 + 0.00125 * (30.0 * np.sin(angle) + 10.0 * np.cos(angle))
    rng = np.random.default_rng(3)
    values, told = [], []
    for _ in range(60):
        noise = rng.standard_normal(trial.time_s.size + 200)
        for k in range(1, noise.size if slow else 0):
            noise[k] = slow * noise[k - 1] + np.sqrt(1.0 - slow**2) * noise[k]
        force = clean + 0.002 * noise[200:]
        still = trial.time_s < phases["isometric"].end_s
        force[still] += 0.5 - clean[still]
        recorded = replace(trial, force_time_s=trial.time_s, force_n=force)
        known = force_noise(recorded) if quiet else None
        length = Trace(trial.time_s[inside], trial.length_change_l0[inside])
        found = complex_stiffness(length, Trace(trial.time_s[inside], force[inside]), 10.0, known, measured=True)
        assert isinstance(found, ComplexStiffness)
        assert found.from_scatter is (cycles > 3)
        values.append([found.elastic.value, found.viscous.value, found.magnitude.value, found.phase_deg.value])
        told.append([found.elastic.se, found.viscous.se, found.magnitude.se, found.phase_deg.se])
    scatter = np.std(np.array(values, dtype=float), axis=0)
    ratio = np.sqrt(np.mean(np.array(told, dtype=float) ** 2, axis=0)) / scatter
    assert np.all(ratio > 0.7)
    if cycles > 3:
        # Slow noise is in the scatter of single cycles more than in the fit through all.
        assert np.all(ratio < (1.9 if slow else 1.35))
