"""Cycles, and stretches of one frequency, found from length."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from xb_muscle_ros.scores.cycles import oscillations, rises

TIME_S = np.arange(4001) * 1e-3


@settings(deadline=None, max_examples=50)
@given(st.floats(1.0, 50.0), st.floats(0.0, 6.28), st.floats(-0.1, 0.1), st.floats(0.0, 0.03), st.integers(0, 99))
def test_the_frequency_of_a_noisy_sinusoid_is_found(
    frequency: float, angle: float, middle: float, noise: float, seed: int
) -> None:
    scatter = noise * np.random.default_rng(seed).standard_normal(TIME_S.size)
    length = middle + 0.01 * (np.sin(2.0 * np.pi * frequency * TIME_S + angle) + scatter)
    (found,) = oscillations(TIME_S, length)
    assert found.frequency_hz == pytest.approx(frequency, rel=1e-3 if noise else 1e-6)
    assert 4.0 * frequency - 3.0 <= found.cycles <= 4.0 * frequency
    assert np.diff(found.start_s) == pytest.approx(1.0 / frequency, abs=0.02 / frequency + 2e-3)


def test_several_frequencies_in_one_record_are_told_apart() -> None:
    frequencies, begins = (2.0, 5.0, 20.0), (0.5, 2.0, 3.0)
    length = np.zeros(TIME_S.size)
    for frequency, begin, end in zip(frequencies, begins, (2.0, 3.0, 4.0), strict=True):
        inside = (begin <= TIME_S) & (end > TIME_S)
        length[inside] = 0.002 * np.sin(2.0 * np.pi * frequency * (TIME_S[inside] - begin))
    found = oscillations(TIME_S, length)
    assert [one.frequency_hz for one in found] == pytest.approx(frequencies, rel=1e-3)
    for one, begin in zip(found, begins, strict=True):
        assert begin - 1e-3 <= one.start_s[0] <= begin + 1.01 / one.frequency_hz


def test_the_first_and_the_last_cycle_between_still_lengths_count() -> None:
    inside = (TIME_S > 1.0) & (TIME_S < 2.5)
    length = np.where(inside, 0.01 * np.sin(2.0 * np.pi * 4.0 * (TIME_S - 1.0)), 0.0)
    (found,) = oscillations(TIME_S, length)
    assert found.start_s == pytest.approx(1.0 + 0.25 * np.arange(7), abs=1e-3)
    assert found.frequency_hz == pytest.approx(4.0, rel=1e-3)


@pytest.mark.parametrize("noise", [0.0, 0.01])
@pytest.mark.parametrize("frequency", [4.0, 21.3])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_two_cycles_between_still_lengths_are_found(frequency: float, sign: float, noise: float) -> None:
    """Regression: length rises once from a shortest to a longest length, and no cycle was found."""
    inside = (TIME_S > 1.0) & (1.0 + 2.0 / frequency > TIME_S)
    scatter = noise * np.random.default_rng(5).standard_normal(TIME_S.size)
    length = 0.01 * (np.where(inside, sign * np.sin(2.0 * np.pi * frequency * (TIME_S - 1.0)), 0.0) + scatter)
    ((start_s, seen),) = oscillations(TIME_S, length)
    assert seen == pytest.approx(frequency, rel=0.01)
    assert start_s == pytest.approx(1.0 + np.arange(3) / frequency, abs=0.01 / frequency + 1e-3)


def test_two_stretches_are_no_cycles() -> None:
    length = np.interp(TIME_S, [0.0, 1.0, 1.1, 1.2, 1.3, 1.4, 1.5, 1.6], [0, 0, 0.04, 0, 0, 0.04, 0.01, 0])
    assert oscillations(TIME_S, length) == []


def test_a_cycle_of_twice_the_frequency_is_none_of_the_slower_ones() -> None:
    faster = TIME_S >= 2.0
    length = 0.01 * np.sin(2.0 * np.pi * np.where(faster, 4.0, 2.0) * TIME_S)
    slow, fast = oscillations(TIME_S, length)
    assert slow.frequency_hz == pytest.approx(2.0, rel=1e-3)
    assert slow.start_s[-1] == pytest.approx(2.0, abs=1e-3)
    assert fast.frequency_hz == pytest.approx(4.0, rel=1e-3)


def test_a_still_length_and_a_ramp_have_no_cycles() -> None:
    for length in (np.zeros(TIME_S.size), np.linspace(0.0, 0.1, TIME_S.size), np.empty(0)):
        assert oscillations(TIME_S[: length.size], length) == []


def test_rises_are_half_way_up() -> None:
    times, by = rises(TIME_S, 0.3 - 0.05 * np.cos(2.0 * np.pi * TIME_S))
    assert times == pytest.approx([1.25, 2.25, 3.25], abs=1e-6)
    assert by == pytest.approx([0.1] * 3, abs=1e-6)
