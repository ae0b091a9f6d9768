"""What the programs of nodes share, over DDS."""

from __future__ import annotations

import time

import pytest


def test_what_a_subscription_still_had_to_tell_ends_nothing(domain: int) -> None:
    """An event is taken from the middleware after its subscription was given up."""
    pytest.importorskip("rclpy", reason="needs ROS 2")
    from rclpy.qos import QoSProfile, ReliabilityPolicy
    from sensor_msgs.msg import JointState

    from xb_muscle_ros.node.client.link import Link

    reliable = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE)
    with Link("left", domain_id=domain) as link:
        heard: list[JointState] = []
        left = link.node.create_subscription(JointState, "left", heard.append, reliable)
        link.node.create_subscription(JointState, "kept", heard.append, reliable)
        link.wait_for(lambda: False, 0.1)
        link.node.create_publisher(JointState, "left", QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT))
        # The event is at hand before it is served; there is nothing to wait for that would not serve it.
        time.sleep(0.5)
        link.node.destroy_subscription(left)
        kept = link.node.create_publisher(JointState, "kept", reliable)

        def came() -> bool:
            kept.publish(JointState(name=["kept"]))
            return bool(heard)

        assert link.wait_for(came, 20.0)
        assert heard[0].name == ["kept"]
