"""Any movement that a motor can make is survived, and the series spring that goes slack does not push."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from xb_muscle_ros.models.fibre_file import load_fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.models.registry import MODELS, row_of, slack_of

FIBRE = "18Dec2017a"
# Corners in s and L0: a k_tr release and restretch, 30 % either way in 0.2 ms, 50 L0/s from one end to the other.
MOVEMENTS = {
    "k_tr": ([0.0, 0.01, 0.012, 0.03, 0.032, 0.08], [0.0, 0.0, -0.2, -0.2, 0.0, 0.0]),
    "short": ([0.0, 0.01, 0.0102, 0.03, 0.0302, 0.08], [0.0, 0.0, -0.3, -0.3, 0.0, 0.0]),
    "long": ([0.0, 0.01, 0.0102, 0.03, 0.0302, 0.08], [0.0, 0.0, 0.3, 0.3, 0.0, 0.0]),
    "fast": ([0.0, 0.01, 0.016, 0.022, 0.034, 0.08], [0.0, 0.0, 0.3, 0.0, -0.3, -0.3]),
}


def muscle_of(model: str, method: str = "gaussian", smoothing: float = 0.0, **values: float) -> Muscle:
    loaded = load_fibre(FIBRE, model, method)
    return Muscle(replace(loaded, values={**loaded.values, "smoothing": smoothing, **values}))


def force(muscle: Muscle, movement: str, pca: float, dt_s: float = 1e-3) -> np.ndarray:
    time_s = np.arange(round(0.08 / dt_s) + 1) * dt_s
    calcium = np.full(time_s.size, 10.0 ** (6.0 - pca))
    state = muscle.settle(0.0, float(calcium[0]))
    states = muscle.run(state, np.diff(time_s), np.interp(time_s, *MOVEMENTS[movement]), calcium)
    return muscle.outputs_of(states)["force_f0"]


@pytest.mark.parametrize("smoothing", [0.0, 100.0])
@pytest.mark.parametrize("model", ["2state", "3state_coop", "4state_coop", "hill_se"])
def test_moments_survive(model: str, smoothing: float) -> None:
    """Regression: the fewer heads were left the more strain was theirs, until no step size was small enough."""
    muscle = muscle_of(model, smoothing=smoothing)
    for movement in MOVEMENTS:
        for pca in (4.5, 6.6, 9.0):
            for dt_s in (1e-3, 2e-4):
                found = force(muscle, movement, pca, dt_s)
                assert np.isfinite(found).all()
                assert found.max() < 20.0
    corner_s, lengths = (np.array(x) for x in MOVEMENTS["k_tr"])
    held = np.full(corner_s.size, 10.0**1.5)
    sample_s = np.linspace(0.0, 0.08, 81)
    states = muscle.follow(muscle.settle(0.0, 10.0**1.5), corner_s, lengths, held, sample_s)
    # The same release by steps of 0.2 ms: force redevelops alike, from the 3 ms after the restretch on.
    fixed = force(muscle, "k_tr", 4.5, 2e-4)[::5]
    np.testing.assert_allclose(muscle.outputs_of(states)["force_f0"][36:], fixed[36:], atol=0.01)


def test_strain_bins_survive() -> None:
    muscle = muscle_of("2state", "characteristics")
    for movement in MOVEMENTS:
        assert np.isfinite(force(muscle, movement, 4.5)).all()
    corner_s, lengths = (np.array(x) for x in MOVEMENTS["k_tr"])
    held = np.full(corner_s.size, 10.0**1.5)
    states = muscle.follow(muscle.settle(0.0, 10.0**1.5), corner_s, lengths, held, corner_s)
    assert np.isfinite(muscle.outputs_of(states)["force_f0"]).all()


@pytest.mark.slow
@pytest.mark.parametrize("smoothing", [0.0, 100.0])
def test_a_slack_spring_does_not_push_and_a_taut_one_is_the_same(smoothing: float) -> None:
    slack, pushing = (muscle_of(model, smoothing=smoothing) for model in ("3state_coop_slack", "3state_coop"))
    cases = [(movement, pca) for movement in MOVEMENTS for pca in (4.5, 6.6)]
    assert min(force(slack, *case).min() for case in cases) >= 0.0
    assert min(force(pushing, *case).min() for case in cases) < -0.1
    # Taut throughout: a stretch and back at the paper's speed.
    time_s = np.arange(301) * 1e-3
    length = np.interp(time_s, [0.0, 0.05, 0.13, 0.21], [0.0, 0.0, 0.036, 0.0])
    for pca in (4.5, 6.1):
        calcium = np.full(time_s.size, 10.0 ** (6.0 - pca))
        both = []
        for muscle in (slack, pushing):
            states = muscle.run(muscle.settle(0.0, float(calcium[0])), np.diff(time_s), length, calcium)
            both.append(muscle.outputs_of(states))
        tolerance = 5e-4 if smoothing == 0.0 else 5e-3
        np.testing.assert_allclose(both[0]["force_f0"], both[1]["force_f0"], atol=tolerance)


def test_slack_is_taken_up_unloaded() -> None:
    """Edman's slack test: the longer the release, the later force comes back, by its length over the velocity."""
    muscle = muscle_of("3state_coop_slack")
    time_s = np.arange(801) * 1e-3
    calcium = np.full(time_s.size, 10.0**1.5)
    start = muscle.settle(0.0, float(calcium[0]))
    l_se = muscle.state_names.index("l_se")
    back_s = []
    for release in (0.1, 0.15, 0.2):
        states = muscle.run(start, np.diff(time_s), np.interp(time_s, [0.0, 0.002], [0.0, -release]), calcium)
        slack = states[:, l_se] <= 0.0
        assert slack.any()
        back_s.append(float(time_s[np.flatnonzero(slack)[-1]]))
        # While it is slack the heads bear nothing between them.
        heads = states[slack][5:, 0] + states[slack][5:, 1]
        assert np.abs(heads).max() < 2e-3
        out = muscle.outputs_of(states)
        assert np.all(out["force_ce_f0"][slack] == 0.0)
    unloaded = np.diff([0.1, 0.15, 0.2]) / np.diff(back_s)
    # Times are known to a sample, 1 ms in 30.
    assert unloaded[0] == pytest.approx(unloaded[1], rel=0.2)
    assert 0.5 < unloaded[0] < 5.0


def test_every_model_knows_its_slack_form() -> None:
    assert slack_of("3state_coop") == "3state_coop_slack"
    assert slack_of("3state_coop_v3") == "3state_coop_slack_v3"
    assert slack_of("4state_coop_rigid_softplus+viscous_drag") == "4state_coop_slack_softplus+viscous_drag"
    assert slack_of("hill") == "hill_se_slack"
    assert slack_of("2state_slack") is None
    for model in MODELS:
        slack = slack_of(model)
        assert slack is None or row_of(slack).blocks["parallel"] is row_of(model).blocks["parallel"]
