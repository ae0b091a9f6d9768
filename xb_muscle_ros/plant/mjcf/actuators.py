"""MuJoCo's muscle actuators: what a model says of its muscles, and how these become plain forces.

Numbers are read as MuJoCo's own muscle reads them (`mju_muscleGain`, `mju_muscleBias`, `mju_muscleDynamics`):
``lengthrange`` of the actuator's length is mapped to ``range`` in optimal fibre lengths, which fixes the optimal length
L0 and the length of a rigid tendon in series.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.plant.engine import mujoco
from xb_muscle_ros.plant.plant import Array

_LEAST = 1e-15
"""MuJoCo's mjMINVAL: by less nothing is divided."""


@dataclass(frozen=True, eq=False)
class MuscleActuators:
    """The muscles of a model; arrays have shape (muscle,), in the order of the actuators.

    Attributes:
        index: of the actuators.
        names: of the actuators; ``actuator_3`` where the fourth has none.
        f0_n: largest isometric force, N.
        l0_m: optimal fibre length, m, in units of the actuator's length.
        slack_m: length of the rigid tendon that the model's numbers imply, m; below 0 where they leave none.
        range_l0: shape (muscle, 2), shortest and longest fibre, L0.
        fl_min, fl_max: fibre lengths between which a muscle has active force, L0.
        fp_max: passive force at `fl_max`, F0.
        activation_s, deactivation_s: time constants, s.
        smoothing: width of the transition between the two, in excitation; 0: a switch.
        excitation_range: shape (muscle, 2), to which control is clipped.
        activation_range: shape (muscle, 2), to which activation is clipped; infinite where it is not.
        early: force follows the activation at the end of a step (``actearly``), not at its beginning.
        warnings: lines on what plain forces leave out.
    """

    index: npt.NDArray[np.int64]
    names: tuple[str, ...]
    f0_n: Array
    l0_m: Array
    slack_m: Array
    range_l0: Array
    fl_min: Array
    fl_max: Array
    fp_max: Array
    activation_s: Array
    deactivation_s: Array
    smoothing: Array
    excitation_range: Array
    activation_range: Array
    early: npt.NDArray[np.bool_]
    warnings: tuple[str, ...]

    @property
    def optimal_m(self) -> Array:
        """Actuator lengths at which fibres are at their optimal length on rigid tendons, m."""
        return self.slack_m + self.l0_m


def read_muscles(model: Any) -> MuscleActuators:
    """Read the muscles of an MjModel.

    Raises:
        UserError: it has none, one of them has no length range or mixes a muscle with something else, or the
            model's integrator evaluates forces several times a step.
    """
    mj = mujoco()
    if not isinstance(model, mj.MjModel):
        raise UserError(
            f"model is of type {type(model).__name__}; needed is an MjModel, for example from MjModel.from_xml_path"
        )
    index = np.flatnonzero(model.actuator_gaintype == mj.mjtGain.mjGAIN_MUSCLE)
    if not index.size:
        raise UserError(
            f"the model has no muscles among its {model.nu} actuators; give it one with "
            '<muscle name="..." tendon="..."/> under <actuator> (fibres have taken their place where '
            "CrossBridgeMuscles was given this model before: load it again, or give a copy made before)"
        )
    names = tuple(mj.mj_id2name(model, mj.mjtObj.mjOBJ_ACTUATOR, int(i)) or f"actuator_{i}" for i in index)
    _refuse_others(model, mj, index, names)
    gain, length = model.actuator_gainprm[index], model.actuator_lengthrange[index]
    _refuse_ranges(names, gain, length)
    l0_m = (length[:, 1] - length[:, 0]) / np.maximum(gain[:, 1] - gain[:, 0], _LEAST)
    f0_n = _peak_n(model, index, gain)
    _refuse_forces(names, f0_n)
    bias = model.actuator_biasprm[index]
    _refuse_two_curves(names, gain, bias)
    limited = model.actuator_ctrllimited[index].astype(bool)[:, None]
    excitation = np.where(limited, model.actuator_ctrlrange[index], (-np.inf, np.inf))
    limited = model.actuator_actlimited[index].astype(bool)[:, None]
    return MuscleActuators(
        index=index,
        names=names,
        f0_n=f0_n,
        l0_m=l0_m,
        slack_m=length[:, 0] - gain[:, 0] * l0_m,
        range_l0=gain[:, :2].copy(),
        fl_min=gain[:, 4].copy(),
        fl_max=gain[:, 5].copy(),
        fp_max=_passive_f0(bias[:, 7], _peak_n(model, index, bias), f0_n),
        activation_s=model.actuator_dynprm[index, 0],
        deactivation_s=model.actuator_dynprm[index, 1],
        smoothing=model.actuator_dynprm[index, 2],
        # MuJoCo's muscle clips to 0 to 1 whatever the control's range is.
        excitation_range=np.clip(excitation, 0.0, 1.0),
        activation_range=np.where(limited, model.actuator_actrange[index], (-np.inf, np.inf)),
        early=model.actuator_actearly[index].astype(bool),
        warnings=(*_left_out(names, model.actuator_forcelimited[index]), *_disabled(model, mj, index, names)),
    )


