"""The plant's side of the loop over DDS: lengths out, forces in, in lockstep with a muscle node."""

from __future__ import annotations

from contextlib import closing

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.node.client.link import Link
from xb_muscle_ros.plant.drives import FibreDrive, beyond
from xb_muscle_ros.plant.junction import Junction
from xb_muscle_ros.plant.loop import Muscles
from xb_muscle_ros.plant.muscle_end import MuscleEnd
from xb_muscle_ros.plant.plant import Array, Plant

_ANSWER_S = 10.0


class LiveDrive:
    """Muscles that are the fibres of a `muscle_node` in lockstep, until `close`."""

    def __init__(
        self,
        plant: Plant,
        fibre: Fibre,
        torque_nm: float,
        elastic: bool = False,
        domain_id: int | None = None,
        namespace: str = "",
    ) -> None:
        """Find the node and settle it at the plant's start.

        Args:
            plant: at its start.
            fibre: that the node's fibres shall be.
            torque_nm: see `FibreDrive`, which finds the calcium.
            elastic: tendons stretch, see `Junction`.
            domain_id: of ROS; None stands for that of the environment.
            namespace: of the node.

        Raises:
            UserError: the node is missing, not the right one, or does not answer.
        """
        self._plant = plant
        self._tick = 0
        calcium_um = FibreDrive(plant, fibre, torque_nm).calcium_um
        self.driven_by = {"calcium_um": calcium_um}
        self._link = Link("plant", namespace, domain_id)
        try:
            self._end = MuscleEnd(self._link, plant.muscles, fibre, "lockstep")
            self._end.find()
            path = plant.length_change_l0()
            self._force = self._end.settle(path, calcium_um)
            self._junction = Junction(plant.muscles, path, self._force) if elastic else None
        except BaseException:
            self.close()
            raise

    def pull(self) -> Array:
        """Send the fibres' lengths, wait for the forces of the same stamp, and apply them."""
        plant, path = self._plant, self._plant.length_change_l0()
        if self._tick:
            if self._junction is not None:
                self._junction.advance(path, self._force, plant.tick_s)
            stamp = round(self._tick * plant.tick_s * 1e9)
            said = beyond([muscle.name for muscle in plant.muscles], self.fibre_length_l0())
            if said:
                raise UserError(
                    f"the run ends at t = {1e-9 * stamp:.3f} s, angle {plant.angle_rad:.4f} rad: {said}, which the "
                    "node refuses; take a shorter --duration or a smaller --displacement"
                )
            self._end.send_length(stamp, path if self._junction is None else self._junction.length_l0)
            force = self._end.force(stamp, _ANSWER_S)
            if force is None:
                why = self._end.trouble or "see its log"
                raise UserError(
                    f"node {self._link.peer} did not answer the length at t = {1e-9 * stamp:g} s within "
                    f"{_ANSWER_S:g} s; {why}"
                )
            self._force = force
        self._tick += 1
        pull = self._force if self._junction is None else self._junction.pull_f0(path)
        plant.apply(pull)
        return plant.tendon_force_n(pull)

    def fibre_length_l0(self) -> Array:
        """Length changes of the fibres, shape (muscle,); on rigid tendons those of the plant."""
        return self._plant.length_change_l0() if self._junction is None else self._junction.length_l0.copy()

    def close(self) -> None:
        """Leave the graph."""
        self._link.close()


def over_ros(domain_id: int | None = None, namespace: str = "") -> Muscles:
    """Muscles that are the fibres of a muscle node, for `run_ankle` and `run_knee`; arguments as for `LiveDrive`."""

    def muscles(plant: Plant, fibre: Fibre | None, torque_nm: float, elastic: bool) -> closing[LiveDrive]:
        if fibre is None:
            raise UserError("MuJoCo's muscle is none of a muscle_node; give another model")
        return closing(LiveDrive(plant, fibre, torque_nm, elastic, domain_id, namespace))

    return muscles
