"""The realtime thread without ROS: settling, holding, extrapolating, catching up, stopping."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import pytest
from alone import Alone, batch_of, emitting
from realtime_bench import SETTINGS, Waiting

from xb_muscle_ros.errors import StateViolation, UserError
from xb_muscle_ros.models.muscle import Muscle, Outputs
from xb_muscle_ros.node.realtime import Realtime, Settings
from xb_muscle_ros.node.rules import Refusal, Scale


class Bench(Waiting):
    """A realtime thread, what it emitted and what it said."""

    def __init__(self, muscle: Muscle, settings: Settings, notes: Any) -> None:
        self.emitted: list[Outputs] = []
        self.notes = notes
        self.simulated = False
        self.on_emit: Callable[[], None] = lambda: None
        emit = emitting(self._emit)
        mode = Realtime(batch_of(muscle), settings, emit, time.monotonic_ns, notes, lambda: self.simulated)
        self.realtime: Any = Alone(mode)

    def _emit(self, stamp: int, outputs: Outputs, scale: Scale) -> None:
        self.emitted.append(outputs)
        self.on_emit()

    def state(self) -> dict[str, float]:
        """The newest state by name."""
        return dict(zip(self.realtime.batch.muscles[0].state_names, self.realtime._states[0].tolist(), strict=True))


@pytest.fixture
def make(started: list[Any], notes: Any) -> Callable[..., Bench]:
    """Benches whose threads end with the test."""

    def start(muscle: Muscle, settings: Settings = SETTINGS) -> Bench:
        bench = Bench(muscle, settings, notes)
        started.append(bench)
        bench.realtime.start()
        return bench

    return start


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
    assert bench.state()["length_change"] == pytest.approx(0.02, abs=1e-9)
    bench.realtime.take_length(0, 1.0, None)
    bench.emit_more(10)
    assert bench.state()["length_change"] == 0.0


def test_velocity_never_leads_out_of_what_is_allowed(make: Callable[..., Bench], muscle: Muscle) -> None:
    """The sample itself is the better guess then."""
    bench = make(muscle, SETTINGS._replace(extrapolate=True, extrapolation_limit_s=1.0))
    bench.realtime.take_calcium(0, 5.0)
    bench.realtime.take_length(0, 1.0, 900.0)
    bench.emit_more(10)
    assert bench.state()["length_change"] == 0.0
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
    bench.until(lambda: bench.notes.lines)
    count = len(bench.emitted)
    bench.rounds(25)
    assert len(bench.emitted) == count
    assert len(bench.notes.lines) == 1
    assert bench.notes.lines[0].startswith("error stopped: fibre 18Dec2017a: state q2")
    with pytest.raises(UserError, match=r"stepping has stopped: .*; call ~/reset first"):
        bench.realtime.save()
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
    assert bench.realtime._live.all()
    bench.realtime.start()
    bench.emit_more(3)
    assert bench.realtime.status().waiting == ""


WATCHED = SETTINGS._replace(extrapolate=True, timeout_s=0.1, extrapolation_limit_s=1.0)


@pytest.mark.parametrize("on_timeout", ["hold", "isometric", "decay"])
def test_length_that_stays_away(make: Callable[..., Bench], muscle: Muscle, on_timeout: str) -> None:
    """What each behaviour does to length, velocity and calcium, and that it ends with the next sample."""
    bench = make(muscle, WATCHED._replace(on_timeout=on_timeout, decay_s=0.05))
    bench.realtime.take_calcium(0, 30.0)
    bench.realtime.take_length(0, 1.0, 0.1)
    bench.until(lambda: bench.realtime.status().on_timeout)
    bench.emit_more(3)
    held = bench.state()
    assert held["velocity"] == 0.0
    # A tenth of a second at 0.1 L0/s, and the tick that noticed.
    assert held["length_change"] == (0.0 if on_timeout == "hold" else pytest.approx(0.01, abs=3e-4))
    force = bench.emitted[-1].force_f0
    bench.until(lambda: bench.state()["calcium"] < 30e-3 or on_timeout != "decay")
    bench.emit_more(20)
    later = bench.state()
    assert (later["length_change"], later["velocity"]) == (held["length_change"], 0.0)
    assert (later["calcium"] == 30.0) == (on_timeout != "decay")
    if on_timeout == "decay":
        assert bench.emitted[-1].force_f0 < 0.5 * force
    bench.realtime.take_length(0, 1.005, None)
    bench.until(lambda: not bench.realtime.status().on_timeout)
    assert bench.state()["length_change"] == 1.005 - 1.0
    assert bench.state()["calcium"] == 30.0
    assert bench.realtime.status().timeouts == 1
    away, back = bench.notes.lines[:2]
    assert away.startswith("error no length for 0.10")
    assert away.endswith(f", timeout_s is 0.1 s: {on_timeout}")
    assert back.startswith("info length is back after ")


def test_an_age_of_zero_allows_any(make: Callable[..., Bench], muscle: Muscle) -> None:
    """Off is off, and can be switched on and off while it runs; a pause is nobody's fault."""
    bench = make(muscle)
    bench.realtime.take_calcium(0, 5.0)
    bench.realtime.take_length(0, 1.0, None)
    bench.emit_more(60)
    assert bench.realtime.status().timeouts == 0
    bench.realtime.stop()
    bench.realtime.mode.settings = SETTINGS._replace(timeout_s=5.0)
    samples = bench.realtime._samples
    long_ago = samples.inputs.arrival_ns - 60 * 10**9
    samples.inputs = samples.inputs._replace(arrival_ns=long_ago, oldest_ns=int(long_ago[0]))
    bench.realtime.start()
    bench.emit_more(3)
    assert bench.notes.lines == []
    bench.realtime.mode.settings = SETTINGS._replace(timeout_s=0.001)
    bench.until(lambda: bench.realtime.status().on_timeout == "isometric")
    bench.realtime.mode.settings = SETTINGS
    bench.until(lambda: not bench.realtime.status().on_timeout)
    assert bench.notes.lines[-1] == "info timeout_s is 0 s now: isometric ends"


