"""Work of made loops, its sign, and its standard errors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import xb_muscle_ros as xb
from xb_muscle_ros.scores.estimate import Estimate
from xb_muscle_ros.scores.standard_error import force_noise
from xb_muscle_ros.scores.work_loop import Work, repeats_from, work_of
from xb_muscle_ros.trials.trial import Trial

TIME_S = np.arange(20_001) * 1e-4


@settings(deadline=None)
@given(
    st.floats(1.0, 20.0), st.floats(0.001, 0.1), st.floats(0.0, 1.0), st.floats(-3.1, 3.1), st.floats(0.0, 6.2),
    st.floats(0.0, 0.4),
)  # fmt: skip
def test_the_area_of_an_ellipse(
    frequency: float, amplitude: float, force: float, ahead: float, angle: float, begin: float
) -> None:
    """-π ΔL F sin φ where force is ahead of length by φ: such a force resists, and takes work."""
    length = amplitude * np.sin(2.0 * np.pi * frequency * TIME_S + angle)
    made = 0.5 + force * np.sin(2.0 * np.pi * frequency * TIME_S + angle + ahead)
    found = work_of(TIME_S, length, made, begin, begin + 1.0 / frequency)
    assert found.net.value == pytest.approx(-np.pi * amplitude * force * np.sin(ahead), abs=5e-4 * amplitude)
    assert found.net.value == pytest.approx((found.shortening.value or 0.0) + (found.lengthening.value or 0.0))
    assert found.excursion_l0 == pytest.approx(2.0 * amplitude, rel=1e-3)
    assert found.left_l0 == pytest.approx(0.0, abs=1e-4 * amplitude)
    assert found.mean_f0 == pytest.approx(0.5, abs=1e-3)


def test_shortening_at_high_force_and_lengthening_at_low_is_positive_and_counter_clockwise() -> None:
    length, force = np.array([0.0, -0.1, -0.1, 0.0, 0.0]), np.array([1.0, 1.0, 0.2, 0.2, 1.0])
    time = np.arange(5.0)
    found = work_of(time, length, force, 0.0, 4.0)
    assert [found.shortening.value, found.lengthening.value] == pytest.approx([0.1, -0.02])
    area = 0.5 * np.sum(length[:-1] * force[1:] - length[1:] * force[:-1])  # counter-clockwise is positive
    assert found.net.value == pytest.approx(area)
    assert found.net.value == pytest.approx(0.08)
    assert found.peak_f0 == (1.0, None, "")
    assert found.net.se is None


def test_a_part_between_samples() -> None:
    found = work_of(np.arange(3.0), np.array([0.0, 1.0, 2.0]), np.array([1.0, 1.0, 3.0]), 0.5, 1.5)
    # Force 1 over half a step, then from 1 to 2.
    assert found.net.value == pytest.approx(-(0.5 + 0.75))
    assert found.left_l0 == pytest.approx(1.0)


def test_standard_errors_are_those_of_repeated_noise() -> None:
    time = np.arange(3001) * 1e-3
    length = np.where(time < 2.0, 0.0, 0.05 * np.sin(2.0 * np.pi * (time - 2.0)))
    rng = np.random.default_rng(4)
    phases = (xb.Phase("isometric", 0.0, 2.0), xb.Phase("cycles", 2.0, 3.0))
    trial = Trial(xb.TrialFacts("made", "loop", phases=phases), time, 1.0 + length, np.zeros(1), np.ones(1))
    values, told = [], []
    for _ in range(60):
        force = 0.5 + 0.01 * rng.standard_normal(time.size)
        noise = force_noise(replace(trial, force_time_s=time, force_n=force))
        found = work_of(time, length, force, 2.0, 3.0, noise)
        values.append([found.net.value, found.shortening.value])
        told.append([found.net.se, found.shortening.se])
    ratio = np.sqrt(np.mean(np.array(told, dtype=float) ** 2, axis=0)) / np.std(np.array(values, dtype=float), axis=0)
    assert np.all(ratio > 0.7)
    assert np.all(ratio < 2.5)  # a little quiet time leaves slow noise possible


def test_the_largest_force_is_not_that_of_the_noise() -> None:
    """Regression: the largest of a thousand samples lies above force by three standard deviations of its noise."""
    time = np.arange(3001) * 1e-3
    length = np.where(time < 2.0, 0.0, 0.05 * np.sin(2.0 * np.pi * (time - 2.0)))
    clean = 0.5 + np.where(time < 2.0, 0.0, 0.3 * np.sin(2.0 * np.pi * (time - 2.0)))
    rng = np.random.default_rng(5)
    phases = (xb.Phase("isometric", 0.0, 2.0), xb.Phase("cycles", 2.0, 3.0))
    trial = Trial(xb.TrialFacts("made", "loop", phases=phases), time, 1.0 + length, np.zeros(1), np.ones(1))
    off, told = [], []
    for _ in range(20):
        force = clean + 0.02 * rng.standard_normal(time.size)
        held = replace(trial, force_time_s=time, force_n=np.where(time < 2.0, force, clean))
        peak = work_of(time, length, force, 2.0, 3.0, force_noise(held)).peak_f0
        assert peak.value is not None
        assert peak.se is not None
        off.append(peak.value - 0.8)
        told.append(peak.se)
    assert abs(np.mean(off)) < 0.006
    assert 0.5 < np.mean(told) / np.std(off) < 3.0


@pytest.mark.parametrize(
    ("nets", "cycle"), [([1.0, 1.0, 1.0], 1), ([2.0, 1.001, 1.0], 2), ([3.0, 2.0, 1.0], None), ([1.0, 2.0, 1.0], None)]
)
def test_the_cycle_from_which_loops_repeat(nets: list[float], cycle: int | None) -> None:
    works = [Work(Estimate(net), Estimate(net + 0.5), Estimate(-0.5), Estimate(1.0), 0.5, 0.1, 0.0) for net in nets]
    assert repeats_from(works, 0.01) == cycle
