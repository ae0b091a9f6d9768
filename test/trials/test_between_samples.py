"""Corners of length between coarse samples: made protocols, where they are known, and the recordings."""

from __future__ import annotations

import importlib.util
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from xb_muscle_ros.models.fibre_file import load_fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.simulation.offline import simulate_trial
from xb_muscle_ros.trials.bags import write_trial
from xb_muscle_ros.trials.between_samples import AFTER_S, FINE_S, STRAIGHT_L0, refined, with_corners
from xb_muscle_ros.trials.completing import Known
from xb_muscle_ros.trials.protocol import StretchShortenStretch
from xb_muscle_ros.trials.study import read_study
from xb_muscle_ros.trials.trial import Trial

# Between corners, steps: enough for a line on each side.
PAUSES = st.lists(st.floats(4.5, 15.0), min_size=3, max_size=7)
SPEEDS = st.lists(st.floats(0.05, 1.0), min_size=7, max_size=7)


def protocol(
    step_s: float, offset: float, pauses: list[float], speeds: list[float]
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Samples of a protocol that stands, rises, stands, falls and so on; times and lengths of samples and corners."""
    corner_s = np.cumsum([0.0, *pauses]) * step_s
    slopes = [0.0 if i % 2 == 0 else speeds[i] * (1.0 if i % 4 == 1 else -1.0) for i in range(len(pauses))]
    corner_l0 = np.cumsum([0.0, *(slope * pause * step_s for slope, pause in zip(slopes, pauses, strict=True))])
    time_s = (offset + np.arange(int(sum(pauses) - offset) + 1)) * step_s
    return time_s, np.interp(time_s, corner_s, corner_l0), corner_s, corner_l0


@given(st.floats(2.6e-3, 1.2e-2), st.floats(0.0, 0.99), PAUSES, SPEEDS)
def test_corners_come_back_wherever_they_lie(
    step_s: float, offset: float, pauses: list[float], speeds: list[float]
) -> None:
    time_s, length, corner_s, corner_l0 = protocol(step_s, offset, pauses, speeds)
    found = refined(time_s, length)
    slopes = np.diff(corner_l0) / np.diff(corner_s)
    # A bend that cut off in the middle of a step would cost little is none.
    assert found.corners >= sum(0.25 * abs(b - a) * step_s > 1e-4 for a, b in pairwise(slopes))
    if found.corners:
        truth = np.interp(found.time_s, corner_s, corner_l0)
        # A corner nearer to a sample than the tolerance is taken to be at the sample.
        assert np.max(np.abs(found.length_l0 - truth)) <= 3.5 * STRAIGHT_L0 + 1e-9
        assert np.all(np.isin(time_s, found.time_s))
        assert np.array_equal(found.length_l0[np.searchsorted(found.time_s, time_s)], length)
        for corner, before, behind in zip(corner_s[1:-1], slopes[:-1], slopes[1:], strict=True):
            if 0.25 * abs(behind - before) * step_s > 1e-4:
                after = found.time_s[(found.time_s >= corner) & (found.time_s <= corner + AFTER_S)]
                assert np.all(np.diff(after) <= FINE_S + 1e-9)
        again = refined(found.time_s, found.length_l0)
        assert np.array_equal(again.time_s, found.time_s)


@given(st.integers(0, 10_000), st.floats(2e-6, 3e-5))
def test_noise_moves_corners_no_further_than_it_is_large(seed: int, noise: float) -> None:
    random = np.random.default_rng(seed)
    step_s, pauses = 0.006, [12.4, 14.3, 14.1, 16.7, 14.0, 12.0]
    time_s, length, corner_s, corner_l0 = protocol(step_s, float(random.uniform()), pauses, [0.4545] * 7)
    noisy = length + noise * random.standard_normal(length.size)
    found = refined(time_s, noisy)
    if found.corners:
        truth = np.interp(found.time_s, corner_s, corner_l0)
        assert np.max(np.abs(found.length_l0 - truth)) < max(6.0 * noise, 1e-4)


@given(st.floats(3e-3, 2e-2), st.floats(0.2, 8.0), st.floats(1e-3, 0.1))
def test_bends_are_no_corners(step_s: float, frequency_hz: float, size_l0: float) -> None:
    time_s = np.arange(200) * step_s
    for length in (size_l0 * np.sin(2.0 * np.pi * frequency_hz * time_s), size_l0 * time_s**2):
        assert refined(time_s, length).corners == 0


def test_rounded_corners_noise_and_fine_samples_stay_as_they_are() -> None:
    fine_s = np.arange(0.0, 0.5, 1e-3)
    sharp = np.interp(fine_s, [0.0, 0.1, 0.2, 0.5], [0.0, 0.0, 0.0455, 0.0455])
    kernel = np.hanning(31)[1:-1]
    rounded = np.convolve(np.pad(sharp, 15, mode="edge"), kernel / kernel.sum(), "same")[15:-15]
    assert refined(fine_s[::6], rounded[::6]).corners == 0
    assert refined(fine_s[::6], sharp[::6]).corners == 2
    assert refined(fine_s, sharp).corners == 0
    noisy = sharp[::6] + 1e-3 * np.random.default_rng(0).standard_normal(fine_s[::6].size)
    assert refined(fine_s[::6], noisy).corners == 0
    assert refined(fine_s[:4:2], sharp[:4:2]).corners == 0


def test_a_pause_between_two_samples_is_that_of_the_phases() -> None:
    """1 ms between shortening and test stretch, of which samples 6 ms apart show nothing."""
    exact = StretchShortenStretch(0.0383, 0.001).trial("f", 6.1, 10_000.0)
    for offset in (10, 25, 50):
        coarse = replace(exact, time_s=exact.time_s[offset::60], length_m=exact.length_m[offset::60])
        found = with_corners(coarse)
        truth = np.interp(found.time_s, exact.time_s, exact.length_m)
        assert np.max(np.abs(found.length_m - truth)) < 5e-5


@pytest.fixture(scope="module")
def coarse() -> Trial:
    """The paper's protocol with samples 6 ms apart, begun in the middle of a step."""
    exact = StretchShortenStretch(0.0383, 0.1, lead_s=0.084).trial("14Dec2017b", 6.1, 1000.0)
    return replace(
        exact,
        time_s=exact.time_s[2::6],
        length_m=exact.length_m[2::6],
        force_time_s=exact.time_s[2::6],
        force_n=np.full(exact.time_s[2::6].size, 0.5) + 1e-3 * np.arange(exact.time_s[2::6].size) % 3e-3,
    )


def test_forces_are_those_of_the_exact_protocol(coarse: Trial) -> None:
    muscle = Muscle(load_fibre("14Dec2017b", "3state_coop"))
    exact = StretchShortenStretch(0.0383, 0.1, lead_s=0.084).trial("14Dec2017b", 6.1, 10_000.0)
    truth = np.interp(coarse.time_s, exact.time_s, simulate_trial(muscle, exact).force_n)
    finer = with_corners(coarse)
    found = np.interp(coarse.time_s, finer.time_s, simulate_trial(muscle, finer).force_n)
    cut = simulate_trial(muscle, coarse).force_n
    assert np.max(np.abs(found - truth)) < 1e-4
    assert np.max(np.abs(cut - truth)) > 3e-3
    assert finer.force_time_s.tolist() == coarse.force_time_s.tolist()


def test_reading_puts_corners_back_and_says_so(coarse: Trial, tmp_path: Path) -> None:
    write_trial(tmp_path / "bag", coarse)
    study = read_study([tmp_path / "bag"], "14Dec2017b", Known())
    assert study.notes == ["corners of length between samples were recovered (1 trial)"]
    (trial,) = study.trials
    assert trial.time_s.size > coarse.time_s.size
    assert np.array_equal(trial.force_time_s, coarse.force_time_s)


def test_recordings_of_the_rat_fibres_have_the_servos_ramps(shared_data: Path, tmp_path: Path, repo_root: Path) -> None:
    """Stretch 85.9, return 84.7 and test stretch 84.0 ms; the pause is nominal, 100 ms (the data's README)."""
    spec = importlib.util.spec_from_file_location("import_rat_fibres", repo_root / "scripts" / "import_rat_fibres.py")
    assert spec is not None
    assert spec.loader is not None
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    bags = dict(script.import_fibres(shared_data / "recordings" / "rat_soleus_fibres", tmp_path, ["13Dec2017a"]))
    assert bags == {"13Dec2017a": 6}
    study = read_study([tmp_path / "13Dec2017a"], "13Dec2017a", Known())
    assert study.notes == ["corners of length between samples were recovered (6 trials)"]
    for trial in study.trials:
        assert trial.facts.fibre == "13Dec2017a"
        assert trial.facts.pca in (4.5, 6.3, 6.4)
        if trial.facts.amplitude_l0 == 0.0383:
            speeds = np.diff(trial.length_change_l0) / np.diff(trial.time_s)
            edges = trial.time_s[1:-1][np.abs(np.diff(speeds)) > 0.05]
            assert np.diff(edges) == pytest.approx([0.0859, 0.0847, 0.1, 0.084], abs=2e-4)
    with pytest.raises(script.UserError, match="has no fibre 'x'; there are 13Dec2017a, 14Dec2017b"):
        next(script.import_fibres(shared_data / "recordings" / "rat_soleus_fibres", tmp_path, ["x"]))
    with pytest.raises(script.UserError, match="has no folder of CSV files"):
        next(script.import_fibres(tmp_path / "none", tmp_path))
