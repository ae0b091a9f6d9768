"""Many fibres in one realtime thread, without ROS: each as in a node of its own."""

from __future__ import annotations

import contextlib
import math
import re
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from many_fibres import Answers, fibres, fragile
from realtime_bench import SETTINGS, Waiting

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.batch import MuscleBatch
from xb_muscle_ros.models.muscle import Outputs
from xb_muscle_ros.node.realtime import Realtime, Settings
from xb_muscle_ros.node.rules import Refusal
from xb_muscle_ros.node.status import Account

SECOND = 10**9


class Bench(Waiting):
    """A realtime thread of three fibres."""

    def __init__(self, batch: MuscleBatch, settings: Settings, notes: Any) -> None:
        self.answers = Answers()
        self.emitted = self.answers.messages
        self.notes = notes
        self.simulated = False
        self.realtime = Realtime(batch, settings, self.answers.emit, time.monotonic_ns, notes, lambda: self.simulated)

    def feed(self, *which: int, change: float = 0.0, calcium_um: float = 5.0, stamp: int = 0) -> None:
        """Length and calcium for some fibres."""
        metres = np.array([0.1 * (i + 1) * (1.0 + change) for i in which])
        assert self.realtime.take_calcium(stamp, fibres(*which), np.full(len(which), calcium_um)) == []
        assert self.realtime.take_length(stamp, fibres(*which), metres, None) == []

    def force(self, i: int) -> float:
        """Newest force of a fibre, F0."""
        return self.answers.rows[i][-1][1][0]


@pytest.fixture
def make(started: list[Any], notes: Any) -> Callable[..., Bench]:
    """Benches whose threads end with the test."""

    def start(batch: MuscleBatch, settings: Settings = SETTINGS) -> Bench:
        bench = Bench(batch, settings, notes)
        started.append(bench)
        bench.realtime.start()
        return bench

    return start


def test_fibres_join_as_they_are_fed(make: Callable[..., Bench], batch: MuscleBatch) -> None:
    """Each settles on its own and holds; a reset sends all back."""
    bench = make(batch)
    bench.feed(0)
    bench.emit_more(5)
    assert bench.answers.messages[-1][1] == [0]
    assert bench.realtime.status().waiting == "right, back: waiting for length and calcium"
    with pytest.raises(UserError, match="fibre right: there is no state to save yet"):
        bench.realtime.save()
    bench.feed(1, 2, change=0.02)
    bench.until(lambda: bench.answers.messages[-1][1] == [0, 1, 2])
    bench.emit_more(20)
    for i, change in enumerate((0.0, 0.02, 0.02)):
        settled = batch.muscles[i].outputs(batch.muscles[i].settle(change, 5.0)).force_f0
        assert bench.force(i) == pytest.approx(settled, rel=1e-6)
    assert bench.answers.rows[2][-1][2] == pytest.approx((0.3, 50.0))
    assert bench.realtime.status().waiting == ""
    assert bench.realtime.reset() == Account(3, 3, 0)
    bench.until(lambda: bench.realtime.status().waiting)
    count = len(bench.answers.messages)
    bench.rounds(15)
    assert len(bench.answers.messages) == count


def test_bad_samples_are_refused_one_by_one(make: Callable[..., Bench], batch: MuscleBatch) -> None:
    """The others of the message are taken."""
    bench = make(batch)
    bench.feed(0, 1, 2, stamp=SECOND)
    take, every = bench.realtime.take_length, fibres(0, 1, 2)
    trouble = take(2 * SECOND, every, np.array([0.101, math.nan, 9.0]), None)
    assert [(t.fibre, t.error.reason) for t in trouble if isinstance(t.error, Refusal)] == [
        (1, "not finite"),
        (2, "out of range"),
    ]
    trouble = take(2 * SECOND, every, np.array([0.1, 0.2, 0.3]), np.array([0.0, 0.0, 1e6]))
    assert [(t.fibre, getattr(t.error, "reason", "")) for t in trouble] == [
        (0, "stamp not after the last"),
        (2, "out of range"),
    ]
    trouble = take(9000 * SECOND, every, np.array([0.1, 0.2, 0.3]), None)
    assert {getattr(t.error, "reason", "") for t in trouble} == {"stamp too far ahead"}
    trouble = bench.realtime.take_calcium(SECOND, every, np.full(3, 1.0))
    assert len(trouble) == 3
    bench.until(lambda: bench.realtime._states[0, -3] == pytest.approx(0.01))
    assert bench.realtime._samples.taken.tolist() == [[2, 1], [2, 1], [1, 1]]


