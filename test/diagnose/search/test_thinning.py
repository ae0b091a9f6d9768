"""Trials at the times that tell: nothing of the input is lost, and samples count as often as they are independent."""

from __future__ import annotations

import itertools

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from xb_muscle_ros.diagnose.search.thinning import INDEPENDENT_S, thinned
from xb_muscle_ros.fit.data import FitTrial

Array = npt.NDArray[np.float64]


def trial_of(
    time_s: Array, length_l0: Array, calcium_um: Array | None = None, force_f0: Array | None = None, weight: float = 1.0
) -> FitTrial:
    force = 0.5 + 0.0 * time_s if force_f0 is None else force_f0
    calcium = np.ones_like(time_s) if calcium_um is None else calcium_um
    return FitTrial("a", "pCa 6", 0, False, weight, None, True, time_s, length_l0, calcium, time_s, force)


def protocol(rate_hz: float = 1000.0, seconds: float = 1.0) -> tuple[Array, Array]:
    time_s = np.arange(int(seconds * rate_hz) + 1) / rate_hz
    corners = np.array([0.0, 0.2, 0.284, 0.368, 0.6, 0.684, seconds])
    return time_s, np.interp(time_s, corners, [0.0, 0.0, 0.0383, 0.0, 0.0, 0.0383, 0.0383])


def test_corners_of_length_are_kept_and_the_way_between_is_straight() -> None:
    time_s, length = protocol()
    thin = thinned(trial_of(time_s, length)).trial
    assert thin.time_s.size < 0.4 * time_s.size
    for corner in (0.0, 0.2, 0.284, 0.368, 0.6, 0.684, 1.0):
        assert np.min(np.abs(thin.time_s - corner)) < 1e-9, corner
    assert np.interp(time_s, thin.time_s, thin.length_l0) == pytest.approx(length, abs=2.1e-5)


def test_steps_are_short_after_a_corner_and_grow() -> None:
    time_s, length = protocol()
    thin = thinned(trial_of(time_s, length)).trial
    hold = thin.time_s[(thin.time_s >= 0.684 - 1e-9)]
    assert hold[1] - hold[0] == pytest.approx(0.001)
    assert np.diff(hold)[-2] > 0.02


def test_changes_of_calcium_are_kept() -> None:
    time_s, length = protocol()
    calcium = np.where(time_s > 0.4505, 10.0, 0.1)
    thin = thinned(trial_of(time_s, length, calcium)).trial
    # Calcium acts in the step that ends at a sample: the last of before and the first of after.
    assert np.min(np.abs(thin.time_s - 0.450)) < 1e-9
    assert np.min(np.abs(thin.time_s - 0.451)) < 1e-9
    for t, value in zip(thin.time_s, thin.calcium_um, strict=True):
        assert value == (10.0 if t > 0.4505 else 0.1)


@pytest.mark.parametrize("rate_hz", [20.0, 50.0])
def test_a_trial_that_is_sampled_coarsely_stays(rate_hz: float) -> None:
    random = np.random.default_rng(0)
    time_s = np.arange(40) / rate_hz
    coarse = trial_of(time_s, 0.01 * np.cumsum(random.normal(size=40)), force_f0=random.normal(size=40))
    thin, weights = thinned(coarse)
    assert np.array_equal(thin.time_s, coarse.time_s)
    assert np.array_equal(thin.length_l0, coarse.length_l0)
    assert np.sum(weights) <= 40


def test_force_is_averaged_without_bias() -> None:
    """A constant stays, and a line is met at the mean of the times that were averaged."""
    time_s, length = protocol()
    level = thinned(trial_of(time_s, length, force_f0=np.full(time_s.size, 0.37))).trial
    assert level.measured_f0 == pytest.approx(0.37, abs=1e-14)
    line = thinned(trial_of(time_s, length, force_f0=0.2 + 0.3 * time_s)).trial
    assert line.measured_f0 == pytest.approx(0.2 + 0.3 * line.force_time_s, abs=1e-12)
    assert np.all(np.diff(line.force_time_s) > 0.0)


def test_every_sample_of_force_counts_once() -> None:
    time_s, length = protocol()
    random = np.random.default_rng(1)
    force = random.normal(size=time_s.size)
    whole = trial_of(time_s, length, force_f0=force)
    thin = thinned(whole).trial
    # A sample belongs to the step that it ends.
    counts = np.array([np.count_nonzero(part) for part in _steps(thin.time_s, time_s)])
    assert np.sum(counts) == time_s.size
    assert np.sum(counts * thin.measured_f0) == pytest.approx(np.sum(force))


def _steps(edges: Array, times: Array) -> list[npt.NDArray[np.bool_]]:
    found = [(times > a) & (times <= b) for a, b in itertools.pairwise(edges)]
    found[0] |= times <= edges[0]
    return found


def test_weights_count_independent_residuals() -> None:
    """Right after a corner one for each `INDEPENDENT_S`; later fewer; a trial's own weight multiplies."""
    time_s, length = protocol()
    thin, weights = thinned(trial_of(time_s, length))
    after = (thin.force_time_s > 0.2) & (thin.force_time_s < 0.212)
    assert np.sum(weights[after]) == pytest.approx(0.012 / INDEPENDENT_S, rel=0.35)
    late = (thin.force_time_s > 0.8) & (thin.force_time_s < 1.0)
    assert np.sum(weights[late]) < 0.2 / INDEPENDENT_S * 0.5
    assert thinned(trial_of(time_s, length, weight=0.25)).weights == pytest.approx(0.25 * weights)


@settings(max_examples=60)
@given(
    st.lists(st.tuples(st.floats(0.005, 0.3), st.floats(-0.05, 0.05)), min_size=1, max_size=6),
    st.sampled_from([100.0, 500.0, 1000.0]),
    st.integers(0, 3),
)
def test_any_ramps(ramps: list[tuple[float, float]], rate_hz: float, jumps: int) -> None:
    """Whatever is done: weights within 0 and 1, ends kept, length and calcium met at every sample."""
    corners = np.cumsum([0.0, *(t for t, _ in ramps)])
    levels = np.array([0.0, *(level for _, level in ramps)])
    time_s = np.arange(max(int(corners[-1] * rate_hz), 3) + 1) / rate_hz
    length = np.interp(time_s, corners, levels)
    calcium = 10.0 ** -np.digitize(time_s, np.linspace(0.0, time_s[-1], jumps + 2)[1:-1]).astype(float)
    thin, weights = thinned(trial_of(time_s, length, calcium))
    assert np.all((weights > 0.0) & (weights <= 1.0))
    assert weights.shape == thin.measured_f0.shape == thin.force_time_s.shape
    assert (thin.time_s[0], thin.time_s[-1]) == (time_s[0], time_s[-1])
    assert np.all(np.isin(thin.time_s, time_s))
    assert np.interp(time_s, thin.time_s, thin.length_l0) == pytest.approx(length, abs=1e-4)
    ends = np.searchsorted(thin.time_s, time_s[1:], side="left")
    assert thin.calcium_um[ends] == pytest.approx(calcium[1:], rel=2e-3)
