"""Whole nodes in this process, fed message by message: whatever comes, forces are finite and the node goes on."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

FIBRE = "18Dec2017a"
SECOND = 10**9
MANY = ["left", "right", "back"]


class Rig:
    """An active node without a thread: its ticks are called here, one after every message."""

    def __init__(self, context: Any, mode: str, names: list[str]) -> None:
        from rclpy.parameter import Parameter

        from xb_muscle_ros.node.muscle_node import MuscleNode

        values: dict[str, Any] = {"mode": mode, "fiber_file": FIBRE, "timeout_s": 0.004, "on_timeout": "decay"}
        values["extrapolate"] = True
        if len(names) > 1:
            values["fibers"] = names
        overrides = [Parameter(name, value=value) for name, value in values.items()]
        self.node = MuscleNode(
            context=context,
            namespace=f"/{mode}_{len(names)}",
            parameter_overrides=overrides,
            use_global_arguments=False,
        )
        self.node.autostart()
        self.names = names
        self.realtime = mode == "realtime"
        self.stepping: Any = self.node._stepping
        self.inlet: Any = self.node._inlet
        self.stepping.stop()
        self.answers: list[Any] = []
        emit = self.stepping._emit

        def keep(*arguments: Any) -> None:
            self.answers.append(arguments[2])
            emit(*arguments)

        self.stepping._emit = keep
        self.now_ns = 0

    def tick(self) -> None:
        """What the thread does, a millisecond after the last time."""
        if self.realtime:
            self.now_ns += 1_000_000
            self.stepping._dt = 1e-3
            if self.stepping._ready():
                self.stepping._tick(self.now_ns)
                self.stepping._done()

    def message(self, stamp_ns: int, names: list[str], position: list[float], velocity: list[float]) -> Any:
        """What a JointState says."""
        from sensor_msgs.msg import JointState

        from xb_muscle_ros.node.joint_state import Joints

        message = JointState(name=names, position=position, velocity=velocity)
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp_ns, SECOND)
        return Joints.of(message)

    def numbers(self) -> list[float]:
        """All outputs so far."""
        return [value for answer in self.answers for value in answer.ravel().tolist()]


@pytest.fixture(scope="module")
def rigs(domain: int) -> Iterator[dict[tuple[str, int], Rig]]:
    """Both modes, with one fibre and with many."""
    from rclpy.context import Context

    context = Context()
    context.init(args=[], domain_id=domain)
    made = {
        (mode, len(names)): Rig(context, mode, names) for mode in ("lockstep", "realtime") for names in ([FIBRE], MANY)
    }
    yield made
    for rig in made.values():
        rig.node.close()
        rig.node.destroy_node()
    context.try_shutdown()


ODD = [math.nan, math.inf, -math.inf, 0.0, -1.0, 1e300, -1e300, 5e-324]
LENGTH = st.one_of(st.floats(0.9, 1.1), st.floats(0.9, 1.1), st.sampled_from(ODD))
VELOCITY = st.one_of(st.floats(-2.0, 2.0), st.sampled_from(ODD))
CALCIUM = st.one_of(st.floats(0.0, 100.0), st.sampled_from(ODD))
# Mostly a little later, at times the same, earlier, much later, or of another clock.
STEPS = st.sampled_from([1_000_000] * 6 + [1, 0, -1_000_000, -(10**9), 50_000_000, 10**9, 4000 * 10**9])
WHOSE = st.lists(st.sampled_from(["0", "1", "2", "0", "ghost", "", "ghost/q0"]), max_size=4)
EVENT = st.tuples(
    st.sampled_from(["length"] * 5 + ["calcium"] * 3 + ["reset", "tick"]),
    STEPS,
    WHOSE,
    st.sampled_from([0, 0, 0, 0, -1, 1]),
    st.sampled_from(["none", "none", "full", "wrong"]),
    st.lists(st.tuples(LENGTH, VELOCITY, CALCIUM), min_size=5, max_size=5),
)


@pytest.mark.slow
@pytest.mark.parametrize("count", [1, 3])
@pytest.mark.parametrize("mode", ["lockstep", "realtime"])
@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@example(events=[])
@given(events=st.lists(EVENT, max_size=30))
def test_any_stream_leaves_finite_output_and_a_running_node(
    rigs: dict[tuple[str, int], Rig], mode: str, count: int, events: list[Any]
) -> None:
    """Order, gaps, repeats, odd numbers, huge steps, absent velocities, wrong names and sizes; then a good stream."""
    rig = rigs[mode, count]
    rig.stepping.reset()
    rig.answers.clear()
    stamp = SECOND
    for kind, ahead, whose, excess, velocity, values in events:
        stamp = min(max(stamp + ahead, 0), 2**31 * SECOND - 1)
        known = [rig.names[int(w) % count] if w.isdigit() else w for w in whose]
        size = max((len(known) or count) + excess, 0)
        lengths, rates, calcium = zip(*(values * 2)[:size], strict=True) if size else ((), (), ())
        if kind == "reset":
            rig.stepping.reset()
        elif kind == "calcium":
            rig.inlet.take_calcium(rig.message(stamp, known, list(calcium), []))
        elif kind == "length":
            speeds = {"none": [], "full": list(rates), "wrong": [*rates, 0.0]}[velocity]
            rig.inlet.take_length(rig.message(stamp, known, list(lengths), speeds))
        rig.tick()
    assert all(map(math.isfinite, rig.numbers()))
    rig.stepping.reset()
    rig.answers.clear()
    rig.inlet.take_calcium(rig.message(stamp, rig.names, [5.0] * count, []))
    for k in range(5):
        rig.inlet.take_length(rig.message(stamp + k * 1_000_000, rig.names, [1.0 + 1e-3 * k] * count, []))
        rig.tick()
    # In realtime the first tick settles.
    assert len(rig.answers) == (4 if rig.realtime else 5)
    forces = [answer[:, 0].tolist() for answer in rig.answers]
    assert all(len(row) == count and 0.5 < value < 2.0 for row in forces for value in row)
    assert rig.stepping.status().violations == 0
