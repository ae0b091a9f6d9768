"""One episode of a scene, tick by tick: lengths to ask for, forces to go on with."""

from __future__ import annotations

import numpy as np

from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.plant.drives import FibreDrive, beyond, without_parallel
from xb_muscle_ros.plant.junction import Junction
from xb_muscle_ros.plant.plant import Array, Plant
from xb_muscle_ros.plant.translation import RampAndHold


class Body:
    """A scene whose muscles are elsewhere and answer each tick's lengths with forces.

    Attributes:
        plant: the scene.
        fibre: that its muscles must be; in the scene of the knee without its parallel element.
        calcium_um: by muscle, holds the start.
    """

    def __init__(self, scene: str, fibre: Fibre, platform: RampAndHold, elastic: bool) -> None:
        """Stand at the start.

        Args:
            scene: one of `SCENES`.
            fibre: model and parameters of the muscles.
            platform: how the ground moves in the scene of the ankle.
            elastic: tendons stretch, see `Junction`.

        Raises:
            UserError: no MuJoCo, or the start cannot be held.
        """
        self.plant = Plant(scene)
        self.fibre = without_parallel(fibre) if scene == "knee" else fibre
        torque = self.plant.constant("tone_nm") if scene == "knee" else self.plant.load_nm()
        drive = FibreDrive(self.plant, self.fibre, torque)
        self.calcium_um = drive.calcium_um
        self._start_n = drive.pull()
        self._platform = platform if scene == "ankle" else None
        self._elastic = elastic
        self.restart()

    def restart(self) -> None:
        """Back to the start, at rest."""
        plant = self.plant
        plant.reset(plant.start_rad)
        self.tick = 0
        self.torque_nm = 0.0
        force = self._start_n / plant.tendon_force_n(np.ones(len(plant.muscles)))
        self._junction = Junction(plant.muscles, plant.length_change_l0(), force) if self._elastic else None

    @property
    def length_l0(self) -> Array:
        """Length changes of the fibres, shape (muscle,)."""
        return self.plant.length_change_l0() if self._junction is None else self._junction.length_l0

    @property
    def velocity_l0_per_s(self) -> Array:
        """Their rates."""
        return self.plant.velocity_l0_per_s() if self._junction is None else self._junction.velocity_l0_per_s

    @property
    def beyond(self) -> str:
        """Which muscle's fibre is asked for a length that no fibre has; empty where none is."""
        return beyond([muscle.name for muscle in self.plant.muscles], self.length_l0)

    @property
    def state(self) -> str:
        """Where the body is, in words."""
        plant = self.plant
        return (
            f"t = {self.tick * plant.tick_s:.3f} s, angle {plant.angle_rad:.4f} rad, "
            f"velocity {plant.velocity_rad_per_s:.4f} rad/s, torque of the muscles {self.torque_nm:.4g} N·m"
        )

    def advance(self, force_f0: Array) -> None:
        """Go on by one tick with the fibres' forces (F0) at the lengths of now."""
        plant, junction = self.plant, self._junction
        pull = force_f0 if junction is None else junction.pull_f0(plant.length_change_l0())
        plant.apply(pull)
        self.torque_nm = float(np.dot(plant.lengthening_m_per_rad(), plant.tendon_force_n(pull)))
        at = self.tick * plant.tick_s
        plant.step(0.0 if self._platform is None else self._platform.mean_acceleration(at, plant.tick_s))
        self.tick += 1
        if junction is not None:
            junction.advance(plant.length_change_l0(), force_f0, plant.tick_s)