@pytest.mark.parametrize("on_timeout", ["hold", "isometric", "decay"])
def test_each_fibre_has_its_watchdog(batch: MuscleBatch, notes: Any, on_timeout: str) -> None:
    """The one whose length stays away does what it should, the others go on; one line when it begins and ends.

    Without the thread: ticks are called with deadlines of the test's own.
    """
    settings = SETTINGS._replace(
        timeout_s=0.1, on_timeout=on_timeout, decay_s=0.02, extrapolate=True, extrapolation_limit_s=1.0
    )
    realtime = Bench(batch, settings, notes).realtime
    realtime._dt = 1e-3
    every, samples = fibres(0, 1, 2), realtime._samples
    realtime.take_calcium(0, every, np.full(3, 30.0))
    realtime.take_length(0, every, np.array([0.1, 0.2, 0.3]), np.array([0.0, 0.02, 0.0]))
    start = int(samples.inputs.arrival_ns[1])
    assert not realtime._ready()
    assert realtime._ready()

    def tick_until(end_ms: int, begin_ms: int) -> None:
        for k in range(begin_ms, end_ms):
            # The others get a sample every millisecond.
            arrivals = np.array([start + k * 1_000_000, start, start + k * 1_000_000])
            samples.inputs = samples.inputs._replace(arrival_ns=arrivals, oldest_ns=start)
            realtime._tick(start + k * 1_000_000)

    tick_until(101, 1)
    assert realtime.status().on_timeout == ""
    assert realtime._states[1, -3] == pytest.approx(0.01)
    tick_until(200, 101)
    assert realtime.status().on_timeout == f"{on_timeout} (right)"
    states = realtime._states
    # Carried on at 0.1 L0/s until then, and held from then on.
    assert states[1, -2] == 0.0
    assert states[1, -3] == (0.0 if on_timeout == "hold" else pytest.approx(0.01, abs=2e-4))
    assert states[1, -1] == (pytest.approx(30.0 * np.exp(-99.0 / 20.0)) if on_timeout == "decay" else 30.0)
    assert states[0, -1] == 30.0
    realtime.take_length(0, every, np.array([0.1, 0.2, 0.3]), None)
    realtime._tick(int(samples.inputs.arrival_ns[1]) + 1_000_000)
    status = realtime.status()
    assert (status.on_timeout, status.timeouts) == ("", 1)
    away, back = notes.lines
    assert away == f"error right: no length for 0.101 s, timeout_s is 0.1 s: {on_timeout}"
    assert re.fullmatch(rf"info right: length is back after \d\.\d{{3}} s: {on_timeout} ends", back)


def test_a_fibre_that_fails_leaves_and_the_others_tick_on(make: Callable[..., Bench], batch: MuscleBatch) -> None:
    """Until a reset."""
    bench = make(fragile(batch, 1))
    bench.feed(0, 1, 2)
    bench.emit_more(3)
    bench.feed(1, change=0.2)
    bench.until(lambda: bench.answers.messages[-1][1] == [0, 2])
    bench.emit_more(5)
    status = bench.realtime.status()
    assert status.fault.startswith("1 of 3 fibres; right: fibre right: state q2")
    assert status.violations == 1
    with pytest.raises(UserError, match="fibre right: there is no state to save, stepping has stopped"):
        bench.realtime.save()
    bench.realtime.reset()
    bench.feed(0, 1, 2)
    bench.until(lambda: bench.answers.messages[-1][1] == [0, 1, 2])
    assert bench.realtime.status().fault == ""


def test_realtime_snapshots_go_on(make: Callable[..., Bench], batch: MuscleBatch) -> None:
    """With the forces there were, isometrically, and stamps anew."""
    bench, other = make(batch), make(batch)
    bench.feed(0, 1, 2, change=0.02, calcium_um=30.0, stamp=10**12)
    bench.emit_more(20)
    other.realtime.load(bench.realtime.save())
    other.emit_more(3)
    for i in range(3):
        assert other.force(i) == pytest.approx(bench.force(i), rel=1e-6)
    other.feed(0, 1, 2, stamp=1)
    other.until(lambda: other.realtime._states[2, -3] == pytest.approx(0.0, abs=1e-12))


def test_simulated_time_may_go_back_for_some(make: Callable[..., Bench], batch: MuscleBatch) -> None:
    """Those settle anew, the others go on; one line."""
    bench = make(batch)
    bench.feed(0, 1, 2, stamp=9 * SECOND)
    bench.emit_more(3)
    bench.simulated = True
    bench.feed(0, 2, stamp=SECOND, change=0.02)
    bench.until(lambda: bench.realtime._states[2, -3] == pytest.approx(0.02))
    bench.until(lambda: bench.answers.messages[-1][1] == [0, 1, 2])
    settled = batch.muscles[2].outputs(batch.muscles[2].settle(0.02, 5.0)).force_f0
    bench.until(lambda: bench.force(2) == pytest.approx(settled, rel=1e-6))
    assert bench.realtime.counts == {"time went back": 2}
    assert len(bench.notes.lines) == 1
    assert bench.notes.lines[0].startswith("warning left, back: length went back from 9.0")
    with contextlib.suppress(Refusal):
        bench.feed(1, stamp=10 * SECOND)


def test_parameters_change_between_ticks(make: Callable[..., Bench], batch: MuscleBatch) -> None:
    """Of one fibre alone: without attachment its force goes."""
    bench = make(batch)
    bench.feed(0, 1, 2, calcium_um=30.0)
    bench.emit_more(5)
    before = bench.force(0)
    fibre = batch.muscles[1].fibre
    bench.realtime.replace(1, replace(fibre, values={**fibre.values, "f": 0.0}))
    bench.until(lambda: bench.force(1) < 0.2 * before)
    assert bench.force(0) == pytest.approx(before, rel=1e-6)
    assert batch.muscles[1].fibre.values["f"] > 0.0
    assert len(Outputs._fields) == 11
