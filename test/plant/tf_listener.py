"""Shows one moment of a body, hears it on /tf, and prints its bytes: run by a test, in an environment with tf2_msgs."""

from __future__ import annotations

import sys

from rclpy.serialization import serialize_message

from xb_muscle_ros.node.client.link import Link
from xb_muscle_ros.plant.display import Display
from xb_muscle_ros.plant.engine import mujoco


def main() -> None:
    """Arguments: domain, the model's XML, angle of the first joint (rad)."""
    from tf2_msgs.msg import TFMessage

    domain, text, angle_rad = sys.argv[1:]
    mj = mujoco()
    model = mj.MjModel.from_xml_string(text)
    data = mj.MjData(model)
    data.qpos[0] = float(angle_rad)
    mj.mj_forward(model, data)
    heard: list[TFMessage] = []
    with Link("display", "/leg", int(domain)) as link:
        display = Display(link.node, model, data)
        link.node.create_subscription(TFMessage, "/tf", heard.append, 10)
        for _ in range(100):
            display.show(1_500_000_000)
            if link.wait_for(lambda: bool(heard), 0.1):
                break
    print(serialize_message(heard[0]).hex())


if __name__ == "__main__":
    main()
