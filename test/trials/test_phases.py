"""Phases found in length records: made ones, where the truth is known, and the recordings."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from xb_muscle_ros.trials.phases import detect_phases, initial_isometric
from xb_muscle_ros.trials.trial import Phase

SPEED = 0.4545  # L0/s
TEST = 0.0383  # L0
NAMES = ["isometric", "conditioning_stretch", "shortening", "recovery", "test_stretch", "hold"]


def protocol(
    amplitude: float, recovery_s: float, isometric_s: float = 0.2003
) -> tuple[np.ndarray, np.ndarray, list[float]]:
    """The paper's protocol at 1 kHz; times, lengths in L0, and the times of its corners."""
    ramp_s = amplitude / SPEED
    steps = [0.0, isometric_s, ramp_s, ramp_s, recovery_s, TEST / SPEED, 0.2]
    levels = [1.0, 1.0, 1.0 + amplitude, 1.0, 1.0, 1.0 + TEST, 1.0 + TEST]
    if amplitude == 0.0:
        steps, levels = [0.0, isometric_s, TEST / SPEED, 0.2], [1.0, 1.0, 1.0 + TEST, 1.0 + TEST]
    corners = np.cumsum(steps)
    time_s = np.arange(round(1000 * corners[-1])) / 1000
    return time_s, np.interp(time_s, corners, levels), corners.tolist()


def smoothed(length: np.ndarray, samples: int) -> np.ndarray:
    kernel = np.hanning(samples + 2)[1:-1]
    return np.convolve(np.pad(length, samples, mode="edge"), kernel / kernel.sum(), "same")[samples:-samples]


@pytest.mark.parametrize("amplitude", [0.0038, 0.0121, 0.0383])
@pytest.mark.parametrize("recovery_s", [0.001, 0.01, 0.1, 1.0, 10.0])
@pytest.mark.parametrize(("noise", "smoothing"), [(0.0, 1), (2e-5, 1), (1e-4, 1), (0.0, 9), (1e-4, 9)])
def test_onsets_are_good_to_a_sample(amplitude: float, recovery_s: float, noise: float, smoothing: int) -> None:
    time_s, length, corners = protocol(amplitude, recovery_s)
    length = smoothed(length + noise * np.random.default_rng(1).standard_normal(length.size), smoothing)
    phases = detect_phases(time_s, length, amplitude, recovery_s)
    assert [phase.name for phase in phases] == NAMES
    onsets = {phase.name: phase.start_s for phase in phases}
    assert onsets["conditioning_stretch"] == pytest.approx(corners[1], abs=1e-3)
    assert onsets["test_stretch"] == pytest.approx(corners[4], abs=1e-3)


@pytest.mark.parametrize("recovery_s", [0.001, 0.1, 1.0])
def test_onsets_of_a_clean_record_are_exact(recovery_s: float) -> None:
    time_s, length, corners = protocol(0.0383, recovery_s)
    phases = detect_phases(time_s, length, 0.0383, recovery_s)
    assert [phase.start_s for phase in phases] == pytest.approx(corners[:-1], abs=1e-5)
    assert phases[-1].end_s == time_s[-1]


def test_phases_touch_and_cover_the_record() -> None:
    time_s, length, _ = protocol(0.0121, 0.1)
    phases = detect_phases(time_s + 5.0, length)
    assert phases[0].start_s == 5.0
    assert phases[-1].end_s == 5.0 + time_s[-1]
    assert [phase.end_s for phase in phases[:-1]] == [phase.start_s for phase in phases[1:]]


@pytest.mark.parametrize("scale", [1e-9, 5.7e-4, 1.0, 1300.0])
def test_the_unit_of_length_does_not_matter(scale: float) -> None:
    time_s, length, _ = protocol(0.0383, 0.1)
    onsets = [phase.start_s for phase in detect_phases(time_s, length)]
    assert [phase.start_s for phase in detect_phases(time_s, scale * length)] == pytest.approx(onsets, abs=1e-9)


@pytest.mark.parametrize("smoothing", [1, 9])
def test_the_smallest_stretch_is_placed_where_it_has_to_be(smoothing: int) -> None:
    time_s, length, corners = protocol(0.0012, 0.1)  # 2.6 ms up and 2.6 ms down; smoothing leaves next to nothing
    length = smoothed(length + 1e-4 * np.random.default_rng(2).standard_normal(length.size), smoothing)
    phases = detect_phases(time_s, length, 0.0012, 0.1)
    assert [phase.name for phase in phases] == NAMES
    assert phases[1].start_s == pytest.approx(corners[1], abs=1e-3)
    assert phases[4].start_s == pytest.approx(corners[4], abs=1e-3)


