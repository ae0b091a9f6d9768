"""Large arrays in a file, and who may share arrays."""

from __future__ import annotations

import io
import pickle
from collections.abc import Iterator

import numpy as np
import pytest

from xb_muscle_ros.trials import spool
from xb_muscle_ros.trials.spool import is_settled, release, roomy, settle, spooled
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


def test_many_bytes_lie_in_a_file(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(spool, "LEAST", 10)
    blocks = [bytes([i]) * 30 for i in range(9)]
    assert spooled(blocks[:2]) == b"".join(blocks[:2])
    assert isinstance(spooled(blocks[:2]), bytes)
    found = spooled(iter(blocks))
    assert isinstance(found, spool.Spool)
    assert found[:] == b"".join(blocks)
    release(found)
    assert found[269:] == b"\x08"
    assert spooled([]) == b""


@pytest.mark.parametrize("room", [-1, 0, 5, 130, 10_000])
def test_without_room_for_a_file_bytes_are_in_memory(monkeypatch: pytest.MonkeyPatch, room: int) -> None:
    class Small(io.BytesIO):
        def __init__(self, buffering: int) -> None:
            if room < 0:
                raise FileNotFoundError(2, "No usable temporary directory found")
            super().__init__()

        def write(self, data: bytes) -> int:
            left = room - self.tell()
            if left <= 0:
                raise OSError(28, "No space left on device")
            return super().write(data[:left])

        def fileno(self) -> int:
            raise OSError(25, "Not a file that can be mapped")

    monkeypatch.setattr(spool, "LEAST", 10)
    monkeypatch.setattr(spool.tempfile, "TemporaryFile", Small)
    blocks = [bytes([i]) * 30 for i in range(9)]
    assert spooled(iter(blocks)) == b"".join(blocks)


def test_what_cannot_be_read_is_not_taken_for_a_lack_of_room(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken() -> Iterator[bytes]:
        yield b"1" * 100
        raise OSError(5, "Input/output error")

    monkeypatch.setattr(spool, "LEAST", 10)
    with pytest.raises(OSError, match="Input/output error"):
        spooled(broken())


def test_a_part_of_an_array_in_a_file_is_let_go_and_settled_with_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(spool, "LEAST", 1000)
    whole = roomy(4000).reshape(2, 2000)
    whole[:] = np.arange(4000.0).reshape(2, 2000)
    part = whole[1, 10:20]
    assert not is_settled(part)
    assert settle(part) is part
    assert is_settled(part)
    assert isinstance(whole.base, np.ndarray)
    assert not whole.base.flags.writeable
    assert frozen(part) is part
    release(part)
    assert part.tolist() == list(range(2010, 2020))


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
