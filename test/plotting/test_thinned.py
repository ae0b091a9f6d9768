"""Thinned lines show every peak."""

from __future__ import annotations

import numpy as np

from xb_muscle_ros.plotting.thinned import thinned


def test_few_samples_are_all_drawn() -> None:
    time_s = np.arange(8000) / 1000
    assert thinned(time_s, np.sin(time_s)) == slice(None)


def test_peaks_of_a_sample_stay() -> None:
    random = np.random.default_rng(1)
    time_s = np.cumsum(random.uniform(0.5, 1.5, 300_000)) / 10_000
    time_s[150_000:] += 5.0  # nothing for a while
    values = random.standard_normal(time_s.size)
    for place, peak in ((1, 30.0), (77_777, -40.0), (time_s.size - 2, 50.0)):
        values[place] = peak
    shown = thinned(time_s, values)
    assert isinstance(shown, np.ndarray)
    assert shown.size <= 8000
    assert {0, 1, 77_777, 149_999, 150_000, time_s.size - 2, time_s.size - 1} <= set(shown.tolist())
    assert np.all(np.diff(shown) > 0)
    # In every part of time the same lowest and highest as in all samples.
    edges = np.searchsorted(time_s, np.linspace(time_s[0], time_s[-1], 101)[1:-1])
    drawn = np.full(time_s.size, np.nan)
    drawn[shown] = values[shown]
    for all_of, some in zip(np.split(values, edges), np.split(drawn, edges), strict=True):
        if all_of.size:
            assert np.nanmax(some) == all_of.max()
            assert np.nanmin(some) == all_of.min()
