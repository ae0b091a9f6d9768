"""Plant and muscles stepped in turn, one muscle step to one tick of the plant, in one process."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass

import numpy as np

from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.node.rules import LENGTH_CHANGE_L0
from xb_muscle_ros.plant.drives import OWN, Drive, FibreDrive, OwnDrive, RunEnded, beyond, without_parallel
from xb_muscle_ros.plant.plant import Array, Plant
from xb_muscle_ros.plant.reflex import NO_REFLEX, Reflex
from xb_muscle_ros.plant.translation import RampAndHold

DURATION_S = {"ankle": 0.5, "knee": 4.0}
MOVE_RAD, MOVE_S = 0.35, 1.0
"""Movement of the leg before its release: 20 degrees down and up again."""


Muscles = Callable[[Plant, Fibre | None, float, bool, Reflex], AbstractContextManager[Drive]]
"""Makes the drive of a plant: takes the fibre (None: MuJoCo's muscle), the torque at the start (N·m), whether tendons
stretch, and the reflex."""


@contextmanager
def in_process(plant: Plant, fibre: Fibre | None, torque_nm: float, elastic: bool, reflex: Reflex) -> Iterator[Drive]:
    """Muscles in this process."""
    if fibre is None:
        yield OwnDrive(plant, torque_nm, reflex)
    else:
        yield FibreDrive(plant, fibre, torque_nm, elastic, reflex)


@dataclass(frozen=True)
class Trace:
    """What one model made of a scene, a row per tick; arrays are read-only.

    Attributes:
        scene, model: names; the model's is that of a parameter set, or ``mujoco``.
        fibre: name, empty for ``mujoco``.
        moved_before: the leg was moved before it was released.
        reflex: there was one.
        driven_by: at the start, of each muscle: ``calcium_um``, µM, or for ``mujoco`` ``activation``, 0 to 1.
        muscles: names, in the order of the columns below.
        time_s: shape (n,), from release or from the platform's first motion.
        angle_rad: shape (n,).
        force_n: shape (n, muscle), pull on the tendons.
        length_change_l0: shape (n, muscle), of the fibres.
        level: shape (n, muscle), what drives the muscles from each tick on, in the unit of `driven_by`; without a
            reflex it is constant.
        torque_nm: shape (n,), of all muscles together, positive where it resists the angle.
        load_nm_per_rad: stiffness that would just carry the load at the start (m·g·h when standing); negative: the load
            itself is stable.
        start_acceleration_rad_per_s2: of the angle at the start, before anything moves: 0 in equilibrium.
        ended: why the run ended before its time; empty where it did not.
    """

    scene: str
    model: str
    fibre: str
    moved_before: bool
    reflex: bool
    driven_by: dict[str, dict[str, float]]
    muscles: tuple[str, ...]
    time_s: Array
    angle_rad: Array
    force_n: Array
    length_change_l0: Array
    level: Array
    torque_nm: Array
    load_nm_per_rad: float
    start_acceleration_rad_per_s2: float
    ended: str = ""

    @property
    def label(self) -> str:
        """Model, whether it was moved before, and whether it has a reflex."""
        moved, reflex = ", moved before" * self.moved_before, ", reflex" * self.reflex
        return f"{self.model}{moved}{reflex}"

    @property
    def beyond(self) -> str:
        """Which muscle's fibre was first beyond the lengths that a fibre has, and when; empty where none was."""
        least, most = LENGTH_CHANGE_L0
        outside = ~np.all((self.length_change_l0 >= least) & (self.length_change_l0 <= most), axis=1)
        if not outside.any():
            return ""
        k = int(np.argmax(outside))
        return (
            f"{self.label}: {beyond(self.muscles, self.length_change_l0[k])}, from t = {self.time_s[k]:.3f} s on; "
            "what comes after that is no muscle's answer, so take a shorter --duration or a smaller --displacement"
        )

    @property
    def remark(self) -> str:
        """What is to be said of the run in one line: why it ended, or `beyond`; empty where all went well."""
        return f"{self.label}: {self.ended}" if self.ended else self.beyond


def run_ankle(
    fibre: Fibre | None,
    platform: RampAndHold,
    duration_s: float = DURATION_S["ankle"],
    elastic: bool = False,
    muscles: Muscles = in_process,
    reflex: Reflex = NO_REFLEX,
) -> Trace:
    """Stand at equilibrium, constant calcium, then be moved.

    Args:
        fibre: model of the muscles; None: MuJoCo's.
        platform: how the ground moves.
        duration_s: of the run.
        elastic: tendons stretch; MuJoCo's muscle has none.
        muscles: makes the drive.
        reflex: of the muscles.

    Raises:
        UserError: the stance cannot be held, no MuJoCo, or a reflex that does not fit. A body that moves further than
            its muscles reach ends the run with what went before, and says so in `Trace.ended`.
    """
    plant = Plant("ankle", own_muscles=fibre is None)
    with muscles(plant, fibre, plant.load_nm(), elastic, reflex) as drive:
        return _couple(plant, fibre, drive, platform, duration_s, reflex=reflex.works)


def run_knee(
    fibre: Fibre | None,
    moved_before: bool = False,
    duration_s: float = DURATION_S["knee"],
    elastic: bool = False,
    muscles: Muscles = in_process,
    reflex: Reflex = NO_REFLEX,
) -> Trace:
    """Hold the leg level with a toned muscle, then let go. See `run_ankle`.

    Args:
        fibre, elastic, muscles, reflex: see `run_ankle`. The reflex works while the leg is moved, too.
        moved_before: the hand that holds the leg first lowers and lifts it.
        duration_s: from the release.
    """
    plant = Plant("knee", own_muscles=fibre is None)
    bare = None if fibre is None else without_parallel(fibre)
    with muscles(plant, bare, plant.constant("tone_nm"), elastic, reflex) as drive:
        if moved_before:
            _move(plant, drive)
        return _couple(plant, bare, drive, None, duration_s, moved_before, reflex.works)


def _move(plant: Plant, drive: Drive) -> None:
    """Lower and lift the leg by `MOVE_RAD` in `MOVE_S` (one smooth cosine), and release it at once."""
    ticks = round(MOVE_S / plant.tick_s)
    for k in range(ticks):
        phase = 2.0 * math.pi * k / ticks
        plant.place(
            plant.start_rad + 0.5 * MOVE_RAD * (1.0 - math.cos(phase)), math.sin(phase) * math.pi * MOVE_RAD / MOVE_S
        )
        drive.pull()
    plant.place(plant.start_rad, 0.0)


def _couple(
    plant: Plant,
    fibre: Fibre | None,
    drive: Drive,
    platform: RampAndHold | None,
    duration_s: float,
    moved_before: bool = False,
    reflex: bool = False,
) -> Trace:
    """Step plant, at its start, and settled muscles in turn; see `run_ankle`."""
    load = _load_stiffness(plant)
    count = round(duration_s / plant.tick_s) + 1
    muscles = len(plant.muscles)
    time, angle, torque = np.zeros(count), np.zeros(count), np.zeros(count)
    force, length, level = (np.zeros((count, muscles)) for _ in range(3))
    start_acceleration, done, ended = 0.0, count, ""
    for k in range(count):
        time[k], angle[k] = plant.time_s, plant.angle_rad
        try:
            force[k] = drive.pull()
        except RunEnded as end:
            if k == 0:
                raise
            done, ended = k, str(end)
            break
        length[k], level[k] = drive.fibre_length_l0(), drive.level()
        torque[k] = np.dot(plant.lengthening_m_per_rad(), force[k])
        if k == 0:
            start_acceleration = plant.acceleration_rad_per_s2()
        plant.step(0.0 if platform is None else platform.mean_acceleration(k * plant.tick_s, plant.tick_s))
    time, angle, force, length, level, torque = (a[:done] for a in (time, angle, force, length, level, torque))
    for array in (time, angle, force, length, level, torque):
        array.setflags(write=False)
    return Trace(
        scene=plant.scene,
        model=OWN if fibre is None else fibre.model,
        fibre="" if fibre is None else fibre.name,
        moved_before=moved_before,
        reflex=reflex,
        driven_by=drive.driven_by,
        muscles=tuple(m.name for m in plant.muscles),
        time_s=time,
        angle_rad=angle,
        force_n=force,
        length_change_l0=length,
        level=level,
        torque_nm=torque,
        load_nm_per_rad=load,
        start_acceleration_rad_per_s2=start_acceleration,
        ended=ended,
    )


def _load_stiffness(plant: Plant, step_rad: float = 1e-5) -> float:
    """Change of the load's torque with the angle at the start, N·m/rad."""
    torques = []
    for sign in (1.0, -1.0):
        plant.place(plant.start_rad + sign * step_rad, 0.0)
        torques.append(plant.load_nm())
    plant.place(plant.start_rad, 0.0)
    return (torques[0] - torques[1]) / (2.0 * step_rad)
