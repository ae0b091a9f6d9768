"""Scores on small trials whose answers are known by hand."""

from __future__ import annotations

import numpy as np
import pytest

from xb_muscle_ros.scores.estimate import Estimate, quotient
from xb_muscle_ros.scores.rmsd import force_rmsd, windows
from xb_muscle_ros.scores.stiffness import short_range_stiffness, stiffness_of_phase
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
    time = np.array([0.0, 1.0, 1.5, 2.0, 3.0])
    simulated, measured = np.array([1.0, 2.0, 3.0, 3.0, 9.0]), np.ones(5)
    # window holds the errors 1, 2 and 2: sqrt((1 + 4 + 4)/3)
    assert force_rmsd(time, simulated, measured, (1.0, 2.0)) == pytest.approx(np.sqrt(3.0))
    # Two samples happen to be near or far.
    assert force_rmsd(time, simulated, measured, (1.0, 1.5)) is None
    assert force_rmsd(time, simulated, measured, None) is None
    assert force_rmsd(time, simulated, measured, (4.0, 5.0)) is None


def test_srs_of_a_straight_line_is_its_slope() -> None:
    time = np.arange(100) * 1e-3
    length = np.clip(0.4545 * (time - 0.02), 0.0, None)
    force = 0.3 + 25.0 * length
    assert short_range_stiffness(time, length, force, 0.02).value == pytest.approx(25.0)


def test_srs_counts_the_ten_samples_after_onset() -> None:
    time = np.arange(100) * 1e-3
    length = np.clip(0.4545 * (time - 0.02), 0.0, None)
    force = 25.0 * length
    force[31:] = 0.0
    assert short_range_stiffness(time, length, force, 0.02).value == pytest.approx(25.0)
    force[30] = 0.0
    assert short_range_stiffness(time, length, force, 0.02).value != pytest.approx(25.0)


def test_srs_is_null_where_it_cannot_be_had() -> None:
    time = np.arange(100) * 1e-3
    assert short_range_stiffness(time, np.zeros(100), np.zeros(100), 0.02) == (
        None, None, "length does not change in the first 10 ms of the stretch",
    )  # fmt: skip
    assert short_range_stiffness(time, time, time, 0.0975).why == (
        "2 samples in the first 10 ms of the stretch; 3 are needed"
    )
    assert stiffness_of_phase(time, time, time, None) == (None, None, "")
    short = stiffness_of_phase(time, time, time, Phase("test_stretch", 0.01, 0.015))
    assert (short.value, short.why) == (None, "the stretch lasts 5 ms; 10 ms are needed")


def test_quotients_and_their_errors() -> None:
    assert quotient(Estimate(3.0), Estimate(4.0)) == (0.75, None, "")
    assert quotient(Estimate(None, why="no stretch"), Estimate(4.0)) == (None, None, "no stretch")
    assert quotient(Estimate(3.0), Estimate(None)).value is None
    assert quotient(Estimate(3.0), Estimate(0.0)).why == "the reference is zero"
    # 10 % and 20 % errors: sqrt(0.01 + 0.04) of the quotient.
    found = quotient(Estimate(3.0, 0.3), Estimate(4.0, 0.8))
    assert found.se == pytest.approx(0.75 * np.sqrt(0.05), rel=5e-3)
    # A quotient to something that may be zero may be anything.
    assert quotient(Estimate(3.0, 0.3), Estimate(0.2, 0.4)) == (None, None, "the reference is 0.2 ± 0.4 (SE)")
