"""Many fibres in one node, without ROS: each as in a node of its own."""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from xb_muscle_ros.errors import StateViolation, UserError
from xb_muscle_ros.models.batch import MuscleBatch
from xb_muscle_ros.models.fibre_file import load_fibre
from xb_muscle_ros.models.muscle import Muscle, Outputs
from xb_muscle_ros.node.inputs import Refusal
from xb_muscle_ros.node.lockstep import Lockstep
from xb_muscle_ros.node.lockstep_many import LockstepMany, scale_of
from xb_muscle_ros.node.realtime import Settings
from xb_muscle_ros.node.realtime_many import RealtimeMany
from xb_muscle_ros.node.several import NamesOfMany
from xb_muscle_ros.node.status import Account

NAMES = ("left", "right", "back")
SECOND = 10**9
SETTINGS = Settings(
    rate_hz=500.0,
    extrapolate=False,
    extrapolation_limit_s=0.02,
    max_catch_up=10,
    timeout_s=0.0,
    on_timeout="isometric",
    decay_s=0.1,
)


@pytest.fixture(scope="module")
def batch() -> MuscleBatch:
    """Three fibres that differ, in metres and newtons of their own."""
    files = ("18Dec2017a", "13Dec2017a", "7Aug2018a")
    made = [replace(load_fibre(file), name=name) for file, name in zip(files, NAMES, strict=True)]
    return MuscleBatch([replace(f, reference_length_m=0.1 * (k + 1), f0_n=10.0 * (k + 3)) for k, f in enumerate(made)])


class Answers:
    """What was emitted, by fibre and stamp."""

    def __init__(self, count: int = 3) -> None:
        self.count = count
        self.messages: list[tuple[int, list[int]]] = []
        self.rows: dict[int, list[tuple[int, tuple[float, ...], tuple[float, ...]]]] = {i: [] for i in range(count)}

    def emit(self, stamp: int, which: Any, outputs: Any, scales: Any) -> None:
        """Take a message to pieces."""
        fibres = list(range(self.count)) if which is None else which.tolist()
        self.messages.append((stamp, fibres))
        for i, row, scale in zip(fibres, outputs.tolist(), scales.tolist(), strict=True):
            self.rows[i].append((stamp, tuple(row), tuple(scale)))


def fibres(*indices: int) -> Any:
    """As the inlet hands them over."""
    return np.array(indices, dtype=np.intp)


LENGTHS = st.one_of(st.floats(0.95, 1.05), st.sampled_from([math.nan, math.inf, 9.0]))
CALCIUM = st.floats(0.01, 30.0)
EVENTS = st.lists(
    st.tuples(
        st.sampled_from(["length", "length", "length", "calcium", "reset"]),
        st.sampled_from([-300, 0, 1, 1, 1, 2, 10]),
        st.sets(st.integers(0, 2), min_size=1),
        st.tuples(LENGTHS, LENGTHS, LENGTHS),
        st.tuples(CALCIUM, CALCIUM, CALCIUM),
    ),
    max_size=25,
)


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(EVENTS, st.booleans())
def test_lockstep_is_that_of_single_fibres_to_the_bit(
    batch: MuscleBatch, notes: Any, events: list[Any], simulated: bool
) -> None:
    """Whatever messages name whom, and whatever is wrong with them: answers, refusals and accounts are the same."""
    answers, singly = Answers(), Answers()
    many = LockstepMany(batch, answers.emit, notes, lambda: simulated)
    ones = []
    for i, muscle in enumerate(batch.muscles):

        def emit(stamp: int, out: Any, scale: Any, i: int = i) -> None:
            singly.rows[i].append((stamp, tuple(out), tuple(scale)))

        ones.append(Lockstep(muscle, scale_of(muscle.fibre), emit, notes, lambda: simulated))
    now = SECOND
    for kind, ahead, whom, lengths, calcium in events:
        now += ahead * 1_000_000
        which = sorted(whom)
        refused: list[tuple[int, str]] = []
        found: list[Any] = []
        if kind == "reset":
            assert many.reset() == Account(
                *(sum(column) for column in zip(*(one.reset() for one in ones), strict=True))
            )
        elif kind == "calcium":
            found = many.take_calcium(now, fibres(*which), np.array([calcium[i] for i in which]))
            for i in which:
                try:
                    ones[i].take_calcium(now, calcium[i])
                except Refusal as refusal:
                    refused.append((i, str(refusal)))
        else:
            metres = {i: lengths[i] * 0.1 * (i + 1) for i in which}
            found = many.take_length(now, fibres(*which), np.array([metres[i] for i in which]), None)
            for i in which:
                try:
                    ones[i].take_length(now, metres[i], None)
                except (Refusal, UserError) as error:
                    refused.append((i, str(error)))
        assert sorted((t.fibre, str(t.error)) for t in found) == refused
    assert answers.rows == singly.rows
    assert all(math.isfinite(x) for rows in answers.rows.values() for _, out, _ in rows for x in out)


