"""What pulls at a plant's tendons: fibre models of this package, or MuJoCo's own muscle."""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from typing import Protocol

import numpy as np
from scipy.optimize import brentq

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.fibre_file import Fibre, changed
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.models.passive import without_own
from xb_muscle_ros.node.rules import LENGTH_CHANGE_L0
from xb_muscle_ros.plant.activation import CalciumTable, ReflexActivation, reflex_calcium
from xb_muscle_ros.plant.plant import Array, Plant
from xb_muscle_ros.plant.reflex import NO_REFLEX, Reflex, ReflexArc, ReflexLoop
from xb_muscle_ros.plant.tendon import tendon_at

OWN = "mujoco"
"""Name under which MuJoCo's muscle is asked for beside the models of a fibre file."""
RELAXED_PCA = 9.0
_MOST_PCA, _LEAST_PCA = 4.0, 8.0


class RunEnded(UserError):
    """The body has moved further than its muscles reach: what went before stands, nothing comes after."""


class Drive(Protocol):
    """Muscles of one plant, constantly activated but for a reflex."""

    driven_by: dict[str, dict[str, float]]
    """What holds the start: of each muscle ``calcium_um``, µM, or ``activation``, 0 to 1."""

    def pull(self) -> Array:
        """Set the plant's forces for the coming tick; return pulls on the tendons at this moment, (muscle,), N."""

    def fibre_length_l0(self) -> Array:
        """Changes of the fibres' lengths at this moment, shape (muscle,)."""

    def level(self) -> Array:
        """What drives the muscles in the coming tick, in the unit of `driven_by`, shape (muscle,)."""


