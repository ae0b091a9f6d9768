"""The plant's end of the wires to a muscle node: lengths and calcium out, forces in, all muscles in one message."""

# mypy: allow-untyped-calls

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.node.client.link import Link
from xb_muscle_ros.node.client.wires import Sender, reliable
from xb_muscle_ros.node.diagnostics import status_name
from xb_muscle_ros.node.joint_state import Joints
from xb_muscle_ros.node.traffic import subscribe
from xb_muscle_ros.plant.plant import Architecture, Array

FIND_S = 10.0
ANSWER_S = 10.0
_HANDSHAKE_S = 1.0


class MuscleEnd:
    """One muscle node that has a fibre for each muscle of a plant, named after it.

    Lengths and forces on the wires are those of the muscles, in m and N.

    Attributes:
        forces: F0, shape (muscle,), by stamp (ns), until taken.
        newest: the newest of them and when it arrived (steady, s); None before the first.
        trouble: what the node's diagnostics said last, where that was not that all is well.
        stuck: whether that is an error, which no further length will mend.
    """

    def __init__(self, link: Link, muscles: Sequence[Architecture], fibres: Sequence[Fibre], mode: str) -> None:
        """Join the topics of the link's namespace.

        Args:
            link: to the node.
            muscles: of the plant.
            fibres: model and parameters of each muscle, all of one model and method.
            mode: ``lockstep`` or ``realtime``.
        """
        self.forces: dict[int, Array] = {}
        self.newest: tuple[Array, float] | None = None
        self.trouble = ""
        self.stuck = False
        self._link = link
        self._fibres = fibres
        self._mode = mode
        self._names = tuple(m.name for m in muscles)
        self._l0_m = np.array([m.l0_m for m in muscles])
        self._f0_n = np.array([m.f0_n for m in muscles])
        self._length, self._calcium = (Sender(link.node, f"muscle/{t}", self._names) for t in ("length", "calcium"))
        # Samples of calcium since the last reset that `settle` made.
        self._sent = 0
        self._inlets = (
            subscribe(link.node, "muscle/force", self._on_force, reliable()),
            link.node.create_subscription(DiagnosticArray, "/diagnostics", self._on_diagnostics, 10),
        )

    @property
    def command(self) -> str:
        """How to start such a node."""
        space, fibre = self._link.node.get_namespace(), self._fibres[0]
        where = "" if space == "/" else f" -r __ns:={space}"
        return (
            f"muscle_node --ros-args{where} -p fiber_file:={fibre.path or fibre.name} "
            f'-p model:={fibre.model} -p mode:={self._mode} -p "fibers:=[{", ".join(self._names)}]"'
        )

    def find(self, timeout_s: float = FIND_S) -> bool:
        """Find the node, and give it the muscles' parameters; whether it had others.

        Raises:
            UserError: there is none, or it is not active, has another model, method or mode, or other fibres.
        """
        link, fibre = self._link, self._fibres[0]
        link.find(timeout_s, self.command)
        wanted: dict[str, object] = {"mode": self._mode, "model": fibre.model, "method": fibre.method}
        found = link.check(wanted, self.command, [f"{name}.constants.f0_n" for name in self._names])
        missing = [name for name in self._names if f"{name}.constants.f0_n" not in found]
        if missing:
            raise UserError(
                f"node {link.peer} has no fibre '{missing[0]}'; end the node and start another: {self.command}"
            )
        link.check_active()
        given = self._parameters()
        there = link.parameters([*given])
        other = {name: value for name, value in given.items() if there.get(name) != value}
        if other:
            link.set_parameters(other)
        return bool(other)

    def settle(self, length_l0: Array, calcium_um: Array, timeout_s: float = FIND_S) -> Array:
        """Forces (F0) of fibres that settled at lengths (L0) with calcium (µM), after a reset, both stamped 0.

        Again from a reset while the node's answers may not find their way yet.

        Raises:
            UserError: no answer.
        """

        def send() -> None:
            self.forces.clear()
            self._sent = 0
            self.send_calcium(0, calcium_um)
            self.send_length(0, length_l0)

        if not self._link.begin(send, lambda: 0 in self.forces, timeout_s, _HANDSHAKE_S):
            raise UserError(f"node {self._link.peer} did not answer within {timeout_s:g} s; see its log")
        return self.forces.pop(0)

    def force(self, stamp: int, timeout_s: float) -> Array | None:
        """Forces of a stamp (ns) in F0, waited for; None where they do not come."""
        self._link.wait_for(lambda: stamp in self.forces, timeout_s)
        return self.forces.pop(stamp, None)

    def answer(self, stamp: int) -> Array:
        """Forces of a stamp (ns) in F0.

        Raises:
            UserError: they do not come; with what the node says of itself.
        """
        force = self.force(stamp, ANSWER_S)
        if force is None:
            raise UserError(
                f"node {self._link.peer} did not answer the length at t = {1e-9 * stamp:g} s within {ANSWER_S:g} s; "
                f"{self.trouble or 'see its log'}"
            )
        return force

    def send_length(self, stamp: int, length_l0: Array, velocity_l0_per_s: Array | None = None) -> None:
        """Publish length changes (L0) as lengths in m, with velocities where given; stamp in ns."""
        velocity = None if velocity_l0_per_s is None else velocity_l0_per_s * self._l0_m
        self._length.send(stamp, (1.0 + length_l0) * self._l0_m, velocity)

    def send_calcium(self, stamp: int, calcium_um: Array) -> None:
        """Publish calcium (µM), shape (muscle,); stamp in ns."""
        self._calcium.send(stamp, calcium_um)
        self._sent += len(self._names)

    def check_calcium(self, spare: int, remedy: str) -> None:
        """Reset the node, and see whether it had all calcium since the last `settle` in time.

        Args:
            spare: messages at the end that no step needed, and that may still be on their way.
            remedy: ends the line.

        Raises:
            UserError: it had not.
        """
        account = self._link.reset()
        if account.calcium < self._sent - spare * len(self._names) or account.late:
            raise UserError(f"node {self._link.peer} took {account}; {self._sent} calcium samples were sent; {remedy}")

    def _parameters(self) -> dict[str, object]:
        made: dict[str, object] = {}
        for name, fibre, l0_m, f0_n in zip(
            self._names, self._fibres, self._l0_m.tolist(), self._f0_n.tolist(), strict=True
        ):
            made[f"{name}.constants.reference_length_m"] = l0_m
            made[f"{name}.constants.f0_n"] = f0_n
            made.update({f"{name}.models.{fibre.model}.{key}": value for key, value in fibre.values.items()})
        return made

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            if self._link.peer and status.name == status_name(self._link.peer):
                self.trouble = "" if status.level == DiagnosticStatus.OK else status.message
                self.stuck = status.level == DiagnosticStatus.ERROR

    def _on_force(self, message: Joints) -> None:
        if message.names == self._names:
            force: Array = message.effort / self._f0_n
            if self._mode == "lockstep":
                self.forces[message.stamp_ns] = force
            self.newest = force, time.monotonic()
