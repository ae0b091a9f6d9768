"""Force control without ROS: loads in, lengths out, the same rules as for lengths."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
import pytest

from xb_muscle_ros.models.batch import MuscleBatch
from xb_muscle_ros.models.clamping import clamp_run
from xb_muscle_ros.models.fibre_file import changed, load_fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.node.control import CONTROLS
from xb_muscle_ros.node.lockstep import Lockstep
from xb_muscle_ros.node.realtime import Realtime, Settings
from xb_muscle_ros.node.rules import Refusal

FORCE = CONTROLS["force"]
MS = 1_000_000
FIBRE = changed(load_fibre("18Dec2017a"), {})
EVERY = np.array([0])


class Answers:
    """Keeps what a mode emits."""

    def __init__(self) -> None:
        self.all: list[tuple[int, Any, np.ndarray, np.ndarray, np.ndarray]] = []

    def emit(self, stamp: int, which: Any, table: Any, scales: Any, change: Any) -> None:
        """One answer."""
        self.all.append((stamp, which, table.copy(), scales.copy(), change.copy()))


def lockstep(notes: Any, count: int = 1) -> tuple[Lockstep, Answers]:
    answers = Answers()
    batch = MuscleBatch([FIBRE] * count)
    FORCE.warm(batch)
    return Lockstep(batch, answers.emit, notes, lambda: False, 1, FORCE), answers


def loads(count: int = 60) -> np.ndarray:
    """Isometric force at first, then a lower load that swings."""
    muscle = Muscle(FIBRE)
    isometric = muscle.outputs(muscle.settle(0.0, 5.0)).force_f0
    k = np.arange(count)
    return np.where(k < 10, isometric, isometric * (0.5 + 0.3 * np.sin(0.2 * k)))


def test_lockstep_bears_loads_bit_for_bit_as_without_ros(notes: Any) -> None:
    mode, answers = lockstep(notes)
    given = loads()
    assert mode.take_calcium(0, EVERY, np.array([5.0])) == []
    assert mode.status().waiting == "waiting for the first load sample and its calcium"
    scale = FIBRE.f0_n
    for k, load in enumerate(given):
        assert mode.take_length(1000 * MS + k * MS, EVERY, np.array([load * scale]), None) == []
    muscle = Muscle(FIBRE)
    dt_s, calcium = np.full(given.size - 1, 1e-3), np.full(given.size, 5.0)
    states = clamp_run(muscle, muscle.settle(0.0, 5.0), dt_s, given * scale / scale, calcium)
    assert [change[0] for *_, change in answers.all] == states[:, -3].tolist()
    force = [table[0, 0] for _, _, table, *_ in answers.all]
    assert force[1:] == pytest.approx(given[1:], abs=1e-6)


def test_many_fibres_bear_loads_of_their_own(notes: Any) -> None:
    mode, answers = lockstep(notes, 3)
    every = np.arange(3)
    shares = np.array([0.3, 0.6, 0.9])
    mode.take_calcium(0, every, np.full(3, 5.0))
    for k in range(40):
        assert mode.take_length(1000 * MS + k * MS, every, shares * FIBRE.f0_n, None) == []
    *_, table, _, change = answers.all[-1]
    assert table[:, 0] == pytest.approx(shares, abs=1e-6)
    assert np.all(np.diff(change) > 0.0)  # the lighter the load, the shorter
    # One of them alone goes on; the others do not move.
    assert mode.take_length(1040 * MS, np.array([1]), np.array([0.6 * FIBRE.f0_n]), None) == []
    assert answers.all[-1][1].tolist() == [1]


def test_what_cannot_be_borne_stops_the_fibre_and_says_so(notes: Any) -> None:
    mode, _ = lockstep(notes)
    mode.take_calcium(0, EVERY, np.array([5.0]))
    assert mode.take_length(1000 * MS, EVERY, np.array([0.5 * FIBRE.f0_n]), None) == []
    (trouble,) = mode.take_length(1001 * MS, EVERY, np.array([9.0 * FIBRE.f0_n]), None)
    assert "load of 9 F0" in str(trouble.error)
    assert "more than the fibre bears" in str(trouble.error)
    (trouble,) = mode.take_length(1002 * MS, EVERY, np.array([0.5 * FIBRE.f0_n]), None)
    assert "call ~/reset" in str(trouble.error)
    mode.reset()
    mode.take_calcium(0, EVERY, np.array([5.0]))
    assert mode.take_length(1003 * MS, EVERY, np.array([0.5 * FIBRE.f0_n]), None) == []


@pytest.mark.parametrize(("load_f0", "said"), [(11.0, "allowed is -1 to 10 F0; send N"), (float("nan"), "not finite")])
def test_impossible_loads_are_refused(notes: Any, load_f0: float, said: str) -> None:
    mode, _ = lockstep(notes)
    mode.take_calcium(0, EVERY, np.array([5.0]))
    (trouble,) = mode.take_length(1000 * MS, EVERY, np.array([load_f0 * FIBRE.f0_n]), None)
    assert isinstance(trouble.error, Refusal)
    assert said in str(trouble.error)
    assert not mode.status().fault


def test_a_saved_state_goes_on_under_its_load(notes: Any) -> None:
    mode, answers = lockstep(notes)
    other, again = lockstep(notes)
    mode.take_calcium(0, EVERY, np.array([5.0]))
    for k in range(20):
        mode.take_length(1000 * MS + k * MS, EVERY, np.array([0.5 * FIBRE.f0_n]), None)
    other.load(mode.save())
    for each in (mode, other):
        each.take_length(1020 * MS, EVERY, np.array([0.4 * FIBRE.f0_n]), None)
    assert again.all[-1][-1] == answers.all[-1][-1]


def test_realtime_bears_the_newest_load_and_keeps_its_length_without(notes: Any) -> None:
    answers = Answers()
    settings = Settings(500.0, False, 0.02, 10, 0.1, "isometric", 0.1)
    batch = MuscleBatch([FIBRE])
    FORCE.warm(batch)
    mode = Realtime(batch, settings, answers.emit, time.monotonic_ns, notes, lambda: False, FORCE)
    mode.start()
    try:
        assert "load" in mode.status().waiting
        mode.take_calcium(0, EVERY, np.array([5.0]))
        end = time.monotonic() + 20.0
        while len(answers.all) < 100 and time.monotonic() < end:
            mode.take_length(0, EVERY, np.array([0.6 * FIBRE.f0_n]), None)
            time.sleep(0.005)
        # Now loads stay away; the fibre keeps its length.
        while not mode.status().on_timeout and time.monotonic() < end:
            time.sleep(0.01)
        count = len(answers.all)
        while len(answers.all) < count + 20 and time.monotonic() < end:
            time.sleep(0.01)
    finally:
        mode.stop()
    assert answers.all[90][2][0, 0] == pytest.approx(0.6, abs=1e-6)
    held = [change[0] for *_, change in answers.all[count + 1 :]]
    assert len(held) >= 15
    assert len(set(held)) == 1
    assert any("no load for" in line for line in notes.lines)