def test_the_reference_trial_has_a_test_stretch_only() -> None:
    time_s, length, corners = protocol(0.0, 0.0)
    phases = detect_phases(time_s, length, 0.0)
    assert [phase.name for phase in phases] == ["isometric", "test_stretch", "hold"]
    assert phases[1].start_s == pytest.approx(corners[1], abs=1e-5)


def test_a_triangle_is_stretch_and_shortening() -> None:
    corners = [0.0, 0.1, 0.25, 0.4, 0.5]
    time_s = np.arange(500) / 1000
    phases = detect_phases(time_s, np.interp(time_s, corners, [1.0, 1.0, 1.064, 1.0, 1.0]))
    assert [phase.name for phase in phases] == ["isometric", "stretch", "shortening", "recovery"]
    assert [phase.start_s for phase in phases] == pytest.approx(corners[:-1], abs=1e-5)


@pytest.mark.parametrize("noise", [0.0, 1e-6, 1e-4, 1e-3])
@pytest.mark.parametrize("samples", [1, 2, 5, 50, 5000])
def test_an_isometric_record_is_isometric(noise: float, samples: int) -> None:
    time_s = np.arange(samples) / 1000
    length = 1.0 + noise * np.random.default_rng(3).standard_normal(samples)
    assert detect_phases(time_s, length) == (Phase("isometric", 0.0, time_s[-1]),)


def test_a_glitch_is_no_ramp() -> None:
    time_s, length, corners = protocol(0.0383, 0.1)
    length[50] += 0.003
    phases = detect_phases(time_s, length)
    assert [phase.name for phase in phases] == NAMES
    assert phases[4].start_s == pytest.approx(corners[4], abs=1e-3)


def test_a_release_and_restretch_is_told() -> None:
    corners = [0.0, 0.5, 0.501, 0.521, 0.522, 2.0]
    time_s = np.arange(5000) / 2500
    length = np.interp(time_s, corners, [1.0, 1.0, 0.8, 0.8, 1.0, 1.0])
    phases = detect_phases(time_s, length + 1e-4 * np.random.default_rng(5).standard_normal(time_s.size))
    assert [phase.name for phase in phases] == ["isometric", "release", "hold", "stretch", "recovery"]
    assert [phase.start_s for phase in phases] == pytest.approx(corners[:-1], abs=8e-4)


def test_a_release_that_stays_is_recovered_from() -> None:
    time_s = np.arange(1000) / 1000
    phases = detect_phases(time_s, np.interp(time_s, [0, 0.5, 0.51, 1.0], [1.0, 1.0, 0.98, 0.98]))
    assert [phase.name for phase in phases] == ["isometric", "release", "recovery"]
    slow = detect_phases(time_s, np.interp(time_s, [0, 0.5, 0.54, 1.0], [1.0, 1.0, 0.98, 0.98]))
    assert [phase.name for phase in slow] == ["isometric", "shortening", "recovery"]


def test_a_step_is_told_from_the_ramp_that_follows() -> None:
    corners = [0.0, 0.5, 0.51, 0.61, 1.0]
    time_s = np.arange(1000) / 1000
    phases = detect_phases(time_s, smoothed(np.interp(time_s, corners, [1.0, 1.0, 0.95, 0.85, 0.85]), 5), l0=1.0)
    assert [phase.name for phase in phases] == ["isometric", "release", "shortening", "recovery"]
    assert [phase.start_s for phase in phases] == pytest.approx(corners[:-1], abs=2e-3)


def test_levels_after_stretch_and_shortening_have_their_names() -> None:
    time_s = np.arange(2000) / 1000
    corners = [0.0, 0.3, 0.4, 0.7, 0.8, 1.1, 1.2, 2.0]
    phases = detect_phases(time_s, np.interp(time_s, corners, [1.0, 1.0, 1.1, 1.1, 1.05, 1.05, 1.0, 1.0]))
    names = ["isometric", "stretch", "hold", "shortening", "recovery", "shortening", "recovery"]
    assert [phase.name for phase in phases] == names


GIVE = {"time": [0.3, 0.32, 0.4, 0.41, 0.43, 0.46], "length": [0.0, -0.012, 0.0, 0.0, 0.02, 0.0]}


def test_a_motor_that_gives_makes_no_ramps() -> None:
    time_s = np.arange(1000) / 1000
    give = np.interp(time_s, GIVE["time"], GIVE["length"])
    assert len(detect_phases(time_s, 1.0 + give)) > 1
    assert detect_phases(time_s, 1.0 + give, servo_give=0.03) == (Phase("isometric", 0.0, 0.999),)


def test_a_release_smaller_than_the_give_is_seen_as_it_stays() -> None:
    time_s = np.arange(1000) / 1000
    length = 1.0 + np.interp(time_s, GIVE["time"], GIVE["length"]) + np.interp(time_s, [0.7, 0.71], [0.0, -0.015])
    phases = detect_phases(time_s, length, servo_give=0.03)
    assert [phase.name for phase in phases] == ["isometric", "release", "recovery"]
    assert phases[1].start_s == pytest.approx(0.7, abs=2e-3)