def make_plain(model: Any, index: npt.NDArray[np.int64]) -> None:
    """Turn actuators of a model into plain forces, in place: a negative ``ctrl`` pulls its ends towards each other.

    The actuators give up their entries of ``act``, which MuJoCo would use instead of ``ctrl`` otherwise; ``na`` stays.
    """
    mj = mujoco()
    model.actuator_dyntype[index] = mj.mjtDyn.mjDYN_NONE
    model.actuator_gaintype[index] = mj.mjtGain.mjGAIN_FIXED
    model.actuator_biastype[index] = mj.mjtBias.mjBIAS_NONE
    model.actuator_gainprm[index] = 0.0
    model.actuator_gainprm[index, 0] = 1.0
    model.actuator_biasprm[index] = 0.0
    model.actuator_actadr[index] = -1
    model.actuator_actnum[index] = 0
    for limited in (model.actuator_ctrllimited, model.actuator_forcelimited, model.actuator_actlimited):
        limited[index] = 0
    model.actuator_actearly[index] = 0


def refuse_substeps(model: Any, mj: Any) -> None:
    """Refuse an integrator that asks for forces several times a step.

    Raises:
        UserError: Runge-Kutta.
    """
    if model.opt.integrator == mj.mjtIntegrator.mjINT_RK4:
        raise UserError(
            "the model's integrator is RK4, which asks for forces four times a step; fibres give them once: set "
            'model.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST (or <option integrator="implicitfast"/>)'
        )


def _refuse_others(model: Any, mj: Any, index: npt.NDArray[np.int64], names: tuple[str, ...]) -> None:
    """Refuse what cannot be stepped around, and actuators that are muscles in part only."""
    refuse_substeps(model, mj)
    for kinds, what, wanted in (
        (model.actuator_biastype, "biastype", mj.mjtBias.mjBIAS_MUSCLE),
        (model.actuator_dyntype, "dyntype", mj.mjtDyn.mjDYN_MUSCLE),
    ):
        other = np.flatnonzero(kinds[index] != wanted)
        if other.size:
            raise UserError(
                f"actuator {names[other[0]]} has gaintype muscle but another {what}; allowed is muscle for all three "
                "of gaintype, biastype and dyntype, as <muscle .../> sets them"
            )
    # Older versions of MuJoCo have no delays.
    delayed = np.flatnonzero(getattr(model, "actuator_delay", np.zeros(model.nu))[index] > 0.0)
    if delayed.size:
        name = names[delayed[0]]
        raise UserError(
            f"muscle {name} has a delay of {model.actuator_delay[index[delayed[0]]]:g} s, by which MuJoCo would hold "
            "the fibre's force back in place of its excitation; set delay to 0 and delay the excitation"
        )


def _refuse_ranges(names: tuple[str, ...], gain: Array, length: Array) -> None:
    for name, (low, high), (first, last) in zip(names, gain[:, :2].tolist(), length.tolist(), strict=True):
        if not (first < last and np.isfinite((first, last)).all()):
            raise UserError(
                f"muscle {name} has length range {first:g} to {last:g}, which fixes no fibre length; let the compiler "
                "find it (<compiler><lengthrange .../></compiler>), call mujoco.mj_setLengthRange, or give lengthrange"
            )
        if not low < high:
            raise UserError(
                f"muscle {name} has operating range {low:g} to {high:g} L0; needed is range='low high', rising"
            )


def _peak_n(model: Any, index: npt.NDArray[np.int64], prm: Array) -> Array:
    """Peak force of a muscle's gain or bias, N."""
    given = prm[:, 2]
    peak: Array = np.where(given < 0.0, prm[:, 3] / np.maximum(model.actuator_acc0[index], _LEAST), given)
    return peak


def _passive_f0(fp_max: Array, peak_n: Array, f0_n: Array) -> Array:
    """Passive force in F0 of the active force: who weakens a muscle by its gain alone leaves passive force as it is."""
    found: Array = np.where(peak_n == f0_n, fp_max, fp_max * peak_n / f0_n)
    return found


def _refuse_two_curves(names: tuple[str, ...], gain: Array, bias: Array) -> None:
    """Refuse active and passive force that are of other fibre lengths; their size may differ."""
    for places, what in (([0, 1], "operating range"), ([5], "lmax")):
        other = np.flatnonzero((gain[:, places] != bias[:, places]).any(axis=1))
        if other.size:
            k = other[0]
            raise UserError(
                f"muscle {names[k]} has {what} {_listed(gain[k, places])} in gainprm and {_listed(bias[k, places])} in "
                "biasprm; allowed is the same in both, as <muscle .../> sets them"
            )


def _listed(values: Array) -> str:
    return " to ".join(f"{value:g}" for value in values.tolist())


def _disabled(model: Any, mj: Any, index: npt.NDArray[np.int64], names: tuple[str, ...]) -> tuple[str, ...]:
    """A line on muscles whose force MuJoCo leaves out at the moment."""
    groups = model.actuator_group[index]
    off = (groups >= 0) & (groups < 31) & ((model.opt.disableactuator >> np.clip(groups, 0, 30)) & 1).astype(bool)
    if model.opt.disableflags & mj.mjtDisableBit.mjDSBL_ACTUATION:
        off = np.ones_like(off)
    some = [name for name, there in zip(names, off.tolist(), strict=True) if there]
    what = f"{', '.join(some)}: disabled by the model's options, so that MuJoCo leaves out what their fibres pull with"
    return (what,) if some else ()


def _left_out(names: tuple[str, ...], limited: Array) -> tuple[str, ...]:
    some = [name for name, there in zip(names, limited.tolist(), strict=True) if there]
    return (f"force ranges of {', '.join(some)} are left out: fibres pull as hard as they pull",) if some else ()


def _refuse_forces(names: tuple[str, ...], f0_n: Array) -> None:
    bad = np.flatnonzero(~((f0_n > 0.0) & np.isfinite(f0_n)))
    if bad.size:
        raise UserError(
            f"muscle {names[bad[0]]} has peak force {f0_n[bad[0]]:g} N; allowed is above 0: give force or scale"
        )
