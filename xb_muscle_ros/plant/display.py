"""A MuJoCo body for viewers: ``joint_states``, and ``tf`` where its messages are there."""

# mypy: allow-untyped-calls

from __future__ import annotations

import importlib
from collections.abc import Sequence
from typing import Any

from geometry_msgs.msg import TransformStamped
from sensor_msgs.msg import JointState

from xb_muscle_ros.node.traffic import set_stamp

WORLD = "world"


class Display:
    """Publishes all hinge and slide joints, and poses of all bodies, of one model.

    ``joint_states``: position and velocity in rad and rad/s (slides: m and m/s), effort of the muscles in N·m (N).
    ``/tf``: each body by its place in the frame ``world``, named ``<namespace>/<body>``, or ``<body>`` without a
    namespace.
    """

    def __init__(self, node: Any, model: Any, data: Any) -> None:
        """Join the topics; a line in the log where ``tf`` cannot be published.

        Args:
            node: of rclpy.
            model, data: of MuJoCo; `data` is read whenever something is shown.
        """
        mj = importlib.import_module("mujoco")
        kinds = (int(mj.mjtJoint.mjJNT_HINGE), int(mj.mjtJoint.mjJNT_SLIDE))
        chosen = [i for i, kind in enumerate(model.jnt_type.tolist()) if kind in kinds]
        self._data = data
        self._position, self._velocity = model.jnt_qposadr[chosen], model.jnt_dofadr[chosen]
        self._joints = JointState(name=[model.joint(i).name or f"joint_{i}" for i in chosen])
        self._to_joints = node.create_publisher(JointState, "joint_states", 10)
        space = node.get_namespace().strip("/")
        names = [model.body(i).name or f"body_{i}" for i in range(1, model.nbody)]
        self._transforms = [_transform(f"{space}/{name}" if space else name) for name in names]
        self._to_tf, self._tf = None, None
        try:
            message = importlib.import_module("tf2_msgs.msg").TFMessage
        except ImportError as error:
            node.get_logger().info(
                f"tf is not published, joint_states is: {error}; tf needs the ROS package tf2_msgs (ros-jazzy-tf2-msgs)"
            )
        else:
            self._tf = message(transforms=self._transforms)
            self._to_tf = node.create_publisher(message, "/tf", 100)

    def show(self, stamp: int) -> None:
        """Publish the moment of `data`; stamp in ns."""
        data, joints = self._data, self._joints
        set_stamp(joints, stamp)
        joints.position = data.qpos[self._position].tolist()
        joints.velocity = data.qvel[self._velocity].tolist()
        joints.effort = data.qfrc_actuator[self._velocity].tolist()
        self._to_joints.publish(joints)
        if self._to_tf is not None:
            self.transforms(stamp)
            self._to_tf.publish(self._tf)

    def transforms(self, stamp: int) -> Sequence[TransformStamped]:
        """Place of each body, filled in anew by every call; stamp in ns."""
        data = self._data
        for made, position, turn in zip(self._transforms, data.xpos[1:].tolist(), data.xquat[1:].tolist(), strict=True):
            set_stamp(made, stamp)
            at, rotation = made.transform.translation, made.transform.rotation
            at.x, at.y, at.z = position
            rotation.w, rotation.x, rotation.y, rotation.z = turn
        return self._transforms


def _transform(child: str) -> TransformStamped:
    made = TransformStamped(child_frame_id=child)
    made.header.frame_id = WORLD
    return made