def test_a_ramp_that_falters_by_the_give_is_one_ramp() -> None:
    time_s = np.arange(1000) / 1000
    ramp = np.interp(time_s, [0.0, 0.2, 0.5, 0.53, 0.8, 1.0], [1.0, 1.0, 0.9, 0.9, 0.8, 0.8])
    names = [phase.name for phase in detect_phases(time_s, ramp, servo_give=0.012)]
    assert names == ["isometric", "shortening", "recovery"]
    apart = [phase.name for phase in detect_phases(time_s, ramp)]
    assert apart == ["isometric", "shortening", "recovery", "shortening", "recovery"]


def test_a_record_that_ends_as_the_motor_sets_off_has_no_ramp_there() -> None:
    time_s, length, _ = protocol(0.0383, 0.1)
    length[-4:] += [0.005, 0.012, 0.02, 0.028]
    phases = detect_phases(time_s, length)
    assert [phase.name for phase in phases] == NAMES
    assert phases[-1].end_s == time_s[-1]


def test_initial_isometric_keeps_away_from_the_stretch() -> None:
    time_s = np.arange(100) / 1000
    phases = (Phase("isometric", 0.0, 0.05), Phase("test_stretch", 0.05, 0.099))
    assert initial_isometric(time_s, phases) == slice(0, 41)  # 0 to 40 ms, that is four fifths
    assert initial_isometric(time_s, phases[1:]) == slice(0, 0)
    assert initial_isometric(time_s, (Phase("isometric", 0.0, 0.099),)) == slice(0, 100)


@pytest.mark.parametrize("pca", ["45", "61", "63", "66", "90"])
def test_the_recorded_protocol_is_found(shared_data: Path, pca: str) -> None:
    file = shared_data / "recordings" / "rat_soleus_18Dec2017a" / f"amp383_rt1ms_pca{pca}.csv"
    time_s, length, _ = np.loadtxt(file, delimiter=",", skiprows=1).T
    phases = detect_phases(time_s, length, 0.0383, 0.001)
    assert [phase.name for phase in phases] == NAMES
    # Read off plots of the records: stretch from 0.100 s, peak at 0.1855 s, trough at 0.271 s, end at 0.3555 s.
    expected = [0.0, 0.1, 0.1855, 0.2705, 0.2715, 0.3555]
    assert [phase.start_s for phase in phases] == pytest.approx(expected, abs=1e-3)
    test = phases[4]
    assert test.end_s - test.start_s == pytest.approx(TEST / SPEED, abs=1e-3)


@pytest.mark.parametrize(
    ("name", "ramps", "starts_s"),
    [
        (
            "triangle1_pca45",
            ["isometric", "stretch", "shortening", "stretch", "shortening"],
            [0, 0.049, 0.2, 0.349, 0.5],
        ),
        (
            "triangle4_pca90",
            ["isometric", "stretch", "shortening", "stretch", "shortening"],
            [0, 0.049, 0.2, 0.349, 0.5],
        ),
        ("triangle5_pca90", ["stretch", "shortening"], [0, 0.15]),
        ("triangle6_pca66", ["isometric", "stretch", "shortening"], [0, 0.199, 0.35]),
    ],
)
def test_the_recorded_triangles_are_found(
    shared_data: Path, name: str, ramps: list[str], starts_s: list[float]
) -> None:
    file = shared_data / "recordings" / "rat_soleus_18Dec2017a" / f"{name}.csv"
    time_s, length, _ = np.loadtxt(file, delimiter=",", skiprows=1).T
    phases = detect_phases(time_s, length)
    assert [phase.name for phase in phases] == ramps
    assert [phase.start_s for phase in phases] == pytest.approx(starts_s, abs=1.2e-3)


# Corners where the length change of the record starts and stops, read off plots; 100 Hz.
CAT = {"fig5_trial37": (2.34, 5.29), "fig6and7A_trial45": (4.25, 5.21), "fig7C_trial63": (2.48, 2.70)}


@pytest.mark.parametrize("name", list(CAT))
def test_ramps_of_the_cat_are_found(shared_data: Path, name: str) -> None:
    file = shared_data / "recordings" / "cat_soleus_herzog_leonard_2002" / f"{name}.csv"
    time_s, change_mm, _ = np.loadtxt(file, delimiter=",", skiprows=1).T
    phases = detect_phases(time_s, 42.8 + change_mm)
    assert [phase.name for phase in phases] == ["isometric", "test_stretch", "hold"]
    assert (phases[1].start_s, phases[1].end_s) == pytest.approx(CAT[name], abs=0.01)