class FibreDrive:
    """The fibre model, once for each muscle; the first muscle's calcium holds the start, the others are relaxed."""

    def __init__(
        self, plant: Plant, fibre: Fibre, torque_nm: float, elastic: bool = False, reflex: Reflex = NO_REFLEX
    ) -> None:
        """Settle all muscles at the plant's start.

        Args:
            plant: at its start.
            fibre: in the scene of the knee without its parallel element, see `without_parallel`.
            torque_nm: that all muscles together put on the joint, N·m.
            elastic: tendons stretch.
            reflex: changes calcium from then on.

        Raises:
            UserError: no calcium gives this torque, or the reflex does not fit the muscles or the tick.
        """
        self._plant = plant
        self._muscle = Muscle(fibre)
        lengths = plant.length_change_l0()
        relaxed = 10.0 ** (6.0 - RELAXED_PCA)
        self._calcium = [relaxed] * len(plant.muscles)
        self._states = [self._muscle.settle(float(length), relaxed) for length in lengths]
        force = np.array([self._muscle.outputs(state).force_f0 for state in self._states])
        wanted = _first_force(plant, plant.tendon_force_n(force), torque_nm)
        target = wanted / float(plant.tendon_force_n(np.ones_like(force))[0])
        self._calcium[0] = self._calcium_for(target, float(lengths[0]))
        self._states[0] = self._muscle.settle(float(lengths[0]), self._calcium[0])
        self.calcium_um = {m.name: c for m, c in zip(plant.muscles, self._calcium, strict=True)}
        self.driven_by = {"calcium_um": self.calcium_um}
        self._fibre_l0 = [float(length) for length in lengths]
        self._tendons = [
            tendon_at(self._muscle.outputs(state).force_f0 * math.cos(m.pennation_rad), m.tendon_slack_m)
            for m, state in zip(plant.muscles, self._states, strict=True)
        ]
        self._elastic = elastic
        self._at_start = True
        self._lengths_at_start = lengths
        self._reflex = self.reflex_loop(reflex)

    def reflex_loop(self, reflex: Reflex) -> ReflexLoop | None:
        """A reflex that acts on calcium (µM), from its start; None where it does nothing.

        Raises:
            UserError: it does not fit the muscles or the tick.
        """
        plant = self._plant
        arc = ReflexArc(reflex, [m.name for m in plant.muscles], plant.tick_s)
        if not reflex.works:
            return None
        start = np.array(list(self.calcium_um.values()))
        tables = self._tables

        def calcium_of(activation: Array) -> Array:
            return np.array([t.calcium_um(a) for t, a in zip(tables, activation.tolist(), strict=True)])

        activation = np.array([t.activation(c) for t, c in zip(tables, start.tolist(), strict=True)])
        return ReflexLoop(arc, start, reflex_calcium(activation, start, calcium_of, plant.tick_s))

    @functools.cached_property
    def _tables(self) -> list[CalciumTable]:
        """Of each muscle at its length at the start."""
        return [CalciumTable(self._muscle, length) for length in self._lengths_at_start.tolist()]

    def _calcium_for(self, force_f0: float, length: float) -> float:
        """Calcium (µM) at which the settled fibre pulls with a force in F0."""

        def excess(pca: float) -> float:
            settled = self._muscle.settle(length, 10.0 ** (6.0 - pca))
            return self._muscle.outputs(settled).force_f0 - force_f0

        least, most = excess(_LEAST_PCA), excess(_MOST_PCA)
        if not least < 0.0 < most:
            fibre = self._muscle.fibre
            raise UserError(
                f"fibre {fibre.name}, model {fibre.model}: the start of scene {self._plant.scene} "
                f"needs {force_f0:.4g} F0; "
                f"pCa {_LEAST_PCA:g} to {_MOST_PCA:g} give {least + force_f0:.4g} to {most + force_f0:.4g}; "
                "take another fibre or model"
            )
        return float(10.0 ** (6.0 - brentq(excess, _MOST_PCA, _LEAST_PCA, xtol=1e-12, rtol=1e-14)))

    def pull(self) -> Array:
        """One step of each muscle to the plant's length; the force acts until the next call."""
        lengths = self._plant.length_change_l0()
        if not self._at_start:
            for i, length in enumerate(lengths.tolist()):
                try:
                    self._fibre_l0[i] = self._balanced(i, length) if self._elastic else length
                    self._states[i] = self._stepped(i, self._fibre_l0[i])
                except UserError as error:
                    plant, model = self._plant, self._muscle.fibre.model
                    raise RunEnded(
                        f"{model}, {plant.muscles[i].name} at t = {plant.time_s:.3f} s, "
                        f"angle {plant.angle_rad:.4f} rad: {error}; the body has moved further than its muscles reach: "
                        "take a shorter --duration or a smaller --displacement"
                    ) from error
        self._at_start = False
        force = np.array([self._muscle.outputs(state).force_f0 for state in self._states])
        if self._reflex is not None:
            self._calcium = self._reflex.observe(self.fibre_length_l0(), force).tolist()
        self._plant.apply(force)
        return self._plant.tendon_force_n(force)

    def fibre_length_l0(self) -> Array:
        """Length changes of the fibres, shape (muscle,); on rigid tendons those of the plant."""
        return np.array(self._fibre_l0)

    def level(self) -> Array:
        """Calcium of the coming tick, shape (muscle,), µM."""
        return np.array(self._calcium)

    def _stepped(self, i: int, length: float) -> Array:
        return self._muscle.step(self._states[i], length, self._calcium[i], self._plant.tick_s)

    def _balanced(self, i: int, path_l0: float) -> float:
        """Length at which a fibre's force after its step is its tendon's; `path_l0` is the length on a rigid tendon.

        Raises:
            UserError: there is none near the last length.
        """
        muscle, tendon, cos = self._plant.muscles[i], self._tendons[i], math.cos(self._plant.muscles[i].pennation_rad)

        def excess(length: float) -> float:
            stretch_m = (path_l0 - length) * muscle.l0_m / cos
            return self._muscle.outputs(self._stepped(i, length)).force_f0 * cos - tendon.force_f0(stretch_m)

        # Force grows with the fibre's length and the tendon's falls: one root, not far in one tick.
        reach = 1e-4
        while reach < 0.1:
            lower, upper = self._fibre_l0[i] - reach, self._fibre_l0[i] + reach
            if excess(lower) <= 0.0 <= excess(upper):
                return float(brentq(excess, lower, upper, xtol=1e-13, rtol=1e-14))
            reach *= 4.0
        raise UserError(
            f"{muscle.name} and its tendon find no balance at t = {self._plant.time_s:.4g} s within 0.1 L0 of the last "
            "length; leave --elastic-tendon out"
        )


