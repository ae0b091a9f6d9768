"""Where a trial shows its noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from xb_muscle_ros.scores.noise.windows import isometric_window
from xb_muscle_ros.trials.protocol import StretchShortenStretch
from xb_muscle_ros.trials.trial import Phase, Trial


def test_window_of_a_trial() -> None:
    trial = StretchShortenStretch(0.0383, 0.5).trial("made", 6.0)
    made = replace(trial, force_time_s=trial.time_s, force_n=1e4 + np.arange(trial.time_s.size, dtype=np.float64))
    window = isometric_window(made)
    assert (window.trial, window.step_s) == (trial.facts.trial, pytest.approx(1e-3))
    assert window.force_f0.tolist() == list(range(10_000, 10_081))


def test_window_late_in_a_pause_where_a_trial_begins_with_a_stretch() -> None:
    trial = StretchShortenStretch(0.0383, 0.6, lead_s=0.0).trial("made", 6.0)
    made: Trial = replace(trial, force_time_s=trial.time_s, force_n=trial.time_s)
    recovery: Phase = made.phases_by_name()["recovery"]
    force = isometric_window(made).force_f0
    assert force.size == pytest.approx(200, abs=1)
    assert recovery.end_s - 0.2 <= force[0] < force[-1] <= recovery.end_s
