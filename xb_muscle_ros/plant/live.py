"""The plant's side of the loop over DDS: lengths out, forces in, in lockstep with one muscle node per muscle."""

# mypy: allow-untyped-calls

from __future__ import annotations

import time
from types import TracebackType
from typing import Any

import numpy as np
from rclpy.qos import QoSProfile, QoSReliabilityPolicy
from sensor_msgs.msg import JointState

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.node.inputs import stamp_ns
from xb_muscle_ros.node.link import Link
from xb_muscle_ros.plant.drives import FibreDrive
from xb_muscle_ros.plant.loop import DURATION_S, Trace, couple
from xb_muscle_ros.plant.plant import Array, Plant
from xb_muscle_ros.plant.translation import RampAndHold

_FIND_S = 10.0
_HANDSHAKE_S = 1.0
_ANSWER_S = 10.0


class LiveDrive:
    """Muscles that are `muscle_node`s in lockstep, in the namespaces ``/<muscle>``; ends with the ``with`` block."""

    def __init__(self, plant: Plant, fibre: Fibre, torque_nm: float, domain_id: int | None = None) -> None:
        """Find the nodes and settle them at the plant's start.

        Args:
            plant: at its start.
            fibre: that the nodes must have.
            torque_nm: see `FibreDrive`, which finds the calcium.
            domain_id: of ROS; None stands for that of the environment.

        Raises:
            UserError: a node is missing, not the right one, or does not answer.
        """
        self._plant = plant
        self._tick = 0
        self.activation = FibreDrive(plant, fibre, torque_nm).activation
        self._ends: list[_End] = []
        try:
            for muscle in plant.muscles:
                self._ends.append(_End(muscle.name, fibre, domain_id))
            for end, length in zip(self._ends, plant.length_change_l0().tolist(), strict=True):
                end.start(length, self.activation[end.muscle])
        except BaseException:
            self.close()
            raise

    def pull(self) -> Array:
        """Send the plant's lengths, wait for the forces of the same stamp, and apply them."""
        lengths = self._plant.length_change_l0().tolist()
        stamp = round(self._tick * self._plant.tick_s * 1e9)
        if self._tick:
            for end, length in zip(self._ends, lengths, strict=True):
                end.send_length(stamp, length)
        force = np.array([end.force(stamp) for end in self._ends])
        self._tick += 1
        self._plant.apply(force)
        return self._plant.tendon_force_n(force)

    def fibre_length_l0(self) -> Array:
        """Tendons are rigid: one length, one answer."""
        return self._plant.length_change_l0()

    def close(self) -> None:
        """Leave the graph."""
        for end in self._ends:
            end.link.close()

    def __enter__(self) -> LiveDrive:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


class _End:
    """One muscle's node, seen from here."""

    def __init__(self, muscle: str, fibre: Fibre, domain_id: int | None) -> None:
        self.muscle = muscle
        self._fibre = fibre
        self._forces: dict[int, float] = {}
        self.link = Link("plant_node", f"/{muscle}", domain_id)
        try:
            qos = QoSProfile(depth=100, reliability=QoSReliabilityPolicy.RELIABLE)
            node = self.link.node
            self._length = node.create_publisher(JointState, "muscle/length", qos)
            self._calcium = node.create_publisher(JointState, "muscle/calcium", qos)
            self._inlet = node.create_subscription(JointState, "muscle/force", self._on_force, qos)
            command = (
                f"muscle_node --ros-args -r __ns:=/{muscle} -p fiber_file:={fibre.path} -p model:={fibre.model} "
                "-p mode:=lockstep"
            )
            self.link.find(_FIND_S, command)
            wanted = {"mode": "lockstep", "fibre": fibre.name, "model": fibre.model, "method": fibre.method}
            found = self.link.parameters(list(wanted))
            for name, value in wanted.items():
                if found.get(name) != value:
                    raise UserError(
                        f"node {self.link.peer} has {name} = {found.get(name, 'none')}, needed is {value}; end the "
                        f"node and start another: {command}"
                    )
        except BaseException:
            self.link.close()
            raise

    def start(self, length_l0: float, calcium_um: float) -> None:
        """Settle the node; again from a reset while its answers may not find their way yet."""
        end = time.monotonic() + _FIND_S
        while time.monotonic() < end:
            self.link.reset()
            self._forces.clear()
            self._send(self._calcium, 0, calcium_um)
            self.send_length(0, length_l0)
            if self.link.wait_for(lambda: 0 in self._forces, _HANDSHAKE_S):
                return
        raise UserError(f"node {self.link.peer} did not answer within {_FIND_S:g} s; see its log")

    def send_length(self, stamp: int, length_l0: float) -> None:
        """Publish a length change in L0 as a length in m."""
        self._send(self._length, stamp, (1.0 + length_l0) * self._fibre.reference_length_m)

    def force(self, stamp: int) -> float:
        """Force of a stamp in F0, waited for."""
        if not self.link.wait_for(lambda: stamp in self._forces, _ANSWER_S):
            raise UserError(
                f"node {self.link.peer} did not answer the length at t = {1e-9 * stamp:g} s within {_ANSWER_S:g} s; "
                "see its log"
            )
        return self._forces.pop(stamp) / self._fibre.f0_n

    def _send(self, publisher: Any, stamp: int, value: float) -> None:
        message = JointState()
        message.name = [self._fibre.name]
        message.position = [value]
        message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp, 1_000_000_000)
        publisher.publish(message)

    def _on_force(self, message: JointState) -> None:
        self._forces[stamp_ns(message.header.stamp)] = float(message.effort[0])


def run_ankle_live(
    fibre: Fibre, platform: RampAndHold, duration_s: float = DURATION_S["ankle"], domain_id: int | None = None
) -> Trace:
    """`run_ankle` with muscle nodes in place of models in this process; see `LiveDrive`."""
    plant = Plant("ankle")
    with LiveDrive(plant, fibre, plant.load_nm(), domain_id) as drive:
        return couple(plant, fibre, drive, platform, duration_s)
