"""Scores on small trials whose answers are known by hand."""

from __future__ import annotations

import numpy as np
import pytest

from xb_muscle_ros.scores.rmsd import force_rmsd, windows
from xb_muscle_ros.scores.stiffness import ratio, short_range_stiffness, stiffness_of_phase
from xb_muscle_ros.trials.protocol import StretchShortenStretch
from xb_muscle_ros.trials.trial import Phase, Trial, TrialFacts


def test_windows_of_the_paper() -> None:
    trial = StretchShortenStretch(0.0383, 0.1, lead_s=0.2, hold_s=0.2).trial("f", 6.1)
    ramp = 0.0383 / 0.4545
    w = windows(trial)
    assert w["conditioning"] == pytest.approx((0.2, 0.2 + ramp))
    assert w["test"] == pytest.approx((0.3 + 2 * ramp, 0.3 + 3 * ramp))
    # 0.0843 s to either side
    assert w["whole"] == pytest.approx((0.2 - ramp, 0.3 + 4 * ramp))


def test_windows_end_where_the_trial_ends() -> None:
    trial = StretchShortenStretch(0.0383, 0.1, lead_s=0.01, hold_s=0.02).trial("f", 6.1)
    w = windows(trial)
    assert w["whole"] == pytest.approx((0.0, float(trial.time_s[-1])))


def test_reference_trials_have_no_conditioning_window() -> None:
    w = windows(StretchShortenStretch(0.0, 0.1).trial("f", 6.1))
    assert w["conditioning"] is None
    assert w["test"] is not None


def test_other_protocols_are_taken_whole() -> None:
    time = np.linspace(0.0, 1.0, 11)
    facts = TrialFacts("f", "t", phases=(Phase("stretch", 0.2, 0.4),))
    trial = Trial(facts, time, np.ones(11), np.zeros(1), np.ones(1))
    assert windows(trial) == {"whole": (0.0, 1.0), "conditioning": None, "test": None}


def test_rmsd_by_hand() -> None:
    time = np.array([0.0, 1.0, 2.0, 3.0])
    simulated, measured = np.array([1.0, 2.0, 3.0, 9.0]), np.array([1.0, 1.0, 1.0, 1.0])
    # window holds the errors 1 and 2: sqrt((1 + 4)/2)
    assert force_rmsd(time, simulated, measured, (1.0, 2.0)) == pytest.approx(np.sqrt(2.5))
    assert force_rmsd(time, simulated, measured, None) is None
    assert force_rmsd(time, simulated, measured, (4.0, 5.0)) is None


def test_srs_of_a_straight_line_is_its_slope() -> None:
    time = np.arange(100) * 1e-3
    length = np.clip(0.4545 * (time - 0.02), 0.0, None)
    force = 0.3 + 25.0 * length
    assert short_range_stiffness(time, length, force, 0.02) == pytest.approx(25.0)


def test_srs_counts_the_ten_samples_after_onset() -> None:
    time = np.arange(100) * 1e-3
    length = np.clip(0.4545 * (time - 0.02), 0.0, None)
    force = 25.0 * length
    force[31:] = 0.0
    assert short_range_stiffness(time, length, force, 0.02) == pytest.approx(25.0)
    force[30] = 0.0
    assert short_range_stiffness(time, length, force, 0.02) != pytest.approx(25.0)


def test_srs_is_null_where_it_cannot_be_had() -> None:
    time = np.arange(100) * 1e-3
    assert short_range_stiffness(time, np.zeros(100), np.zeros(100), 0.02) is None
    assert short_range_stiffness(time, time, time, 0.0985) is None
    assert stiffness_of_phase(time, time, time, None) is None
    assert stiffness_of_phase(time, time, time, Phase("test_stretch", 0.01, 0.015)) is None


def test_ratio() -> None:
    assert ratio(3.0, 4.0) == 0.75
    assert ratio(None, 4.0) is None
    assert ratio(3.0, None) is None
    assert ratio(3.0, 0.0) is None
