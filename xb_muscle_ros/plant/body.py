"""One episode of a scene, tick by tick: lengths to ask for, forces to go on with."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.plant.drives import FibreDrive, beyond, without_parallel
from xb_muscle_ros.plant.junction import Junction
from xb_muscle_ros.plant.plant import Architecture, Array, Plant
from xb_muscle_ros.plant.reflex import NO_REFLEX, Reflex, levels_by_tick
from xb_muscle_ros.plant.translation import RampAndHold


class Joints(NamedTuple):
    """Joints of a body at one moment: names, angles (rad), their rates, and the muscles' torques (N·m)."""

    names: Sequence[str]
    angle_rad: Sequence[float]
    velocity_rad_per_s: Sequence[float]
    torque_nm: Sequence[float]


class MovedBody(Protocol):
    """A body whose muscles are elsewhere and answer each tick's lengths with forces.

    Attributes:
        muscles: in the order of all arrays of shape (muscle,).
        fibres: that they must be.
        tick_s: length of one tick.
        tick: how many were played since the start.
        reflexive: whether calcium changes.
        model, data: MuJoCo's, for viewers.
    """

    muscles: Sequence[Architecture]
    fibres: Sequence[Fibre]
    tick_s: float
    tick: int
    reflexive: bool
    model: Any
    data: Any

    def restart(self) -> None:
        """Back to the start, at rest."""

    @property
    def length_l0(self) -> Array:
        """Length changes of the fibres, shape (muscle,)."""

    @property
    def velocity_l0_per_s(self) -> Array:
        """Their rates."""

    @property
    def calcium(self) -> Sequence[tuple[int, Array]]:
        """Calcium (µM), shape (muscle,), with the tick whose beginning it holds from.

        First that with which the fibres come to the lengths of now, then what is known of the ticks to come.
        """

    @property
    def over(self) -> str:
        """Why the body cannot go on, with the remedy; empty where it can."""

    @property
    def state(self) -> str:
        """Where the body is, in words."""

    @property
    def joints(self) -> Joints:
        """Its joints."""

    def advance(self, force_f0: Array) -> None:
        """Go on by one tick with the fibres' forces (F0), shape (muscle,), at the lengths of now."""


class Body:
    """A scene with one joint; see `MovedBody`. In the scene of the knee fibres have no parallel element."""

    def __init__(
        self, scene: str, fibre: Fibre, platform: RampAndHold, elastic: bool, reflex: Reflex = NO_REFLEX
    ) -> None:
        """Stand at the start.

        Args:
            scene: one of `SCENES`.
            fibre: model and parameters of the muscles.
            platform: how the ground moves in the scene of the ankle.
            elastic: tendons stretch, see `Junction`.
            reflex: of the muscles.

        Raises:
            UserError: no MuJoCo, the start cannot be held, or the reflex does not fit.
        """
        self._plant = plant = Plant(scene)
        self.muscles: Sequence[Architecture] = plant.muscles
        self.tick_s = plant.tick_s
        bare = without_parallel(fibre) if scene == "knee" else fibre
        self.fibres: Sequence[Fibre] = [bare] * len(plant.muscles)
        torque = plant.constant("tone_nm") if scene == "knee" else plant.load_nm()
        self._drive = FibreDrive(plant, bare, torque)
        self._start_n = self._drive.pull()
        self._platform = platform if scene == "ankle" else None
        self._elastic = elastic
        self._of_reflex = reflex
        self.reflexive = reflex.works
        self.model, self.data = plant.engine
        self.restart()

    def restart(self) -> None:
        """Back to the start, at rest."""
        plant = self._plant
        plant.reset(plant.start_rad)
        self.tick = 0
        self._torque_nm = 0.0
        self._calcium_um = self._drive.level()
        self._reflex = self._drive.reflex_loop(self._of_reflex)
        force = self._start_n / plant.tendon_force_n(np.ones(len(plant.muscles)))
        self._junction = Junction(plant.muscles, plant.length_change_l0(), force) if self._elastic else None

    @property
    def length_l0(self) -> Array:
        """Length changes of the fibres, shape (muscle,)."""
        return self._plant.length_change_l0() if self._junction is None else self._junction.length_l0

    @property
    def velocity_l0_per_s(self) -> Array:
        """Their rates."""
        return self._plant.velocity_l0_per_s() if self._junction is None else self._junction.velocity_l0_per_s

    @property
    def calcium(self) -> Sequence[tuple[int, Array]]:
        """See `MovedBody`; without a reflex one value for good."""
        return levels_by_tick(self._calcium_um, self._reflex, self.tick)

    @property
    def over(self) -> str:
        """Which muscle's fibre is asked for a length that no fibre has; empty where none is."""
        said = beyond([muscle.name for muscle in self.muscles], self.length_l0)
        remedy = "so no muscle can answer; take a shorter duration_s or a gentler movement of the platform"
        return f"{said}, {remedy}" if said else ""

    @property
    def state(self) -> str:
        """Where the body is, in words."""
        plant = self._plant
        return (
            f"t = {self.tick * self.tick_s:.3f} s, angle {plant.angle_rad:.4f} rad, "
            f"velocity {plant.velocity_rad_per_s:.4f} rad/s, torque of the muscles {self._torque_nm:.4g} N·m"
        )

    @property
    def joints(self) -> Joints:
        """The one joint, called after the scene."""
        plant = self._plant
        return Joints([plant.scene], [plant.angle_rad], [plant.velocity_rad_per_s], [self._torque_nm])

    def advance(self, force_f0: Array) -> None:
        """Go on by one tick with the fibres' forces (F0) at the lengths of now.

        Raises:
            UserError: a tendon whose fibre pulls like that has no length.
        """
        plant, junction = self._plant, self._junction
        if self._reflex is not None:
            self._calcium_um = self._reflex.observe(self.length_l0, force_f0)
        try:
            pull = force_f0 if junction is None else junction.pull_f0(plant.length_change_l0())
            plant.apply(pull)
            self._torque_nm = float(np.dot(plant.lengthening_m_per_rad(), plant.tendon_force_n(pull)))
            at = self.tick * self.tick_s
            plant.step(0.0 if self._platform is None else self._platform.mean_acceleration(at, self.tick_s))
            self.tick += 1
            if junction is not None:
                junction.advance(plant.length_change_l0(), force_f0, self.tick_s)
        except OverflowError as error:
            raise UserError(f"forces of {force_f0} F0 stretch a tendon beyond all measure ({error})") from error
