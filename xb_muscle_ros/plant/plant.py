"""A MuJoCo scene with one joint: lengths of its muscles out, forces in. Knows nothing of muscle models and ROS."""

from __future__ import annotations

import importlib.resources
import math
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.errors import UserError, suggest
from xb_muscle_ros.plant.engine import mujoco

Array = npt.NDArray[np.float64]

SCENES = ("ankle", "knee")
GRAVITY_M_S2 = 9.81


class Architecture(NamedTuple):
    """What makes a muscle of a fibre: force, length and angle of the fibres, and the tendon's slack length."""

    name: str
    f0_n: float
    l0_m: float
    pennation_rad: float
    tendon_slack_m: float


class Plant:
    """One scene, stepped.

    Lengths are those of fibres on rigid tendons: the whole change of the path's length, less the share that pennation
    takes. A fibre at a constant angle a pulls with F·cos(a) and changes by cos(a) of the path, so that no power is lost
    between the two. Who wants an elastic tendon puts it between this length and the fibre's, as `FibreDrive` can.

    Attributes:
        scene: name.
        muscles: in the order of all arrays of shape (muscle,) here.
        tick_s: length of one step.
        version: of MuJoCo.
    """

    def __init__(self, scene: str, own_muscles: bool = False) -> None:
        """Load a scene and stand it at its start.

        Args:
            scene: one of `SCENES`.
            own_muscles: MuJoCo's muscles pull, by `activate`; forces of `apply` do otherwise.

        Raises:
            UserError: no such scene, or no MuJoCo.
        """
        if scene not in SCENES:
            raise UserError(f"scene '{scene}' is not known{suggest(scene, SCENES)}")
        self._mj = mujoco()
        text = importlib.resources.files(__package__).joinpath(f"{scene}.xml").read_text(encoding="utf-8")
        self._model = self._mj.MjModel.from_xml_string(text)
        self._data = self._mj.MjData(self._model)
        self.scene = scene
        self.version: str = self._mj.__version__
        self.tick_s = float(self._model.opt.timestep)
        names = [self._model.tendon(i).name for i in range(self._model.ntendon)]
        self.muscles = tuple(Architecture(name, *self._numeric(name)) for name in names)
        self._f0 = np.array([m.f0_n for m in self.muscles])
        self._l0 = np.array([m.l0_m for m in self.muscles])
        self._cos = np.array([math.cos(m.pennation_rad) for m in self.muscles])
        count = len(self.muscles)
        self._forces, self._own = slice(0, count), slice(count, 2 * count)
        self._model.opt.disableactuator = 1 << (0 if own_muscles else 1)
        self.start_rad = self.constant("stance_rad")
        self.reset(self.constant("reference_rad"))
        self._reference_m = self._data.ten_length.copy()
        self._set_own_muscles()
        self.reset(self.start_rad)

    def _numeric(self, name: str) -> list[float]:
        entry = self._model.numeric(name)
        return [float(value) for value in entry.data]

    def constant(self, name: str) -> float:
        """A number that the scene's file gives under <custom>."""
        return self._numeric(name)[0]

    def _set_own_muscles(self) -> None:
        """Give MuJoCo's muscles the same force, length and pennation; their curves stay MuJoCo's."""
        # MuJoCo maps a range of path lengths to a range of fibre lengths in L0; here 0.5 to 1.5.
        half = 0.5 * self._l0 / self._cos
        self._model.actuator_lengthrange[self._own] = np.stack((self._reference_m - half, self._reference_m + half), 1)
        peak = self._f0 * self._cos
        self._model.actuator_gainprm[self._own, 2] = peak
        self._model.actuator_biasprm[self._own, 2] = peak

    def reset(self, angle_rad: float, velocity_rad_per_s: float = 0.0) -> None:
        """Stand at an angle, with no force, no activation, at time 0."""
        self._mj.mj_resetData(self._model, self._data)
        self._model.opt.gravity[:] = (0.0, 0.0, -GRAVITY_M_S2)
        self._data.qpos[0] = angle_rad
        self._data.qvel[0] = velocity_rad_per_s
        self._mj.mj_forward(self._model, self._data)

    def place(self, angle_rad: float, velocity_rad_per_s: float) -> None:
        """Put the joint somewhere, as a hand would; forces, activation and time stay."""
        self._data.qpos[0] = angle_rad
        self._data.qvel[0] = velocity_rad_per_s
        self._mj.mj_forward(self._model, self._data)

    @property
    def time_s(self) -> float:
        """Time since the reset."""
        return float(self._data.time)

    @property
    def angle_rad(self) -> float:
        """Angle of the joint; see the scene's file for its zero and sign."""
        return float(self._data.qpos[0])

    @property
    def velocity_rad_per_s(self) -> float:
        """Rate of the angle."""
        return float(self._data.qvel[0])

    @property
    def energy_j(self) -> float:
        """Potential and kinetic energy, in the frame of the platform."""
        self._mj.mj_forward(self._model, self._data)
        return float(np.sum(self._data.energy))

    def length_change_l0(self) -> Array:
        """Change of each muscle's fibres from their reference length, shape (muscle,), L0."""
        change: Array = (self._data.ten_length - self._reference_m) * self._cos / self._l0
        return change

    def velocity_l0_per_s(self) -> Array:
        """Rate of `length_change_l0`, shape (muscle,)."""
        rate: Array = self._data.ten_velocity * self._cos / self._l0
        return rate

    def lengthening_m_per_rad(self) -> Array:
        """Change of each path's length by angle, shape (muscle,): the moment arm, positive where it stretches."""
        velocity = float(self._data.qvel[0])
        self._data.qvel[0] = 1.0
        self._mj.mj_forward(self._model, self._data)
        rate: Array = self._data.ten_velocity.copy()
        self._data.qvel[0] = velocity
        self._mj.mj_forward(self._model, self._data)
        return rate

    def load_nm(self) -> float:
        """Torque that all but the muscles put on the joint at this angle at rest (weight, mainly), N·m."""
        return float(self._data.qfrc_passive[0] - self._data.qfrc_bias[0])

    def acceleration_rad_per_s2(self) -> float:
        """Acceleration of the angle under the forces applied now."""
        self._mj.mj_forward(self._model, self._data)
        return float(self._data.qacc[0])

    def tendon_force_n(self, force_f0: Array) -> Array:
        """Pull on each tendon of fibre forces in F0, shape (muscle,), N."""
        pull: Array = force_f0 * self._f0 * self._cos
        return pull

    def apply(self, force_f0: Array) -> None:
        """Pull with fibre forces (F0), shape (muscle,), from now on."""
        self._data.ctrl[self._forces] = -self.tendon_force_n(force_f0)

    def activate(self, activation: Array) -> None:
        """Hold MuJoCo's muscles at activations, shape (muscle,), 0 to 1, from now on."""
        self._data.ctrl[self._own] = activation
        self._data.act[:] = activation
        self._mj.mj_forward(self._model, self._data)

    @property
    def engine(self) -> tuple[Any, Any]:
        """MuJoCo's model and data, for viewers, which read them only."""
        return self._model, self._data

    def own_force_n(self) -> Array:
        """Pull of MuJoCo's muscles at the last step, shape (muscle,), N."""
        pull: Array = -self._data.actuator_force[self._own]
        return pull

    def step(self, frame_m_per_s2: float = 0.0) -> None:
        """Go on by `tick_s`.

        Args:
            frame_m_per_s2: acceleration of the platform, forward positive. The scene is seen from the platform, where
                the body feels the opposite acceleration: exact for a translation that is prescribed.
        """
        self._model.opt.gravity[0] = -frame_m_per_s2
        self._mj.mj_step(self._model, self._data)
        # mj_step leaves lengths as they were before the step.
        self._mj.mj_forward(self._model, self._data)
