"""The realtime thread without ROS: settling, holding, extrapolating, catching up, stopping."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from xb_muscle_ros.errors import StateViolation
from xb_muscle_ros.models.muscle import Muscle, Outputs
from xb_muscle_ros.node.inputs import Refusal, Scale
from xb_muscle_ros.node.realtime import Realtime, Settings

SCALE = Scale(1.0, 1.0)
SETTINGS = Settings(rate_hz=500.0, extrapolate=False, extrapolation_limit_s=0.02, max_catch_up=10)


class Bench:
    """A realtime thread, what it emitted and what it complained of."""

    def __init__(self, muscle: Muscle, settings: Settings = SETTINGS) -> None:
        self.emitted: list[Outputs] = []
        self.complaints: list[str] = []
        self.on_emit: Callable[[], None] = lambda: None
        self.realtime = Realtime(muscle, SCALE, settings, self._emit, time.monotonic_ns, self.complaints.append)

    def _emit(self, stamp: int, outputs: Outputs, scale: Scale) -> None:
        self.emitted.append(outputs)
        self.on_emit()

    def until(self, condition: Callable[[], Any]) -> None:
        """Wait until something holds."""
        end = time.monotonic() + 10.0
        while not condition():
            assert time.monotonic() < end
            time.sleep(0.002)

    def emit_more(self, count: int) -> None:
        """Wait for some more ticks."""
        target = len(self.emitted) + count
        self.until(lambda: len(self.emitted) >= target)


@pytest.fixture
def make() -> Iterator[Callable[..., Bench]]:
    """Benches whose threads end with the test."""
    benches: list[Bench] = []

    def start(muscle: Muscle, settings: Settings = SETTINGS) -> Bench:
        bench = Bench(muscle, settings)
        benches.append(bench)
        bench.realtime.start()
        return bench

    yield start
    for bench in benches:
        bench.realtime.stop()


def test_settles_then_holds_the_length(make: Callable[..., Bench], muscle: Muscle) -> None:
    """Without new samples the fibre stays isometric, at the settled force."""
    bench = make(muscle)
    assert bench.realtime.status().waiting == "waiting for length and calcium"
    bench.realtime.take_calcium(0, 5.0)
    assert bench.realtime.status().waiting == "waiting for length"
    bench.realtime.take_length(0, 1.02, 1.0)
    bench.emit_more(20)
    settled = muscle.outputs(muscle.settle(1.02 - 1.0, 5.0)).force_f0
    assert bench.emitted[-1].force_f0 == pytest.approx(settled, rel=1e-6)
    assert bench.realtime.status().waiting == ""


def test_extrapolates_by_velocity_for_a_limited_time(make: Callable[..., Bench], muscle: Muscle) -> None:
    """1 L0/s for 20 ms is 2 % of L0, then the length is held."""
    bench = make(muscle, SETTINGS._replace(extrapolate=True))
    bench.realtime.take_calcium(0, 5.0)
    bench.realtime.take_length(0, 1.0, 1.0)
    bench.emit_more(100)
    state: Any = bench.realtime._state
    length = dict(zip(muscle.state_names, state, strict=True))["length_change"]
    assert length == pytest.approx(0.02, abs=1e-9)
    bench.realtime.take_length(0, 1.0, None)
    bench.emit_more(10)
    state = bench.realtime._state
    assert dict(zip(muscle.state_names, state, strict=True))["length_change"] == 0.0


def test_velocity_never_leads_out_of_what_is_allowed(make: Callable[..., Bench], muscle: Muscle) -> None:
    """The sample itself is the better guess then."""
    bench = make(muscle, SETTINGS._replace(extrapolate=True, extrapolation_limit_s=1.0))
    bench.realtime.take_calcium(0, 5.0)
    bench.realtime.take_length(0, 1.0, 900.0)
    bench.emit_more(10)
    state: Any = bench.realtime._state
    assert dict(zip(muscle.state_names, state, strict=True))["length_change"] == 0.0
    with pytest.raises(Refusal, match="velocity"):
        bench.realtime.take_length(0, 1.0, 1e6)


def test_late_ticks_are_made_up_for_within_bounds(make: Callable[..., Bench], muscle: Muscle) -> None:
    """After 100 ms away from 500 Hz: 50 missed, 10 made up, the rest dropped, one message for all."""
    bench = make(muscle)
    bench.realtime.take_calcium(0, 5.0)
    bench.realtime.take_length(0, 1.0, None)
    bench.emit_more(5)
    bench.realtime.reset()
    bench.realtime.take_length(0, 1.0, None)
    bench.emit_more(5)
    before = bench.realtime.status()
    slept: list[int] = []

    def sleep_once() -> None:
        if not slept:
            slept.append(len(bench.emitted))
            time.sleep(0.1)

    bench.on_emit = sleep_once
    bench.emit_more(5)
    after = bench.realtime.status()
    missed, dropped = after.overruns - before.overruns, after.dropped - before.dropped
    assert missed >= 48
    assert missed - dropped >= 10
    assert dropped >= 38
    assert after.lateness is not None
    assert after.lateness.max_us > 90e3


class Violating(Muscle):
    """A fibre that cannot be stretched."""

    def step(self, state: Any, length_change_l0: float, calcium_um: float, dt_s: float) -> Any:
        """Fail beyond 0.1 L0."""
        if length_change_l0 > 0.1:
            raise StateViolation(self.fibre.name, "q2", 1e-4, -1.0, "0 to 1", "take a smaller step")
        return super().step(state, length_change_l0, calcium_um, dt_s)


def test_violation_stops_the_output_until_reset(make: Callable[..., Bench], muscle: Muscle) -> None:
    """One complaint, no more messages, and a new start."""
    bench = make(Violating(muscle.fibre))
    bench.realtime.take_calcium(0, 5.0)
    bench.realtime.take_length(0, 1.0, None)
    bench.emit_more(3)
    bench.realtime.take_length(0, 1.2, None)
    bench.until(lambda: bench.complaints)
    count = len(bench.emitted)
    time.sleep(0.05)
    assert len(bench.emitted) == count
    assert len(bench.complaints) == 1
    assert "18Dec2017a: state q2" in bench.complaints[0]
    assert bench.realtime.status().violations == 1
    bench.realtime.reset()
    bench.realtime.take_length(0, 1.0, None)
    bench.emit_more(3)
    assert bench.realtime.status().fault == ""


def test_stop_and_start_hold_the_state(make: Callable[..., Bench], muscle: Muscle) -> None:
    """A pause is no reset."""
    bench = make(muscle)
    bench.realtime.take_calcium(0, 5.0)
    bench.realtime.take_length(0, 1.0, None)
    bench.emit_more(3)
    bench.realtime.stop()
    held = bench.realtime._state
    assert held is not None
    bench.realtime.start()
    bench.emit_more(3)
    assert bench.realtime.status().waiting == ""