class OwnDrive:
    """MuJoCo's muscle actuator with its default curves, at the same F0, L0 and pennation."""

    def __init__(self, plant: Plant, torque_nm: float, reflex: Reflex = NO_REFLEX) -> None:
        """Find the activation that holds the start; see `FibreDrive`.

        Raises:
            UserError: no activation gives this torque, or the reflex does not fit the muscles or the tick.
        """
        self._plant = plant
        activation = np.zeros(len(plant.muscles))
        plant.activate(activation)
        passive = plant.own_force_n()
        wanted = _first_force(plant, passive, torque_nm)
        activation[0] = 1.0
        plant.activate(activation)
        # Force is linear in activation.
        activation[0] = (wanted - passive[0]) / (plant.own_force_n()[0] - passive[0])
        if not 0.0 <= activation[0] <= 1.0:
            raise UserError(
                f"MuJoCo's muscle cannot hold the start of scene {plant.scene}: "
                f"it needs activation {activation[0]:.4g}; allowed is 0 to 1; leave model 'mujoco' out"
            )
        plant.activate(activation)
        self.driven_by = {"activation": {m.name: float(a) for m, a in zip(plant.muscles, activation, strict=True)}}
        self._level = activation
        arc = ReflexArc(reflex, [m.name for m in plant.muscles], plant.tick_s)
        stage = ReflexActivation(activation, plant.tick_s)
        self._reflex = ReflexLoop(arc, activation, stage) if reflex.works else None

    def pull(self) -> Array:
        """MuJoCo computes the force within its step, with the velocity of the moment; a reflex sets the activation."""
        force = self._plant.own_force_n()
        if self._reflex is not None:
            whole = self._plant.tendon_force_n(np.ones_like(force))
            self._level = self._reflex.observe(self.fibre_length_l0(), force / whole)
            self._plant.activate(self._level)
        return force

    def fibre_length_l0(self) -> Array:
        """MuJoCo's muscle has no tendon."""
        return self._plant.length_change_l0()

    def level(self) -> Array:
        """Activation of the coming tick, shape (muscle,), 0 to 1."""
        return self._level


def _first_force(plant: Plant, others_n: Sequence[float] | Array, torque_nm: float) -> float:
    """Pull of the first muscle that, with those of the others, gives a torque against the angle, N."""
    arms = plant.lengthening_m_per_rad()
    rest = float(np.dot(arms[1:], np.asarray(others_n)[1:]))
    return (torque_nm - rest) / float(arms[0])


def without_parallel(fibre: Fibre) -> Fibre:
    """The fibre without its parallel element.

    It was fitted to stretches of 4 % L0; the knee's swing takes a fibre through ten times that, where the line that the
    element follows would be an invention. The scene has the joint's passive tissue instead.
    """
    return changed(fibre, without_own(fibre.values), "the knee's muscle")


def pca(calcium_um: float) -> float:
    """-log10 of free calcium in mol/L."""
    return 6.0 - math.log10(calcium_um)


def beyond(muscles: Sequence[str], length_l0: Array) -> str:
    """Which muscle is longer or shorter than a fibre works; empty where none is.

    Args:
        muscles: names.
        length_l0: length changes of their fibres, shape (muscle,).
    """
    least, most = LENGTH_CHANGE_L0
    if np.all((length_l0 >= least) & (length_l0 <= most)):
        return ""
    for name, change in zip(muscles, length_l0.tolist(), strict=True):
        if not least <= change <= most:
            return f"the fibre of {name} comes to {1.0 + change:.3f} L0, beyond {1.0 + least:g} to {1.0 + most:g} L0"
    return ""