def test_a_snapshot_is_taken_up_while_running(make: Callable[..., Bench], muscle: Muscle) -> None:
    """The state goes on at the length it had, with the calcium it had, and stamps begin anew."""
    bench, other = make(muscle), make(muscle)
    with pytest.raises(UserError, match="no state to save yet"):
        bench.realtime.save()
    bench.realtime.take_calcium(10**12, 30.0)
    bench.realtime.take_length(10**12, 1.02, None)
    bench.emit_more(20)
    snapshot = bench.realtime.save()
    other.realtime.take_calcium(2 * 10**12, 0.01)
    other.realtime.take_length(2 * 10**12, 1.0, None)
    other.emit_more(3)
    other.realtime.load(snapshot)
    other.emitted.clear()
    other.emit_more(3)
    assert other.emitted[0].force_f0 == pytest.approx(bench.emitted[-1].force_f0, rel=1e-6)
    assert (other.state()["length_change"], other.state()["calcium"]) == (1.02 - 1.0, 30.0)
    # Not settled anew with the calcium it comes with: that would be no force at all.
    other.realtime.load(snapshot._replace(calcium=((0, 0.01),)))
    other.emitted.clear()
    other.emit_more(1)
    assert other.emitted[0].force_f0 > 0.4 * bench.emitted[-1].force_f0
    other.realtime.take_length(1, 1.01, None)
    other.emit_more(3)
    assert other.state()["length_change"] == 1.01 - 1.0
    other.realtime.stop()
    other.realtime.load(snapshot)
    other.emitted.clear()
    other.realtime.start()
    other.emit_more(1)
    assert other.emitted[0].force_f0 == pytest.approx(bench.emitted[-1].force_f0, rel=1e-6)


def test_simulated_time_may_go_back(make: Callable[..., Bench], muscle: Muscle) -> None:
    """With one notice and a state settled anew; refused where time is real."""
    bench = make(muscle)
    second = 10**9
    bench.realtime.take_calcium(9 * second, 30.0)
    bench.realtime.take_length(9 * second, 1.0, None)
    bench.emit_more(3)
    for take in (bench.realtime.take_length, lambda stamp, value, _: bench.realtime.take_calcium(stamp, value)):
        with pytest.raises(Refusal, match="came after"):
            take(second, 1.0, None)
    bench.simulated = True
    with pytest.raises(Refusal, match="velocity"):
        bench.realtime.take_length(second, 1.0, 1e6)
    assert bench.realtime.counts == {}
    bench.realtime.take_calcium(second, 5.0)
    bench.realtime.take_length(second, 1.02, None)
    bench.emit_more(5)
    assert bench.emitted[-1].force_f0 == pytest.approx(muscle.outputs(muscle.settle(1.02 - 1.0, 5.0)).force_f0)
    assert bench.realtime.counts == {"time went back": 1}
    assert [line.split(":")[0] for line in bench.notes.lines] == [
        "warning length went back from 9.000000000 s to 1.000000000 s of simulated time"
    ]
