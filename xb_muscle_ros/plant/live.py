"""The plant's side of the loop over DDS: lengths out, forces in, in lockstep with a muscle node."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.node.client.link import Link
from xb_muscle_ros.plant.drives import FibreDrive, RunEnded, beyond
from xb_muscle_ros.plant.junction import Junction
from xb_muscle_ros.plant.loop import Muscles
from xb_muscle_ros.plant.muscle_end import MuscleEnd
from xb_muscle_ros.plant.plant import Array, Plant
from xb_muscle_ros.plant.reflex import NO_REFLEX, Reflex


class LiveDrive:
    """Muscles that are the fibres of a `muscle_node` in lockstep, until `close`."""

    def __init__(
        self,
        plant: Plant,
        fibre: Fibre,
        torque_nm: float,
        elastic: bool = False,
        reflex: Reflex = NO_REFLEX,
        domain_id: int | None = None,
        namespace: str = "",
    ) -> None:
        """Find the node and settle it at the plant's start.

        Args:
            plant: at its start.
            fibre: that the node's fibres shall be.
            torque_nm: see `FibreDrive`, which finds the calcium.
            elastic: tendons stretch, see `Junction`.
            reflex: changes calcium from then on.
            domain_id: of ROS; None stands for that of the environment.
            namespace: of the node.

        Raises:
            UserError: the node is missing, not the right one, or does not answer, or the reflex does not fit.
        """
        self._plant = plant
        self._tick = 0
        drive = FibreDrive(plant, fibre, torque_nm)
        self._reflex = drive.reflex_loop(reflex)
        self.driven_by = {"calcium_um": drive.calcium_um}
        self._level = drive.level()
        self._link = Link("plant", namespace, domain_id)
        try:
            self._end = MuscleEnd(self._link, plant.muscles, [fibre] * len(plant.muscles), "lockstep")
            self._end.find()
            path = plant.length_change_l0()
            self._force = self._end.settle(path, self._level)
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
            stamp = self._stamp(self._tick)
            said = beyond([muscle.name for muscle in plant.muscles], self.fibre_length_l0())
            if said:
                raise RunEnded(
                    f"the run ends at t = {1e-9 * stamp:.3f} s, angle {plant.angle_rad:.4f} rad: {said}, which the "
                    "node refuses; take a shorter --duration or a smaller --displacement"
                )
            self._end.send_length(stamp, path if self._junction is None else self._junction.length_l0)
            self._force = self._end.answer(stamp)
        if self._reflex is not None:
            self._level = self._reflex.observe(self.fibre_length_l0(), self._force)
            self._end.send_calcium(self._stamp(self._tick + self._reflex.ticks), self._reflex.ahead)
        self._tick += 1
        pull = self._force if self._junction is None else self._junction.pull_f0(path)
        plant.apply(pull)
        return plant.tendon_force_n(pull)

    def _stamp(self, tick: int) -> int:
        return round(tick * self._plant.tick_s * 1e9)

    def fibre_length_l0(self) -> Array:
        """Length changes of the fibres, shape (muscle,); on rigid tendons those of the plant."""
        return self._plant.length_change_l0() if self._junction is None else self._junction.length_l0.copy()

    def level(self) -> Array:
        """Calcium of the coming tick, shape (muscle,), µM."""
        return self._level

    def check_calcium(self) -> None:
        """See whether the node had all calcium in time.

        Raises:
            UserError: it had not, so that forces are not those of the reflex.
        """
        if self._reflex is not None:
            self._end.check_calcium(
                self._reflex.ticks + 1, "take a longer delay of the reflex, or leave the machine more time"
            )

    def close(self) -> None:
        """Leave the graph."""
        self._link.close()


def over_ros(domain_id: int | None = None, namespace: str = "") -> Muscles:
    """Muscles that are the fibres of a muscle node, for `run_ankle` and `run_knee`; arguments as for `LiveDrive`."""

    @contextmanager
    def muscles(
        plant: Plant, fibre: Fibre | None, torque_nm: float, elastic: bool, reflex: Reflex
    ) -> Iterator[LiveDrive]:
        if fibre is None:
            raise UserError("MuJoCo's muscle is none of a muscle_node; give another model")
        drive = LiveDrive(plant, fibre, torque_nm, elastic, reflex, domain_id, namespace)
        try:
            yield drive
            drive.check_calcium()
        finally:
            drive.close()

    return muscles
