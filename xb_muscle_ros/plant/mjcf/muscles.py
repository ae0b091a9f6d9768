"""Cross-bridge muscles in place of a MuJoCo model's own."""

from __future__ import annotations

import copy
import warnings
from typing import Any

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.errors import DataWarning, UserError
from xb_muscle_ros.plant.engine import mujoco
from xb_muscle_ros.plant.mjcf.activation import ActivationDynamics
from xb_muscle_ros.plant.mjcf.actuators import make_plain, read_muscles, refuse_substeps
from xb_muscle_ros.plant.mjcf.calibration import POINTS
from xb_muscle_ros.plant.mjcf.fibres import build
from xb_muscle_ros.plant.mjcf.groups import Groups, members_of
from xb_muscle_ros.plant.mjcf.kernels import looked_up
from xb_muscle_ros.plant.mjcf.table import Table, choices
from xb_muscle_ros.plant.plant import Array
from xb_muscle_ros.plant.tendon import strain

_LEVELS = np.linspace(0.0, 1.0, POINTS)
_SIZES = {"nq": "positions", "nv": "velocities", "nu": "actuators", "na": "activations", "nbody": "bodies"}
_OF_MUJOCO = ("_mj", "_options", "_several")
_OVERSHOT = "; the time step is too long for the muscle's time constants: make opt.timestep less than half of timeconst"


