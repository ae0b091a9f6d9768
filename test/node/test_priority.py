"""Privileges that are not granted: one line with the remedy, and on it goes."""

from __future__ import annotations

import ctypes
import os
from typing import Any

import pytest

from xb_muscle_ros.node.privileges import lock_memory, take_priority


def test_priority_that_is_refused(notes: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """What was asked for, why not, and what would permit it."""

    def refuse(*_: Any) -> None:
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "sched_setscheduler", refuse)
    assert not take_priority(50, notes)
    (line,) = notes.lines
    assert line.startswith("warning realtime_priority 50 is not permitted here")
    assert "ulimit -r" in line


def test_memory_that_is_refused(notes: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same for locked pages."""

    class Libc:
        def mlockall(self, flags: int) -> int:
            del flags
            ctypes.set_errno(1)
            return -1

    monkeypatch.setattr(ctypes, "CDLL", lambda *_, **__: Libc())
    lock_memory(notes)
    (line,) = notes.lines
    assert line.startswith("warning lock_memory is not permitted here (Operation not permitted)")
    assert "ulimit -l" in line
