"""Noise from isometric windows: size, colour, what is not known of them, and draws."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import lfilter

from xb_muscle_ros.diagnose.noise_model import NoiseModel, Window, isometric_window, noise_model
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.fit.noise import sample_autocovariance
from xb_muscle_ros.replay.made import coloured_noise
from xb_muscle_ros.trials.protocol import StretchShortenStretch
from xb_muscle_ros.trials.trial import Phase, Trial

Array = npt.NDArray[np.float64]
SDS = (1.4e-3, 7e-4, 5e-4, 3e-4, 4e-4)


def hum(random: np.random.Generator, n: int) -> Array:
    """60 Hz at 1 kHz that lasts for some 30 ms, of unit size, and slower noise of the same size."""
    turn = 2.0 * np.pi * 0.06
    fast = lfilter([1.0], [1.0, -2.0 * 0.97 * np.cos(turn), 0.97**2], random.normal(size=n + 500))[500:]
    unit = np.sqrt((1.0 + 0.97**2) / (1.0 - 0.97**2) / ((1.0 + 0.97**2) ** 2 - (2.0 * 0.97 * np.cos(turn)) ** 2))
    return (fast / unit + coloured_noise(random, n, 1.0, 0.9)) / np.sqrt(2.0)


def windows(seed: int, n: int, drift_f0: float = 0.0, humming: bool = False) -> list[Window]:
    random = np.random.default_rng(seed)
    found = []
    for i, sd in enumerate(SDS):
        noise = sd * (hum(random, n) if humming else coloured_noise(random, n, 1.0, 0.95))
        found.append(Window(f"t{i}", 1e-3, 0.5 + drift_f0 * np.linspace(0.0, 1.0, n) + noise))
    return found


def sizes(model: NoiseModel) -> Array:
    return np.array([noise.sd_f0 for noise in model.trials])


@pytest.mark.parametrize("humming", [False, True])
@pytest.mark.parametrize("n", [60, 400])
def test_size_is_right_and_its_uncertainty_covers_it(n: int, humming: bool) -> None:
    """Windows of 60 samples hold two or three independent ones: single sizes are off, draws say by how much."""
    logs, covered = [], []
    for seed in range(5):
        model = noise_model(windows(seed, n, humming=humming))
        logs.append(np.log(sizes(model) / SDS))
        drawn = model.draw([1000] * 5, 100, np.random.default_rng(0)).reshape(5, 1000, 100)
        spread = np.sqrt(np.mean(drawn**2, axis=1))
        low, high = np.quantile(spread, [0.02, 0.98], axis=1)
        covered.append((low < SDS) & (np.array(SDS) < high))
    assert abs(np.mean(logs)) < (0.25 if n == 60 else 0.1)
    assert np.mean(covered) > 0.9


def test_drift_is_no_noise() -> None:
    """A drift of ten times the noise changes nothing; curved in a long window, next to nothing."""
    assert np.allclose(sizes(noise_model(windows(3, 80, 0.0))), sizes(noise_model(windows(3, 80, 0.014))), rtol=1e-3)
    curved = [w._replace(force_f0=w.force_f0 + 0.01 * np.linspace(0, 1, 300) ** 2) for w in windows(3, 300)]
    assert np.allclose(sizes(noise_model(windows(3, 300))), sizes(noise_model(curved)), rtol=1e-3)


def test_draws_have_the_size_and_colour_of_the_model() -> None:
    model = noise_model(windows(0, 300, humming=True))
    drawn = model.draw([4000] * 5, 20, np.random.default_rng(1), uncertain=False).reshape(5, 4000, 20)
    for noise, values in zip(model.trials, drawn, strict=True):
        found = np.mean(sample_autocovariance(values.T, 30), axis=0)
        assert np.allclose(found, noise.autocovariance(31), atol=0.06 * noise.sd_f0**2)
        # 60 Hz: half a period is 8 samples.
        assert noise.autocovariance(9)[8] < 0.2 * noise.sd_f0**2


def test_smoothed_data() -> None:
    """A moving mean over 7 samples makes new noise tiny; size stays right and draws stay finite."""
    smooth = []
    for w in windows(1, 506):
        smooth.append(w._replace(force_f0=np.convolve(w.force_f0, np.ones(7) / 7.0, "valid")))
    model = noise_model(smooth)
    assert np.all(np.abs(np.log(sizes(model) / SDS)) < 0.5)
    assert np.all(np.isfinite(model.draw([500] * 5, 50, np.random.default_rng(0))))


def test_trial_without_window_has_the_noise_of_the_others() -> None:
    given_ = windows(0, 200)
    model = noise_model([*given_, Window("none", 1e-3, np.empty(0))])
    last = model.trials[-1]
    assert min(sizes(model)[:5]) < last.sd_f0 < max(sizes(model)[:5])
    drawn = model.of(["none"]).draw([500], 200, np.random.default_rng(0))
    # Not knowing which of the others it is like, sizes differ by more than a factor of two.
    low, high = np.quantile(np.std(drawn, axis=0), [0.1, 0.9])
    assert high > 2.0 * low


def test_silence_is_allowed() -> None:
    still = [Window("a", 1e-3, np.full(80, 0.3)), Window("b", 1e-3, np.full(80, 0.0))]
    model = noise_model(still)
    assert np.allclose(sizes(model), 1e-5)
    assert model.draw([50, 0], 7, np.random.default_rng(0)).shape == (50, 7)
    assert model.trials[0].autocovariance(5).tolist() == pytest.approx([1e-10, 0, 0, 0, 0])


def test_window_of_a_trial() -> None:
    trial = StretchShortenStretch(0.0383, 0.5).trial("made", 6.0)
    made = replace(trial, force_time_s=trial.time_s, force_n=np.arange(trial.time_s.size, dtype=np.float64))
    window = isometric_window(made)
    assert (window.trial, window.step_s) == (trial.facts.trial, pytest.approx(1e-3))
    assert window.force_f0.tolist() == list(range(81))


def test_window_late_in_a_pause_where_a_trial_begins_with_a_stretch() -> None:
    trial = StretchShortenStretch(0.0383, 0.6, lead_s=0.0).trial("made", 6.0)
    made: Trial = replace(trial, force_time_s=trial.time_s, force_n=trial.time_s)
    recovery: Phase = made.phases_by_name()["recovery"]
    force = isometric_window(made).force_f0
    assert force.size == pytest.approx(200, abs=1)
    assert recovery.end_s - 0.2 <= force[0] < force[-1] <= recovery.end_s


@pytest.mark.parametrize(
    ("given_", "words"),
    [
        ([], "no trial holds still"),
        ([Window("a", 1e-3, np.zeros(19))], "longest isometric window has 19"),
        ([Window("a", 1e-3, np.full(50, np.nan))], "trial a: force of its isometric window is not finite"),
    ],
)
def test_windows_that_tell_nothing(given_: list[Window], words: str) -> None:
    with pytest.raises(UserError, match=words):
        noise_model(given_)


def test_unknown_trial_is_named() -> None:
    with pytest.raises(UserError, match="no noise is known of trial 'x'; known: t0"):
        noise_model(windows(0, 60)).of(["x"])


@settings(max_examples=20, deadline=None)
@given(st.integers(20, 120), st.integers(0, 10_000), st.floats(0.0, 0.995), st.floats(1e-6, 0.1))
def test_any_window_gives_finite_draws(n: int, seed: int, memory: float, sd: float) -> None:
    noise = coloured_noise(np.random.default_rng(seed), n, sd, memory)
    model = noise_model([Window("a", 1e-3, noise)])
    drawn = model.draw([60], 30, np.random.default_rng(seed))
    assert drawn.shape == (60, 30)
    assert np.all(np.isfinite(drawn))
    assert 1e-5 <= model.trials[0].sd_f0 < 50.0 * sd + 2e-5