def test_a_message_for_all_is_answered_in_one(batch: MuscleBatch, notes: Any) -> None:
    """In the order of the fibres, also where the sender has another; one for some has an answer of some."""
    answers = Answers()
    many = LockstepMany(batch, answers.emit, notes, lambda: False)
    many.take_calcium(0, fibres(0, 1, 2), np.array([5.0, 6.0, 7.0]))
    for k, order in enumerate([(0, 1, 2), (2, 0, 1), (1, 2, 0)]):
        many.take_length(k * 1_000_000, fibres(*order), np.array([0.1 * (i + 1) for i in order]), None)
    many.take_length(9_000_000, fibres(1), np.array([0.2]), None)
    assert [set(which) for _, which in answers.messages] == [{0, 1, 2}] * 3 + [{1}]
    assert many.status().ticks == 4
    assert many.reset() == Account(10, 3, 0)


def test_one_line_for_all_whose_time_went_back(batch: MuscleBatch, notes: Any) -> None:
    """With the names of some."""
    many = LockstepMany(batch, Answers().emit, notes, lambda: True)
    for stamp in (5 * SECOND, 0):
        many.take_calcium(stamp, fibres(0, 1, 2), np.full(3, 5.0))
        many.take_length(stamp, fibres(0, 1, 2), np.array([0.1, 0.2, 0.3]), None)
    assert len(notes.lines) == 1
    assert notes.lines[0].startswith("warning left, right, back: length went back from 5.0")
    assert many.counts["time went back"] == 3


def test_snapshots_of_all_go_on_to_the_bit(batch: MuscleBatch, notes: Any) -> None:
    """And there are none while one fibre has no state."""
    whole, halves = Answers(), Answers()
    first = LockstepMany(batch, whole.emit, notes, lambda: False)
    other = LockstepMany(batch, halves.emit, notes, lambda: False)
    first.take_calcium(0, fibres(0, 1, 2), np.array([5.0, 6.0, 7.0]))
    first.take_length(0, fibres(0, 1), np.array([0.1, 0.2]), None)
    with pytest.raises(UserError, match="fibre back: there is no state to save yet"):
        first.save()
    for k in range(1, 10):
        first.take_length(k * 1_000_000, fibres(0, 1, 2), np.array([0.1, 0.2, 0.3]) * (1.0 + 1e-3 * k), None)
    other.load(first.save())
    for many in (first, other):
        for k in range(10, 20):
            many.take_length(k * 1_000_000, fibres(0, 1, 2), np.array([0.1, 0.2, 0.3]) * (1.0 + 1e-3 * k), None)
    for i in range(3):
        assert halves.rows[i] == whole.rows[i][-10:]


def fragile(batch: MuscleBatch, index: int) -> MuscleBatch:
    """The batch with one fibre that cannot be stretched beyond 0.1 L0, alone or with others."""

    class Fragile(Muscle):
        def step(self, state: Any, length_change_l0: float, calcium_um: float, dt_s: float) -> Any:
            if length_change_l0 > 0.1:
                raise StateViolation(self.fibre.name, "q2", 1e-4, -1.0, "0 to 1", "take a smaller step")
            return super().step(state, length_change_l0, calcium_um, dt_s)

    made = MuscleBatch([m.fibre for m in batch.muscles])
    weak = Fragile(batch.muscles[index].fibre)
    made.muscles = (*made.muscles[:index], weak, *made.muscles[index + 1 :])
    together = made.step

    def step(states: Any, change: Any, calcium: Any, dt_s: float) -> Any:
        weak.step(states[index], float(change[index]), float(calcium[index]), dt_s)
        return together(states, change, calcium, dt_s)

    made.step = step  # type: ignore[method-assign]
    return made


