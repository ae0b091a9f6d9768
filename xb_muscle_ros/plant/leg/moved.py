"""The standing leg as a body whose muscles are elsewhere; see `xb_muscle_ros.plant.body.MovedBody`."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from xb_muscle_ros.models.fibre_file import Fibre, load_fibre
from xb_muscle_ros.plant.body import Joints
from xb_muscle_ros.plant.drives import beyond
from xb_muscle_ros.plant.leg.body import Body
from xb_muscle_ros.plant.leg.drives import make_fibres
from xb_muscle_ros.plant.leg.episode import JOINTS, fallen, feet_of
from xb_muscle_ros.plant.leg.live import architectures
from xb_muscle_ros.plant.leg.stance import Aim, find_stance
from xb_muscle_ros.plant.plant import Architecture, Array
from xb_muscle_ros.plant.reflex import NO_REFLEX, Reflex, levels_by_tick
from xb_muscle_ros.plant.translation import RampAndHold


class StandingLeg:
    """MyoLeg in its stance, the ground moved. The first tick takes no time: the fibres step once where they settled."""

    def __init__(
        self, source: str, model: str, platform: RampAndHold, elastic: bool, reflex: Reflex = NO_REFLEX
    ) -> None:
        """Find the stance and the calcium that holds it.

        Args:
            source: fibre file or name of a fibre.
            model: parameter set, without relations of force and length.
            platform: how the ground moves.
            elastic: tendons stretch.
            reflex: of the muscles.

        Raises:
            UserError: no MuJoCo, no myo-sim, an unknown fibre or model, or no stance.
        """
        fibre = load_fibre(source, model)
        self._body = body = Body()
        self._stance = find_stance(body, Aim())
        self._drive = make_fibres(fibre, source, elastic, reflex)(body, self._stance)
        self._cross_bridges = self._drive.muscles
        self.muscles: Sequence[Architecture] = architectures(self._drive)
        self.fibres: Sequence[Fibre] = self._cross_bridges.fibres
        self.tick_s = body.tick_s
        self.reflexive = reflex.works
        self.model, self.data = body.model, body.data
        self._platform = platform
        self.restart()

    def restart(self) -> None:
        """Back to the stance, at rest."""
        body = self._body
        body.mj.mj_resetData(body.model, body.data)
        body.frame_accelerates(0.0)
        body.place(self._stance.qpos)
        self.tick = 0
        self._calcium_um = self._drive.calcium_um
        self._reflex = self._drive.reflex_loop()
        self._first, self._ankle, self._feet = body.com_m, body.ankle_m, feet_of(body)
        self._length_l0 = self._cross_bridges.length_change_l0(body.data)
        self._fallen = ""

    @property
    def length_l0(self) -> Array:
        """Length changes of fibres and tendons, shape (muscle,)."""
        return self._length_l0

    @property
    def velocity_l0_per_s(self) -> Array:
        """Their rates."""
        rate: Array = self.data.actuator_velocity[self._cross_bridges.index] / self._cross_bridges.l0_m
        return rate

    @property
    def calcium(self) -> Sequence[tuple[int, Array]]:
        """See `MovedBody`."""
        return levels_by_tick(self._calcium_um, self._reflex, self.tick)

    @property
    def over(self) -> str:
        """Whether the body fell, or which fibre is asked for a length that none has."""
        if self._fallen:
            return f"the body fell: {self._fallen}"
        said = beyond(self._cross_bridges.names, self._length_l0)
        remedy = "so no muscle can answer; take a shorter duration_s or a gentler movement of the platform"
        return f"{said}, {remedy}" if said else ""

    @property
    def state(self) -> str:
        """Where the centre of mass is, and the ankles' angle."""
        body, way = self._body, self._body.com_m - self._first
        time_s, forward, up = max(self.tick - 1, 0) * self.tick_s, float(way @ body.FORWARD), float(way[2])
        return (
            f"t = {time_s:.3f} s, centre of mass {forward:+.4f} m forward and {up:+.4f} m up from its start, "
            f"ankles {body.angle_rad('ankle_angle'):.4f} rad"
        )

    @property
    def joints(self) -> Joints:
        """Ankles, knees and hips: means of both sides, torques summed."""
        body = self._body
        rates = [float(np.mean(body.data.qvel[body.dofs(name)])) for name in JOINTS]
        angles, torques = map(body.angle_rad, JOINTS), (-body.muscle_torque_nm(name) for name in JOINTS)
        return Joints(JOINTS, [*angles], rates, [*torques])

    def advance(self, force_f0: Array) -> None:
        """Go on by one tick with the fibres' forces (F0) at the lengths of now."""
        body, data = self._body, self.data
        data.ctrl[self._cross_bridges.index] = -self._cross_bridges.f0_n * force_f0
        if self.tick:
            if self._reflex is not None:
                fibre_l0 = self._cross_bridges.fibre_change_l0(self._length_l0, force_f0)
                self._calcium_um = self._reflex.observe(fibre_l0, force_f0)
            com, height = body.com_m, float(self._first[2] - self._ankle[2])
            body.mj.mj_step2(body.model, data)
            self._fallen = fallen(com, height, self._ankle, self._feet, body)
        at = self.tick * self.tick_s
        body.frame_accelerates(self._platform.mean_acceleration(at, self.tick_s))
        body.mj.mj_step1(body.model, data)
        self._length_l0 = self._cross_bridges.length_change_l0(data)
        self.tick += 1
