"""Messages between a node and ordinary ends of ROS, in this process: as bytes and as whole messages."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import pytest

NAMES = ["left", "right", "back"]


def said(message: Any) -> tuple[Any, ...]:
    """Stamp, names and numbers."""
    fields = (list(values) for values in (message.position, message.velocity, message.effort))
    return message.header.stamp.nanosec, list(message.name), *fields


def answers(domain: int, namespace: str, as_bytes: bool, names: list[str], monkeypatch: pytest.MonkeyPatch) -> Any:
    """What a node in lockstep, with `fibers` NAMES, answers to messages of an ordinary publisher, by topic."""
    import rclpy
    from rclpy.context import Context
    from rclpy.parameter import Parameter
    from sensor_msgs.msg import JointState

    from xb_muscle_ros.node import traffic
    from xb_muscle_ros.node.muscle_node import MuscleNode
    from xb_muscle_ros.node.program import make_executor

    if not as_bytes:
        monkeypatch.setattr(traffic, "_MIDDLEWARE", ())
    context = Context()
    context.init(args=[], domain_id=domain)
    executor = make_executor(context)
    values: dict[str, Any] = {"mode": "lockstep", "fiber_file": "18Dec2017a", "fibers": NAMES}
    given = {"context": context, "namespace": namespace, "use_global_arguments": False}
    muscle = MuscleNode(parameter_overrides=[Parameter(name, value=value) for name, value in values.items()], **given)
    other = rclpy.create_node("other", **given)
    heard: dict[str, list[Any]] = {"force": [], "moments": []}

    def until(holds: Callable[[], bool]) -> None:
        end = time.monotonic() + 20.0
        while not holds():
            assert time.monotonic() < end
            executor.spin_once(timeout_sec=0.05)

    try:
        muscle.autostart()
        for topic, kept in heard.items():
            other.create_subscription(JointState, f"muscle/{topic}", kept.append, 100)
        senders = [other.create_publisher(JointState, f"muscle/{topic}", 100) for topic in ("calcium", "length")]
        for node in (muscle, other):
            executor.add_node(node)
        until(lambda: all(sender.get_subscription_count() for sender in senders))
        until(lambda: all(other.count_publishers(f"muscle/{topic}") for topic in heard))
        until(lambda: all(arrivals.publishers for arrivals in muscle._listening.arrivals.values()))
        until(lambda: all(outlet.get_subscription_count() for outlet in muscle._outlets))
        stepping: Any = muscle._stepping
        for k in range(6):
            # Also in another order than the node's, and with velocities, which lockstep does not need.
            order = names if k % 3 else names[::-1]
            message = JointState(name=order)
            message.header.stamp.nanosec = 1_000_000 * k
            for i, (sender, base) in enumerate(zip(senders, (5.0, 1.0), strict=True)):
                # The length after the calcium has arrived.
                until(lambda k=k, i=i: i == 0 or max(t.run.calcium_samples for t in stepping._timelines) > k)
                message.position = [base * (1.0 + 1e-3 * k * (1 + NAMES.index(name))) for name in order]
                message.velocity = [0.0] * len(order) if k % 2 else []
                sender.publish(message)
            until(lambda k=k: all(len(kept) == k + 1 for kept in heard.values()))
        return {topic: [said(message) for message in kept] for topic, kept in heard.items()}
    finally:
        muscle.close()
        for node in (muscle, other):
            executor.remove_node(node)
            node.destroy_node()
        executor.shutdown()
        context.try_shutdown()


@pytest.mark.parametrize("names", [NAMES, ["right", "left"]])
def test_bytes_and_whole_messages_say_the_same(domain: int, monkeypatch: pytest.MonkeyPatch, names: list[str]) -> None:
    """To the bit, in force and moments, for all fibres of a node and for some."""
    space = f"/traffic_{len(names)}"
    quick, whole = (answers(domain, f"{space}_{b}", b, names, monkeypatch) for b in (True, False))
    assert quick == whole
    assert [stamp for stamp, *_ in quick["force"]] == [1_000_000 * k for k in range(6)]
    present = [name for name in NAMES if name in names]
    assert all(found == present for _, found, *_ in quick["force"])
    assert all(len(position) == 6 * len(names) and not velocity for _, _, position, velocity, _ in quick["moments"])
    assert all(min(effort) > 0.0 for *_, effort in quick["force"])


def test_bytes_that_are_no_message_are_refused_in_a_line() -> None:
    """What comes after them is read as before; an executor would end with any other error."""
    from rclpy.serialization import serialize_message
    from sensor_msgs.msg import JointState

    from xb_muscle_ros.node.rules import Refusal
    from xb_muscle_ros.node.traffic import hearing

    taken: list[Any] = []
    refused: list[Refusal] = []
    heard = hearing(taken.append, True, refused.append)
    data = serialize_message(JointState(name=NAMES, position=[1.0, 2.0, 3.0]))
    for sent in (data, data[:-9], data[:40], b"", data):
        heard(sent)
    assert [joints.position.tolist() for joints in taken] == [[1.0, 2.0, 3.0]] * 2
    assert len(refused) == 3
    assert str(refused[1]).startswith("not readable: 40 bytes are no sensor_msgs/JointState; look for")
