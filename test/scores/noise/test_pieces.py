"""Pieces of a recording in which force runs smoothly, and what smooth is."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from xb_muscle_ros.scores.noise.pieces import curves, evenly_sampled, smooth_pieces
from xb_muscle_ros.trials.trial import Trial

Array = npt.NDArray[np.float64]


@pytest.fixture
def trial(made: Any) -> Trial:
    """A stretch of 0.1 s and a hold of 0.2 s at 1 kHz."""
    times = made.even_times(0.1, 0.2, 1e-3)
    return made.relaxing("a", times, 0.1, np.zeros(times.size))


def moved(trial: Trial, change_l0: Array) -> Trial:
    return replace(trial, length_m=trial.length_m + change_l0)


def test_hold_without_its_ends(trial: Trial) -> None:
    (piece,) = smooth_pieces(trial)
    assert (piece.time_s[0], piece.time_s[-1]) == pytest.approx((0.12, 0.279), abs=1e-3)
    assert piece.force_f0.tolist() == trial.measured_f0[np.isin(trial.force_time_s, piece.time_s)].tolist()


def test_stretch_only_where_there_is_no_hold(trial: Trial) -> None:
    stretch = replace(trial, facts=replace(trial.facts, phases=trial.facts.phases[:1]))
    (piece,) = smooth_pieces(stretch)
    assert (piece.time_s[0], piece.time_s[-1]) == pytest.approx((0.01, 0.089), abs=1.1e-3)


def test_phase_in_which_length_swings_is_none(trial: Trial) -> None:
    swinging = 0.01 * np.sin(2.0 * np.pi * 20.0 * trial.time_s)
    assert smooth_pieces(moved(trial, swinging)) == []
    trembling = 1e-4 * np.sin(2.0 * np.pi * 20.0 * trial.time_s)
    assert len(smooth_pieces(moved(trial, trembling))) == 1


def test_whole_trial_where_no_phases_are_known(trial: Trial) -> None:
    still = replace(trial, facts=replace(trial.facts, phases=()), length_m=np.ones(trial.time_s.size))
    (piece,) = smooth_pieces(still)
    assert piece.time_s.size == pytest.approx(0.8 * trial.time_s.size, abs=2)


def test_change_of_calcium_ends_a_piece(trial: Trial) -> None:
    changing = replace(trial, calcium_time_s=np.array([0.0, 0.25]), calcium_um=np.array([1.0, 2.0]))
    (piece,) = smooth_pieces(changing)
    assert piece.time_s[-1] < 0.25


def test_too_few_samples_are_no_piece(made: Any) -> None:
    times = made.even_times(0.1, 0.02, 1e-3)
    trial = made.relaxing("a", times, 0.1, np.zeros(times.size))
    assert [p.time_s[-1] < 0.1 for p in smooth_pieces(trial)] == [True]


@pytest.mark.parametrize("shape", ["exponentials", "power", "active"])
@pytest.mark.parametrize("spreading", [False, True])
def test_curves_follow_a_relaxation(made: Any, shape: str, spreading: bool) -> None:
    """To 0.05 % F0 of a fall from 30 % F0: no more than the noise of a quiet recording."""
    times = made.spreading_times(0.1, 60.0) if spreading else made.even_times(0.1, 0.3, 1e-3)
    (piece,) = smooth_pieces(made.relaxing("a", times, 0.1, np.zeros(times.size), shape))
    columns = curves(piece.time_s)
    left = piece.force_f0 - columns @ (columns.T @ piece.force_f0)
    assert np.sqrt(np.mean(left**2)) < 5e-4


@settings(max_examples=50, deadline=None)
@given(st.lists(st.floats(1e-4, 100.0), min_size=19, max_size=200), st.floats(-10.0, 1000.0))
def test_curves_are_orthonormal_at_any_times(steps_s: list[float], start_s: float) -> None:
    columns = curves(start_s + np.concatenate([[0.0], np.cumsum(steps_s)]))
    assert np.allclose(columns.T @ columns, np.eye(columns.shape[1]), atol=1e-8)
    constant = np.ones(len(steps_s) + 1)
    assert np.allclose(columns @ (columns.T @ constant), constant)


def test_sampled_evenly(made: Any) -> None:
    random = np.random.default_rng(0)
    even = made.even_times(0.1, 0.2, 1e-3)
    jitter, gaps = even + random.uniform(-2e-4, 2e-4, even.size), even[random.uniform(size=even.size) > 0.05]
    of = {"even": even, "jitter": jitter, "gaps": gaps, "spreading": made.spreading_times(0.1, 60.0)}
    found = {key: evenly_sampled(t) for key, t in of.items()}
    assert found == {"even": True, "jitter": True, "gaps": True, "spreading": False}