class CrossBridgeMuscles:
    """Every muscle actuator of an MjModel as a cross-bridge fibre, stepped between `mj_step1` and `mj_step2`.

    Peak force, optimal length, tendon and force-length curves are those that the model's numbers give MuJoCo's own
    muscle; a table names fibre, model, constants and tendon of each. The model is changed in place: its muscles become
    plain forces, which `advance` sets.

    `copy.copy` makes muscles of the same model with states of their own, as `copy.copy` of an MjData does;
    `copy.deepcopy` and pickle take the model along.

    Attributes:
        model: the MjModel.
        names: of the muscles, in the order of all arrays of shape (muscle,) here.
        index: of their actuators, shape (muscle,).
        f0_n, l0_m: peak isometric force, N, and optimal fibre length, m, shape (muscle,).
        slack_m: length of the tendon, m, shape (muscle,); below 0 where the model's numbers leave none.
        fibres: one for each muscle.
        fibre_groups: what steps them.
        activation: of the moment, 0 to 1, shape (muscle,).

    Source:
        docs/body.md says where each number is from.

    Examples:
        >>> import mujoco, xb_muscle_ros as xb
        >>> model = mujoco.MjModel.from_xml_string(
        ...     '<mujoco><worldbody><body><joint name="hinge" axis="0 1 0"/><geom size=".1"/></body></worldbody>'
        ...     '<actuator><muscle joint="hinge" lengthrange="-1 1" force="20"/></actuator></mujoco>'
        ... )
        >>> data = mujoco.MjData(model)
        >>> muscles = xb.CrossBridgeMuscles(model)
        >>> pull_n = muscles.reset(data, muscles.calcium_um(0.1))
        >>> muscles.step(data, 0.5).shape  # excitation of all muscles; pulls, N
        (1,)
    """

    def __init__(self, model: Any, table: Table = None) -> None:
        """Read a model's muscles, build their fibres, and make plain forces of the actuators.

        Args:
            model: an MjModel; changed in place once everything else has succeeded.
            table: YAML file or mapping with ``default``, ``groups`` and ``muscles``, see docs/body.md; None: fibre
                18Dec2017a, 3state_coop_slack and a rigid tendon for all.

        Raises:
            UserError: no MuJoCo, no muscles, a muscle without length range, an integrator that asks for forces several
                times a step, or an entry of the table that is not known.
        """
        self._mj = mujoco()
        muscles = read_muscles(model)
        built = build(self._mj, muscles, choices(table, muscles.names))
        self._use(model)
        self.names, self.index = muscles.names, muscles.index
        self.f0_n, self.l0_m, self.slack_m = muscles.f0_n, muscles.l0_m, muscles.slack_m
        self.fibres = built.fibres
        self._relations, self._elastic_l0 = built.relations, built.elastic_l0
        self._tables, self._table, self._least = built.calcium_um, built.table, built.least
        self._optimal_m, self._per_l0 = muscles.optimal_m, 1.0 / muscles.l0_m
        self._dynamics = ActivationDynamics(muscles)
        self._early = muscles.early if muscles.early.any() else None
        self.fibre_groups = Groups(built.fibres)
        self._place = members_of(muscles.index)
        self.activation: Array = np.zeros(len(self.names))
        self._time_s = -np.inf
        for line in (*muscles.warnings, *built.warnings):
            warnings.warn(line, DataWarning, stacklevel=2)
        make_plain(model, muscles.index)

    def _use(self, model: Any) -> None:
        self.model = model
        # A view, so that what is set later counts; getting it anew at every step costs as much as what it says.
        self._options, self._several = model.opt, int(self._mj.mjtIntegrator.mjINT_RK4)

    def __getstate__(self) -> dict[str, Any]:
        """All but MuJoCo itself and views of the model's memory."""
        return {name: value for name, value in self.__dict__.items() if name not in _OF_MUJOCO}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self._mj = mujoco()
        self._use(self.model)

    def __copy__(self) -> CrossBridgeMuscles:
        made = type(self).__new__(type(self))
        own = copy.deepcopy((self.fibre_groups, self.activation))
        made.__setstate__({**self.__getstate__(), "fibre_groups": own[0], "activation": own[1]})
        return made

    def __len__(self) -> int:
        """Number of muscles."""
        return len(self.names)

    def __repr__(self) -> str:
        """Their number and models."""
        models = sorted({fibre.model for fibre in self.fibres})
        return f"CrossBridgeMuscles({len(self)} muscles: {', '.join(models)})"

    def length_change_l0(self, data: Any) -> Array:
        """Length of fibre and tendon beyond optimal fibre and slack tendon, shape (muscle,), L0; 0 is optimal."""
        change: Array = (data.actuator_length[self._place] - self._optimal_m) * self._per_l0
        return change

    def fibre_change_l0(self, length_change_l0: Array, force_f0: Array) -> Array:
        """Length of the fibres alone beyond their optimum, shape (muscle,), L0: what spindles lie along.

        That of fibre and tendon less the tendon's stretch at the fibre's force, where the tendon is elastic.

        Args:
            length_change_l0: see `length_change_l0`.
            force_f0: pull of the moment, F0, shape (muscle,).
        """
        # A tendon that bears nothing, or is pushed by rounding, is as long as it is slack.
        fibre: Array = length_change_l0 - self._elastic_l0 * strain(np.maximum(force_f0, 0.0))
        return fibre

    def calcium_um(self, activation: npt.ArrayLike) -> Array:
        """Free calcium at which the isometric force at the optimum is a share of F0, shape (muscle,), µM.

        Args:
            activation: 0 to 1; a number, or shape (muscle,).

        Raises:
            UserError: another shape, or not within 0 to 1.
        """
        return self._calcium(self._each("activation", activation))

    def isometric_force_n(self, data: Any, activation: npt.ArrayLike) -> Array:
        """Pull at rest at the posture of `data`, active and passive, shape (muscle,), N.

        Args:
            data: MjData, up to date in positions (`mj_forward`, `mj_step1`).
            activation: see `calcium_um`.

        Raises:
            UserError: see `calcium_um`.
        """
        active = self._each("activation", activation)
        self._calcium(active)
        return self.f0_n * self._relations.force_f0(self.length_change_l0(data), np.maximum(active, self._least))

    def reset(self, data: Any, calcium_um: npt.ArrayLike = 0.0) -> Array:
        """Settle every fibre isometrically at the posture of `data`, and let it pull.

        Args:
            data: MjData; its positions are brought up to date, its `ctrl` is set.
            calcium_um: a number, or shape (muscle,), µM; `activation` becomes what it stands for.

        Returns:
            pulls, shape (muscle,), N.

        Raises:
            UserError: a length or calcium that no fibre has; names the muscle.
        """
        self._refuse_foreign(data)
        calcium = self._each("calcium", calcium_um)
        self._mj.mj_fwdPosition(self.model, data)
        self._time_s = data.time
        force = self.fibre_groups.settle(self.length_change_l0(data), calcium)
        rows = [self._tables[row] for row in self._table]
        self.activation = np.array([np.interp(c, row, _LEVELS) for c, row in zip(calcium, rows, strict=True)])
        return self._pull(data, force)

    def advance(self, data: Any, calcium_um: npt.ArrayLike) -> Array:
        """Carry all fibres over one time step to the length of now, after `mj_step1` and before `mj_step2`.

        Args:
            data: MjData; its `ctrl` is set.
            calcium_um: a number, or shape (muscle,), µM, held since the last tick.

        Returns:
            pulls, shape (muscle,), N.

        Raises:
            UserError: a length or calcium that no fibre has; names the muscle; or time went back.
            StateViolation: a fibre's state left its bounds.
        """
        return self._advance(data, self._each("calcium", calcium_um), self._timestep_s)

    def step(self, data: Any, excitation: npt.ArrayLike) -> Array:
        """One step of model and muscles, in place of `mj_step`.

        Excitation acts as control of MuJoCo's muscles does: force follows the activation at the beginning of the step.

        Args:
            data: MjData.
            excitation: a number, or shape (muscle,); clipped to its range, as MuJoCo clips control.

        Returns:
            pulls at the beginning of the step, shape (muscle,), N.

        Raises:
            UserError, StateViolation: see `advance`; or an excitation that is not finite.
        """
        self._refuse_foreign(data)
        if self._options.integrator == self._several:
            refuse_substeps(self.model, self._mj)
        wanted = self._each("excitation", excitation)
        dt_s = self._timestep_s
        after = self._dynamics.after(self.activation, wanted, dt_s)
        self._mj.mj_step1(self.model, data)
        acting = self.activation if self._early is None else np.where(self._early, after, self.activation)
        pull = self._advance(data, self._calcium(acting, _OVERSHOT), dt_s)
        self._mj.mj_step2(self.model, data)
        self.activation = after
        return pull

    def outputs(self) -> dict[str, Array]:
        """What all fibres show now, by name of `Outputs`, each of shape (muscle,)."""
        return self.fibre_groups.outputs()

    def _advance(self, data: Any, calcium_um: Array, dt_s: float) -> Array:
        time_s = data.time
        if time_s < self._time_s:
            raise UserError(
                f"time of data went back from {self._time_s:g} to {time_s:g} s (mj_resetData, or MuJoCo's automatic "
                "reset after a step that became unstable), but fibres are as they were; settle them by reset"
            )
        self._time_s = time_s
        return self._pull(data, self.fibre_groups.advance(self.length_change_l0(data), calcium_um, dt_s))

    @property
    def _timestep_s(self) -> float:
        return float(self._options.timestep)

    def _refuse_foreign(self, data: Any) -> None:
        """Refuse what is no MjData of this model: MuJoCo itself would read and write beyond its arrays.

        Raises:
            UserError: sizes differ, or there are none.
        """
        other = getattr(data, "model", None)
        if other is self.model:
            return
        if not isinstance(data, self._mj.MjData):
            raise UserError(f"data is of type {type(data).__name__}; needed is an MjData of the model given before")
        for size, what in _SIZES.items():
            if getattr(other, size) != (own := getattr(self.model, size)):
                raise UserError(
                    f"data is of a model with {getattr(other, size)} {what}, the muscles are of one with {own}; give "
                    "an MjData of the model that CrossBridgeMuscles was given"
                )

    def _pull(self, data: Any, force_f0: Array) -> Array:
        pull: Array = self.f0_n * force_f0
        data.ctrl[self._place] = -pull
        return pull

    def _calcium(self, activation: Array, remedy: str = "") -> Array:
        out = np.empty_like(activation)
        k = looked_up(activation, self._tables, self._table, out)
        if k >= 0:
            raise UserError(f"activation of {self.names[k]} is {activation[k]:g}; allowed is 0 to 1{remedy}")
        return out

    def _each(self, what: str, given: npt.ArrayLike) -> Array:
        """One number for each muscle.

        Raises:
            UserError: another shape, no numbers, or not finite.
        """
        try:
            values = np.ascontiguousarray(given, dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise UserError(f"{what} is no array of numbers: {error}") from None
        count = len(self.names)
        if values.ndim == 0 or values.shape == (1,) != (count,):
            values = np.full(count, float(values.flat[0]))
        if values.shape != (count,):
            raise UserError(f"{what} has shape {values.shape}; needed is ({count},) or one number")
        return values