def test_a_fibre_that_fails_does_not_stop_the_others(batch: MuscleBatch, notes: Any) -> None:
    """It is named, refused from then on, and there again after a reset."""
    answers = Answers()
    many = LockstepMany(fragile(batch, 1), answers.emit, notes, lambda: False)
    every, length = fibres(0, 1, 2), np.array([0.1, 0.2, 0.3])
    many.take_calcium(0, every, np.full(3, 5.0))
    assert many.take_length(0, every, length, None) == []
    trouble = many.take_length(1_000_000, every, length * np.array([1.0, 1.2, 1.0]), None)
    assert [(t.fibre, "state q2" in str(t.error)) for t in trouble] == [(1, True)]
    trouble = many.take_length(2_000_000, every, length, None)
    assert [(t.fibre, "call ~/reset" in str(t.error)) for t in trouble] == [(1, True)]
    assert [which for _, which in answers.messages] == [[0, 1, 2], [0, 2], [0, 2]]
    assert many.status().fault.startswith("1 of 3 fibres; right: fibre right: state q2")
    assert many.status().violations == 1
    many.reset()
    assert many.status().fault == ""


def test_names_find_their_places() -> None:
    """In any order, some or all, none for all; strangers are news once; of a name that comes twice the first counts."""
    names = NamesOfMany(NAMES)
    everyone = names.places([], 3, "position")
    assert (everyone.fibres.tolist(), everyone.values, everyone.new) == ([0, 1, 2], None, [])
    for _ in range(2):
        found = names.places(["back", "left"], 2, "position")
        assert (found.fibres.tolist(), found.values) == ([2, 0], None)
    found = names.places(["ghost", "right", "right"], 3, "position")
    assert found.values is not None
    assert (found.fibres.tolist(), found.values.tolist(), found.new) == ([1], [1], ["ghost"])
    assert names.places(["ghost", "right", "right"], 3, "position").new == []
    assert names.places(["ghost"], 1, "position").new == []
    assert names.places([], 3, "position").fibres.tolist() == [0, 1, 2]
    for wrong, values in ((["left"], 2), ([], 2), ([], 1), (["left", "right"], 1)):
        with pytest.raises(Refusal, match="send one per name"):
            names.places(wrong, values, "position")


class Bench:
    """A realtime thread of three fibres."""

    def __init__(self, batch: MuscleBatch, settings: Settings, notes: Any) -> None:
        self.answers = Answers()
        self.notes = notes
        self.simulated = False
        self.realtime = RealtimeMany(
            batch, settings, self.answers.emit, time.monotonic_ns, notes, lambda: self.simulated
        )

    def feed(self, *which: int, change: float = 0.0, calcium_um: float = 5.0, stamp: int = 0) -> None:
        """Length and calcium for some fibres."""
        metres = np.array([0.1 * (i + 1) * (1.0 + change) for i in which])
        assert self.realtime.take_calcium(stamp, fibres(*which), np.full(len(which), calcium_um)) == []
        assert self.realtime.take_length(stamp, fibres(*which), metres, None) == []

    def until(self, condition: Callable[[], Any]) -> None:
        """Wait until something holds."""
        end = time.monotonic() + 10.0
        while not condition():
            assert time.monotonic() < end, (self.notes.lines, self.realtime.status())
            time.sleep(0.002)

    def emit_more(self, count: int) -> None:
        """Wait for some more messages."""
        target = len(self.answers.messages) + count
        self.until(lambda: len(self.answers.messages) >= target)

    def force(self, i: int) -> float:
        """Newest force of a fibre, F0."""
        return self.answers.rows[i][-1][1][0]


@pytest.fixture
def make(notes: Any) -> Iterator[Callable[..., Bench]]:
    """Benches whose threads end with the test."""
    benches: list[Bench] = []

    def start(batch: MuscleBatch, settings: Settings = SETTINGS) -> Bench:
        bench = Bench(batch, settings, notes)
        benches.append(bench)
        bench.realtime.start()
        return bench

    yield start
    for bench in benches:
        bench.realtime.stop()


def test_fibres_join_as_they_are_fed(make: Callable[..., Bench], batch: MuscleBatch) -> None:
    """Each settles on its own and holds; a reset sends all back."""
    bench = make(batch)
    bench.feed(0)
    bench.emit_more(5)
    assert bench.answers.messages[-1][1] == [0]
    assert bench.realtime.status().waiting == "right, back: waiting for length; right, back: waiting for calcium"
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
    count = len(bench.answers.messages)
    time.sleep(0.03)
    assert len(bench.answers.messages) <= count + 1


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
            samples.put(samples.inputs._replace(arrival_ns=arrivals))
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
    assert notes.lines == [
        f"error right: no length for 0.101 s, timeout_s is 0.1 s: {on_timeout}",
        f"info right: length is in time again: {on_timeout} ends",
    ]


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
