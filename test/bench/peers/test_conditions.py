"""What peers are sent is the paper's protocol as our own trials have it."""

from __future__ import annotations

import numpy as np
import pytest

from xb_muscle_ros.bench.peers.conditions import SAMPLES, onset_stiffness, path_of
from xb_muscle_ros.models.fibre_file import load_fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.scores.conditions import CONDITIONS, Condition
from xb_muscle_ros.simulation import stretches
from xb_muscle_ros.trials.protocol import SPEED_L0_PER_S, StretchShortenStretch


@pytest.mark.parametrize("condition", CONDITIONS, ids=str)
def test_a_path_is_the_protocol_up_to_ten_milliseconds_of_test_stretch(condition: Condition) -> None:
    """Written out from the paper's numbers, and beside the trial that `simulate` makes."""
    path = path_of(condition)
    ramp = condition.amplitude_l0 / 0.4545
    parts = [0.05, *([ramp, ramp] if ramp else []), condition.recovery_s, 0.010]
    lengths = [0.0, 0.0, *([condition.amplitude_l0, 0.0] if ramp else []), 0.0, 0.004545]
    np.testing.assert_allclose(path.corner_s, np.cumsum([0.0, *parts]), rtol=1e-12)
    np.testing.assert_allclose(path.corner_l0, lengths, rtol=1e-12, atol=1e-15)
    whole = StretchShortenStretch(condition.amplitude_l0, condition.recovery_s, lead_s=0.05).corners()
    np.testing.assert_allclose(path.length_l0(), np.interp(path.sample_s, *whole), rtol=1e-9)
    onset = path.sample_s[0] - 0.001
    np.testing.assert_allclose(path.sample_s, onset + 0.001 * np.arange(1, SAMPLES + 1), rtol=1e-9)
    assert path.sample_s[-1] == path.corner_s[-1]


@pytest.mark.parametrize("condition", [CONDITIONS[0], Condition(0.0383, 0.001)], ids=str)
def test_our_model_on_a_path_has_the_srs_of_the_grid(condition: Condition) -> None:
    """The grid goes from state to state; a path is one trial."""
    muscle, calcium = Muscle(load_fibre("18Dec2017a", "3state_coop")), 0.8
    path, settled = path_of(condition), muscle.settle(0.0, calcium)
    held = np.full(path.corner_s.size, calcium)
    states = muscle.follow(settled, path.corner_s, path.corner_l0, held, path.sample_s, 1e-8)
    ours = onset_stiffness(path, muscle.outputs_of(states)["force_f0"])
    state = settled
    if condition.amplitude_l0:
        state = stretches.stretched_and_back(muscle, settled, condition.amplitude_l0, calcium)
    state = stretches.waited(muscle, state, condition.recovery_s, calcium)
    assert ours == pytest.approx(stretches.onset_stiffness(muscle, state, calcium), rel=1e-4)


def test_srs_is_the_slope_of_force_against_length() -> None:
    """Of a straight line, exactly."""
    path = path_of(CONDITIONS[-1])
    assert onset_stiffness(path, 0.3 + 42.0 * path.length_l0()) == pytest.approx(42.0)
    assert path.corner_l0[-1] == pytest.approx(0.01 * SPEED_L0_PER_S)
