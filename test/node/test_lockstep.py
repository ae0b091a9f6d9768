"""Lockstep without ROS: any stream of input leaves finite output or a clear stop."""

from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from xb_muscle_ros.errors import StateViolation, UserError
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.node.inputs import Refusal, Scale
from xb_muscle_ros.node.lockstep import Lockstep
from xb_muscle_ros.node.status import Account

SCALE = Scale(1.0, 1.0)


class Violating(Muscle):
    """A fibre whose states leave their bounds in the step to 1.3 s."""

    def step(self, state: Any, length_change_l0: float, calcium_um: float, dt_s: float) -> Any:
        """Fail where asked to stretch by 0.2 L0."""
        if length_change_l0 > 0.19:
            raise StateViolation(self.fibre.name, "q2", 1e-4, -1.0, "0 to 1", "take a smaller step")
        return super().step(state, length_change_l0, calcium_um, dt_s)


def test_violation_stops_until_reset(muscle: Muscle) -> None:
    """The error names fibre, state and time; nothing is emitted; reset recovers."""
    emitted: list[int] = []
    lockstep = Lockstep(Violating(muscle.fibre), SCALE, lambda stamp, out, scale: emitted.append(stamp))
    lockstep.take_calcium(0, 5.0)
    lockstep.take_length(1_200_000_000, 1.0, None)
    with pytest.raises(UserError, match=r"18Dec2017a: state q2 .* step from 1.200000000 s to 1.300000000 s"):
        lockstep.take_length(1_300_000_000, 1.2, None)
    with pytest.raises(Refusal, match="call ~/reset"):
        lockstep.take_length(1_400_000_000, 1.0, None)
    status = lockstep.status()
    assert (status.violations, status.ticks) == (1, 1)
    assert "state q2" in status.fault
    assert emitted == [1_200_000_000]
    assert lockstep.reset() == Account(1, 1, 0)
    lockstep.take_calcium(0, 5.0)
    lockstep.take_length(0, 1.0, None)
    assert lockstep.status().fault == ""
    assert emitted == [1_200_000_000, 0]


def test_a_jump_faster_than_any_muscle_is_refused(muscle: Muscle) -> None:
    """0.4 L0 within 1 µs is a mistake, and the next sample is not punished for it."""
    emitted: list[int] = []
    lockstep = Lockstep(muscle, SCALE, lambda stamp, out, scale: emitted.append(stamp))
    lockstep.take_calcium(0, 5.0)
    lockstep.take_length(0, 1.0, None)
    with pytest.raises(Refusal, match=r"velocity from the last sample to this is 400000 L0/s"):
        lockstep.take_length(1_000, 1.4, None)
    lockstep.take_length(1_000_000, 1.001, None)
    assert emitted == [0, 1_000_000]


NUMBERS = st.one_of(
    st.floats(0.8, 1.2), st.floats(0.0, 100.0), st.sampled_from([math.nan, math.inf, -math.inf, 0.0, -1.0, 1e300])
)
STAMPS = st.one_of(st.integers(0, 5_000_000_000), st.sampled_from([-(10**18), -1, 10**18]))
EVENTS = st.lists(st.tuples(st.sampled_from(["length", "calcium", "reset"]), STAMPS, NUMBERS), max_size=60)


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(EVENTS)
def test_any_stream_leaves_finite_output(muscle: Muscle, events: list[tuple[str, int, float]]) -> None:
    """Whatever comes in whatever order: refused, stopped with a reason, or a finite force."""
    emitted: list[Any] = []
    lockstep = Lockstep(muscle, SCALE, lambda stamp, out, scale: emitted.append(out))
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
    assert all(math.isfinite(x) for out in emitted for x in out)
