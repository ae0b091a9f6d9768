"""What viewers get of a body."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

mujoco = pytest.importorskip("mujoco", reason="needs the extra mujoco")
pytest.importorskip("rclpy", reason="needs ROS")

TWO_LINKS = """
<mujoco><worldbody>
  <body name="upper"><joint name="shoulder" axis="0 1 0"/><geom size=".1" mass="1"/>
    <body name="lower" pos="0 0 -.5"><joint name="elbow" axis="0 1 0"/><joint name="along" type="slide"/>
      <geom size=".1" mass="1"/></body></body>
  <body name="loose"><freejoint name="float"/><geom size=".1" mass="1"/></body>
</worldbody><actuator><motor joint="elbow"/></actuator></mujoco>"""


def test_joints_and_places_of_a_moment(new_domain: Callable[[], int]) -> None:
    """Hinges and slides by name, not free bodies; a place for every body in the world's frame, prefixed."""
    from sensor_msgs.msg import JointState

    from xb_muscle_ros.node.client.link import Link
    from xb_muscle_ros.plant.display import Display

    model = mujoco.MjModel.from_xml_string(TWO_LINKS)
    data = mujoco.MjData(model)
    with Link("display", "/left/leg", new_domain()) as link:
        display = Display(link.node, model, data)
        heard: list[JointState] = []
        link.node.create_subscription(JointState, "joint_states", heard.append, 10)
        data.qpos[:3] = 0.5 * np.pi, 0.3, 0.02
        data.qvel[:3] = 1.0, 2.0, 3.0
        data.ctrl[0] = 4.0
        mujoco.mj_forward(model, data)
        # Until both ends know of each other nothing arrives.
        for _ in range(100):
            display.show(1_500_000_000)
            if link.wait_for(lambda: bool(heard), 0.1):
                break
        message = heard[0]
        assert list(message.name) == ["shoulder", "elbow", "along"]
        assert list(message.position) == data.qpos[:3].tolist()
        assert list(message.velocity) == [1.0, 2.0, 3.0]
        assert list(message.effort) == [0.0, 4.0, 0.0]
        assert (message.header.stamp.sec, message.header.stamp.nanosec) == (1, 500_000_000)
        places = {made.child_frame_id: made for made in display.transforms(2_000_000_000)}
        assert set(places) == {"left/leg/upper", "left/leg/lower", "left/leg/loose"}
        lower = places["left/leg/lower"]
        assert lower.header.frame_id == "world"
        assert lower.header.stamp.sec == 2
        at, turn = lower.transform.translation, lower.transform.rotation
        assert (at.x, at.y, at.z) == tuple(data.xpos[2])
        assert (turn.w, turn.x, turn.y, turn.z) == tuple(data.xquat[2])


@pytest.mark.slow
def test_places_go_out_on_tf(new_domain: Callable[[], int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Over DDS with a package tf2_msgs, ROS' or a stand-in, and read by another reader of its public definition."""
    from rosbags.typesys import Stores, get_typestore

    monkeypatch.syspath_prepend(str(Path(__file__).parent))
    import tf_stand_in

    own: dict[str, str] = {}
    if importlib.util.find_spec("tf2_msgs") is None:
        if not tf_stand_in.can_be_made():
            pytest.skip("needs tf2_msgs, or ROS' generators and a compiler")
        own = tf_stand_in.make(tmp_path / "tf2_msgs")
    root = Path(__file__).resolve().parents[2]
    before = {"PYTHONPATH": f"{root}:{os.environ.get('PYTHONPATH', '')}"}
    merged = {name: f"{path}:{before.get(name, os.environ.get(name, ''))}" for name, path in own.items()}
    command = [sys.executable, str(Path(__file__).with_name("tf_listener.py")), str(new_domain()), TWO_LINKS, "0.7"]
    environment = {**os.environ, **before, **merged}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr
    assert "tf is not published" not in done.stderr
    data = bytes.fromhex(done.stdout.split()[-1])
    read = get_typestore(Stores.ROS2_JAZZY).deserialize_cdr(data, "tf2_msgs/msg/TFMessage")
    model = mujoco.MjModel.from_xml_string(TWO_LINKS)
    at = mujoco.MjData(model)
    at.qpos[0] = 0.7
    mujoco.mj_forward(model, at)
    assert [made.child_frame_id for made in read.transforms] == ["leg/upper", "leg/lower", "leg/loose"]
    for k, made in enumerate(read.transforms, 1):
        place, turn = made.transform.translation, made.transform.rotation
        assert (made.header.frame_id, made.header.stamp.sec, made.header.stamp.nanosec) == ("world", 1, 500_000_000)
        assert [place.x, place.y, place.z] == at.xpos[k].tolist()
        assert [turn.w, turn.x, turn.y, turn.z] == at.xquat[k].tolist()
