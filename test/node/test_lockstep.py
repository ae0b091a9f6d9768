"""Lockstep without ROS: any stream of input leaves finite output or a clear stop."""

from __future__ import annotations

import contextlib
import dataclasses
import itertools
import math
from typing import Any

import pytest
from alone import Alone, batch_of, emitting
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from xb_muscle_ros.errors import StateViolation, UserError
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.node.lockstep import Lockstep
from xb_muscle_ros.node.rules import Refusal, Scale
from xb_muscle_ros.node.status import Account

SCALE = Scale(1.0, 1.0)
SECOND = 1_000_000_000


def build(muscle: Muscle, emitted: list[Any], notes: Any, simulated: bool = False) -> Any:
    """Keeps stamp and outputs of every answer."""
    emit = emitting(lambda stamp, out, scale: emitted.append((stamp, out)))
    return Alone(Lockstep(batch_of(muscle), emit, notes, lambda: simulated))


def test_calcium_far_ahead_and_missing_stamps_are_told(muscle: Muscle, notes: Any) -> None:
    """What is kept of calcium is bounded, and a refusal says so; without stamps no reset helps."""
    lockstep = build(muscle, [], notes)
    for k in range(1025):
        lockstep.take_calcium(SECOND + k * SECOND // 100, 5.0)
    with pytest.raises(Refusal, match=r"waiting for calcium: .*the newest 1024 are kept and all are later"):
        lockstep.take_length(SECOND, 1.0, None)
    lockstep.reset()
    lockstep.take_calcium(0, 5.0)
    lockstep.take_length(0, 1.0, None)
    with pytest.raises(Refusal, match=r"not after the last: .*give each message a stamp of its own"):
        lockstep.take_length(0, 1.0, None)


class Violating(Muscle):
    """A fibre whose states leave their bounds in the step to 1.3 s."""

    def step(self, state: Any, length_change_l0: float, calcium_um: float, dt_s: float) -> Any:
        """Fail where asked to stretch by 0.2 L0."""
        if length_change_l0 > 0.19:
            raise StateViolation(self.fibre.name, "q2", 1e-4, -1.0, "0 to 1", "take a smaller step")
        return super().step(state, length_change_l0, calcium_um, dt_s)


def test_violation_stops_until_reset(muscle: Muscle, notes: Any) -> None:
    """The error names fibre, state and time; nothing is emitted; reset recovers."""
    emitted: list[Any] = []
    lockstep = build(Violating(muscle.fibre), emitted, notes)
    lockstep.take_calcium(0, 5.0)
    lockstep.take_length(1_200_000_000, 1.0, None)
    with pytest.raises(UserError, match=r"18Dec2017a: state q2 .* step from 1.200000000 s to 1.300000000 s"):
        lockstep.take_length(1_300_000_000, 1.2, None)
    with pytest.raises(Refusal, match="call ~/reset"):
        lockstep.take_length(1_400_000_000, 1.0, None)
    status = lockstep.status()
    assert (status.violations, status.ticks) == (1, 1)
    assert "state q2" in status.fault
    assert [stamp for stamp, _ in emitted] == [1_200_000_000]
    with pytest.raises(UserError, match=r"stepping has stopped: .*state q2.*; call ~/reset first"):
        lockstep.save()
    assert lockstep.reset() == Account(1, 1, 0)
    lockstep.take_calcium(0, 5.0)
    lockstep.take_length(0, 1.0, None)
    assert lockstep.status().fault == ""
    assert [stamp for stamp, _ in emitted] == [1_200_000_000, 0]


def test_a_jump_faster_than_any_muscle_is_refused(muscle: Muscle, notes: Any) -> None:
    """0.4 L0 within 1 µs is a mistake, and the next sample is not punished for it."""
    emitted: list[Any] = []
    lockstep = build(muscle, emitted, notes)
    lockstep.take_calcium(0, 5.0)
    lockstep.take_length(0, 1.0, None)
    with pytest.raises(Refusal, match=r"velocity from the last sample to this is 400000 L0/s"):
        lockstep.take_length(1_000, 1.4, None)
    lockstep.take_length(1_000_000, 1.001, None)
    assert [stamp for stamp, _ in emitted] == [0, 1_000_000]


def sweep(lockstep: Any, first_s: float = 0.0, samples: int = 40) -> None:
    """A slow stretch in steps of 10 ms, with its calcium before its length."""
    start = round(first_s * SECOND)
    lockstep.take_calcium(start, 5.0)
    for k in range(samples):
        if k == samples // 2:
            lockstep.take_calcium(start + k * 10_000_000, 20.0)
        lockstep.take_length(start + k * 10_000_000, 1.0 + 1e-4 * k, None)


def test_a_loop_in_simulated_time_starts_anew_with_one_notice(muscle: Muscle, notes: Any) -> None:
    """Every turn gives the bits of the first."""
    emitted: list[Any] = []
    lockstep = build(muscle, emitted, notes, simulated=True)
    for _ in range(3):
        sweep(lockstep)
    assert len(emitted) == 120
    assert emitted[:40] == emitted[40:80] == emitted[80:]
    assert emitted[0][1] != emitted[39][1]
    assert lockstep.counts["time went back"] == 2
    assert len(notes.lines) == 2
    assert notes.lines[0].startswith(
        "warning length went back from 0.390000000 s to 0.000000000 s of simulated time: state forgotten after "
        "40 length and 2 calcium samples, 0 of them late"
    )
    assert lockstep.reset() == Account(40, 2, 0)


def test_time_does_not_go_back_where_it_is_not_simulated(muscle: Muscle, notes: Any) -> None:
    """Refused, and the run goes on as if nothing had come."""
    emitted: list[Any] = []
    lockstep = build(muscle, emitted, notes)
    sweep(lockstep)
    with pytest.raises(Refusal, match=r"calcium at 0\.0+ s came after"):
        lockstep.take_calcium(0, 1.0)
    with pytest.raises(Refusal, match=r"length at 0\.0+ s came after"):
        lockstep.take_length(0, 1.0, None)
    lockstep.take_length(SECOND, 1.0, None)
    assert len(emitted) == 41
    assert notes.lines == []


def test_jitter_and_bad_samples_do_not_take_time_back(muscle: Muscle, notes: Any) -> None:
    """Neither a tenth of a second, nor a length that no muscle has."""
    emitted: list[Any] = []
    lockstep = build(muscle, emitted, notes, simulated=True)
    sweep(lockstep)
    for stamp, length, reason in ((290_000_000, 1.0, "came after"), (0, math.nan, "not finite"), (0, 7.0, "allowed")):
        with pytest.raises(Refusal, match=reason):
            lockstep.take_length(stamp, length, None)
    lockstep.take_calcium(380_000_000, 20.0)
    for stamp in (380_000_000, 350_000_000):
        with pytest.raises(Refusal, match="came after"):
            lockstep.take_calcium(stamp, 1.0)
    assert lockstep.counts["time went back"] == 0
    lockstep.take_length(SECOND, 1.0, None)
    assert len(emitted) == 41


def test_calcium_and_length_may_go_back_in_either_order(muscle: Muscle, notes: Any) -> None:
    """The last lengths of the old turn go on with its calcium; the first of the new one have the new."""
    emitted: list[Any] = []
    lockstep = build(muscle, emitted, notes, simulated=True)
    sweep(lockstep, first_s=5.0)
    lockstep.take_calcium(0, 1.0)
    lockstep.take_calcium(20_000_000, 2.0)
    lockstep.take_length(5 * SECOND + 400_000_000, 1.0, None)
    assert lockstep.save().state[-1] == 20.0
    assert lockstep.counts["calcium before its length went back"] == 2
    lockstep.take_length(0, 1.0, None)
    assert lockstep.save().state[-1] == 1.0
    # Calcium of the old turn that comes late does not stand in the way of the new one's.
    lockstep.take_calcium(5 * SECOND + 500_000_000, 30.0)
    lockstep.take_calcium(30_000_000, 3.0)
    for k, calcium in ((1, 1.0), (2, 1.0), (3, 2.0), (4, 3.0), (5, 3.0)):
        lockstep.take_length(k * 10_000_000, 1.0, None)
        assert lockstep.save().state[-1] == calcium
    # Length first: it waits until its calcium is there.
    sweep(lockstep, first_s=5.0)
    lockstep.reset()
    sweep(lockstep, first_s=5.0)
    with pytest.raises(Refusal, match="waiting for calcium"):
        lockstep.take_length(0, 1.0, None)
    assert lockstep.status().waiting
    lockstep.take_calcium(5_000_000, 4.0)
    lockstep.take_length(10_000_000, 1.0, None)
    assert lockstep.save().state[-1] == 4.0


def test_going_back_ends_a_stop_and_takes_new_constants(muscle: Muscle, notes: Any) -> None:
    """As a reset does."""
    scales: list[Scale] = []
    emit = emitting(lambda stamp, out, scale: scales.append(scale))
    lockstep = Alone(Lockstep(batch_of(Violating(muscle.fibre)), emit, notes, lambda: True))
    lockstep.take_calcium(0, 5.0)
    lockstep.take_length(SECOND, 1.0, None)
    with pytest.raises(UserError, match="state q2"):
        lockstep.take_length(SECOND + 10_000_000, 1.2, None)
    lockstep.replace(0, dataclasses.replace(muscle.fibre, reference_length_m=2.0, f0_n=3.0))
    with pytest.raises(Refusal, match="stopped"):
        lockstep.take_length(2 * SECOND, 1.0, None)
    lockstep.take_length(0, 2.0, None)
    assert lockstep.status().fault == ""
    assert scales == [SCALE, Scale(2.0, 3.0)]


def test_calcium_that_holds_since_before_stays(muscle: Muscle, notes: Any) -> None:
    """Sent once and never again, it serves every turn."""
    emitted: list[Any] = []
    lockstep = build(muscle, emitted, notes, simulated=True)
    lockstep.take_calcium(0, 5.0)
    for stamp in (SECOND, 2 * SECOND, SECOND, 2 * SECOND):
        lockstep.take_length(stamp, 1.0, None)
    assert emitted[2:] == emitted[:2]
    lockstep.take_calcium(3 * SECOND, 20.0)
    assert len(lockstep.save().calcium) == 2
    lockstep.take_length(SECOND, 1.0, None)
    assert lockstep.save().calcium == ((0, 5.0),)


@pytest.mark.parametrize("calcium_first", [True, False])
def test_calcium_of_the_same_stamp_serves_every_turn(muscle: Muscle, notes: Any, calcium_first: bool) -> None:
    """A bag with one calcium sample, which comes before or after the first length; another value would count."""
    lockstep = build(muscle, [], notes, simulated=True)
    for calcium_um in (5.0, 5.0, 7.0):
        for is_calcium in (calcium_first, not calcium_first):
            if is_calcium:
                lockstep.take_calcium(SECOND, calcium_um)
            else:
                with contextlib.suppress(Refusal):
                    lockstep.take_length(SECOND, 1.0, None)
        lockstep.take_length(SECOND + 10_000_000, 1.0, None)
        lockstep.take_length(SECOND + 500_000_000, 1.0, None)
        assert lockstep.save().state[-1] == calcium_um
    assert lockstep.counts["time went back"] == 2


def test_a_snapshot_goes_on_to_the_bit(muscle: Muscle, notes: Any) -> None:
    """Calcium that was sent ahead, late counts and all; what another run took meanwhile is gone."""
    whole: list[Any] = []
    halves: list[Any] = []
    first, other = build(muscle, whole, notes), build(muscle, halves, notes)
    with pytest.raises(UserError, match="no state to save yet"):
        first.save()
    first.take_calcium(0, 5.0)
    for k in range(10):
        first.take_length(k * 10_000_000, 1.0 + 1e-3 * k, None)
    first.take_calcium(50_000_000, 7.0)
    first.take_calcium(120_000_000, 20.0)
    snapshot = first.save()
    sweep(other, first_s=7.0)
    halves.clear()
    other.load(snapshot)
    for lockstep in (first, other):
        for k in range(10, 30):
            lockstep.take_length(k * 10_000_000, 1.0 + 1e-3 * k, None)
    assert halves == whole[10:]
    assert first.reset() == other.reset() == Account(30, 3, 1)


def test_a_snapshot_knows_what_calcium_would_be_late(muscle: Muscle, notes: Any) -> None:
    """Refused or counted as it would have been without the break."""
    first, other = build(muscle, [], notes), build(muscle, [], notes)
    first.take_calcium(0, 5.0)
    for k in range(10):
        first.take_length(k * 10_000_000, 1.0, None)
    other.load(first.save())
    with pytest.raises(Refusal, match="came after"):
        other.take_calcium(0, 5.0)
    other.take_calcium(80_000_000, 5.0)
    other.take_calcium(90_000_000, 5.0)
    assert other.reset() == Account(10, 3, 1)


NUMBERS = st.one_of(
    st.floats(0.8, 1.2), st.floats(0.0, 100.0), st.sampled_from([math.nan, math.inf, -math.inf, 0.0, -1.0, 1e300])
)
STAMPS = st.one_of(st.integers(0, 5_000_000_000), st.sampled_from([-(10**18), -1, 10**18]))
EVENTS = st.lists(st.tuples(st.sampled_from(["length", "calcium", "reset"]), STAMPS, NUMBERS), max_size=60)


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(EVENTS, st.booleans())
def test_any_stream_leaves_finite_output(
    muscle: Muscle, notes: Any, events: list[tuple[str, int, float]], simulated: bool
) -> None:
    """Whatever comes in whatever order: refused, stopped with a reason, or a finite force."""
    emitted: list[Any] = []
    lockstep = build(muscle, emitted, notes, simulated)
    for kind, stamp, value in events:
        try:
            if kind == "length":
                lockstep.take_length(stamp, value, None)
            elif kind == "calcium" and 0.0 <= value <= 1e4:
                lockstep.take_calcium(stamp, value)
            elif kind == "reset":
                lockstep.reset()
        except Refusal:
            continue
        except UserError:
            assert lockstep.status().fault
    assert all(math.isfinite(x) for _, out in emitted for x in out)
    stamps = [stamp for stamp, _ in emitted]
    resets = sum(kind == "reset" for kind, *_ in events) + lockstep.counts["time went back"]
    assert sum(later <= earlier for earlier, later in itertools.pairwise(stamps)) <= resets
