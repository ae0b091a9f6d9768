"""Times of a twitch and fusion of a train, against forces that are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import xb_muscle_ros as xb
from xb_muscle_ros.scores.estimate import Missing
from xb_muscle_ros.scores.twitch import ripple, twitch

CRITICALLY_DAMPED = 0.04
"""Milner-Brown's twitch F = t/T·exp(1 - t/T) peaks at T with 1, and is half of it 1.6783 T later."""


def response(since: np.ndarray) -> np.ndarray:
    late = np.maximum(since, 0.0) / CRITICALLY_DAMPED
    return late * np.exp(1.0 - late)


def test_closed_form() -> None:
    t = np.arange(0.0, 0.6, 1e-4)
    found = twitch(t, 0.1 + 0.5 * response(t - 0.05), 0.05)
    assert not isinstance(found, Missing)
    assert found.rest_f0.value == pytest.approx(0.1)
    assert found.peak_f0.value == pytest.approx(0.5, rel=1e-5)
    assert found.to_peak_s.value == pytest.approx(CRITICALLY_DAMPED, abs=1e-4)
    assert found.half_relaxation_s.value == pytest.approx(1.67835 * CRITICALLY_DAMPED, rel=1e-3)
    assert found.rise_per_s.value == pytest.approx(np.e / CRITICALLY_DAMPED, rel=5e-3)
    # The steepest fall is at 2 T: exp(1 - 2)/T.
    assert found.fall_per_s.value == pytest.approx(np.exp(-1.0) / CRITICALLY_DAMPED, rel=5e-3)


def test_no_contraction_and_no_relaxation_are_told() -> None:
    t = np.arange(0.0, 0.1, 1e-3)
    assert isinstance(twitch(t, 0.0 * t, 0.01), Missing)
    assert isinstance(twitch(t, 0.0 * t, 0.0985), Missing)
    found = twitch(t, response(t), 0.0)
    assert not isinstance(found, Missing)
    assert found.half_relaxation_s.value is None


@pytest.mark.parametrize("frequency", [3.0, 8.0, 15.0])
def test_fusion_of_summed_responses(frequency: float) -> None:
    """Responses that sum linearly: trough over peak in the steady train, worked out over one period."""
    t = np.arange(0.0, 4.0, 2e-4)
    pulses = np.arange(0.0, 3.0, 1.0 / frequency)
    force = sum(response(t - pulse) for pulse in pulses)
    phase = np.linspace(0.0, 1.0 / frequency, 4000)
    steady = sum(response(phase + k / frequency) for k in range(40))
    found = ripple(t, np.asarray(force), 0.0, (float(pulses[-2]), float(pulses[-1])))
    assert not isinstance(found, Missing)
    assert found.peak_f0.value == pytest.approx(np.max(steady), rel=1e-3)
    assert found.fusion.value == pytest.approx(np.min(steady) / np.max(steady), rel=1e-2, abs=1e-3)


def test_a_recording_without_settings_begins_where_calcium_or_force_rises() -> None:
    made = xb.run_protocol("twitch", "18Dec2017a", as_measured=True, tell=lambda line: None)
    (trial,) = made.trials
    bare = replace(trial, facts=replace(trial.facts, protocol="", settings=()))
    (found,) = xb.analyse_protocol("twitch", [bare], tell=lambda line: None).results
    (told,) = made.results
    assert any("where calcium rises" in note for note in found.notes)
    assert found.rows[0]["to_peak_s"].value == pytest.approx(told.rows[0]["to_peak_s"].value, abs=5e-4)
    dark = replace(bare, calcium_time_s=np.zeros(1), calcium_um=np.ones(1))
    (found,) = xb.analyse_protocol("twitch", [dark], tell=lambda line: None).results
    assert any("where force rises by 2 %" in note for note in found.notes)


def test_force_and_fusion_rise_with_frequency() -> None:
    frequency = [2.0, 10.0, 20.0, 80.0]
    (found,) = xb.run_protocol("tetanus", "18Dec2017a", frequency=frequency, tell=lambda line: None).results
    for key in ("peak_f0", "fusion"):
        assert np.all(np.diff(found.column(key)) > 0.0)
    assert 10.0 < found.numbers["half_hz"].value < 20.0
    assert 20.0 < found.numbers["fused_hz"].value < 80.0
    (twitches,) = xb.run_protocol("twitch", "18Dec2017a", tell=lambda line: None).results
    # Far apart, each response of a train is a twitch.
    assert found.rows[0]["peak_f0"].value == pytest.approx(twitches.rows[0]["peak_f0"].value, rel=0.01)


def test_noise_spoils_no_number_of_a_twitch() -> None:
    """The steepest rise was the largest difference of two samples: 200 peaks/s where there are 56."""
    made = xb.run_protocol("twitch", "18Dec2017a", as_measured=True, tell=lambda line: None)
    (true,), (trial,) = made.results[0].rows, made.trials
    off: dict[str, list[float]] = {}
    for seed in range(12):
        noise = 1e-3 * np.random.default_rng(seed).standard_normal(trial.force_n.size)
        noisy = replace(trial, force_n=trial.force_n + noise)
        (row,) = xb.analyse_protocol("twitch", [noisy], tell=lambda line: None).results[0].rows
        for key in ("peak_f0", "to_peak_s", "half_relaxation_s", "rise_per_s", "fall_per_s"):
            off.setdefault(key, []).append((row[key].value - true[key].value) / row[key].se)
    for key, errors in off.items():
        assert np.sqrt(np.mean(np.square(errors))) < 2.2, key


def test_fusion_of_a_noisy_train_is_not_below_it() -> None:
    made = xb.run_protocol("tetanus", "18Dec2017a", frequency=[1.0, 10.0], as_measured=True, tell=lambda line: None)
    for trial, row in zip(made.trials, made.results[0].rows, strict=True):
        noisy = replace(
            trial, force_n=trial.force_n + 1e-3 * np.random.default_rng(0).standard_normal(trial.force_n.size)
        )
        (found,) = xb.analyse_protocol("tetanus", [noisy], tell=lambda line: None).results[0].rows
        assert found["fusion"].value == pytest.approx(row["fusion"].value, abs=4.0 * found["fusion"].se)
        assert found["fusion"].se < 0.02
