"""Large arrays in a file, and who may share arrays."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

from xb_muscle_ros.trials import spool
from xb_muscle_ros.trials.spool import is_settled, release, roomy
from xb_muscle_ros.trials.trial import Trial, TrialFacts, frozen


def test_large_arrays_keep_what_they_hold(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(spool, "LEAST", 1000)
    large, small = roomy(100_000), roomy(10)
    assert isinstance(large.base, spool.Spool)
    assert small.base is None
    for first in range(0, large.size, 7000):
        large[first : first + 7000] = np.arange(first, min(first + 7000, large.size))
        release(large, small)
    assert np.array_equal(large, np.arange(100_000.0))
    assert np.array_equal(pickle.loads(pickle.dumps(large)), large)


def test_without_a_place_for_files_arrays_are_in_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(spool.os, "posix_fallocate", full)
    assert roomy(spool.LEAST).base is None


def test_only_what_nobody_can_change_is_shared() -> None:
    own = np.arange(5.0)
    view = own[:]
    view.setflags(write=False)
    assert not is_settled(own)
    assert not is_settled(view)  # its base can be changed
    first = frozen(view)
    assert first is not view
    own[0] = 7.0
    assert first[0] == 0.0
    assert frozen(first) is first
    assert frozen(first[1:3]).base is first
    assert frozen(first[::2]).flags.c_contiguous
    assert frozen(np.arange(3)).dtype == np.float64


def test_a_trial_made_of_another_has_its_arrays() -> None:
    time_s = np.arange(5) / 1000
    trial = Trial(TrialFacts("f", "t"), time_s, time_s + 1.0, time_s[:1], np.ones(1))
    again = Trial(trial.facts, trial.time_s, trial.length_m, trial.calcium_time_s, trial.calcium_um)
    assert again.length_m is trial.length_m
    with pytest.raises(ValueError, match="read-only"):
        again.length_m[0] = 0.0
