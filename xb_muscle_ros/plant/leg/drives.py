"""What pulls at the leg's tendons: MuJoCo's own muscles, or this package's fibres in their place."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from typing import Any, Protocol

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.fibre_file import Fibre
from xb_muscle_ros.plant.activation import ReflexActivation, reflex_calcium
from xb_muscle_ros.plant.drives import OWN
from xb_muscle_ros.plant.leg.body import Body
from xb_muscle_ros.plant.leg.stance import Stance
from xb_muscle_ros.plant.mjcf.actuators import read_muscles
from xb_muscle_ros.plant.mjcf.muscles import CrossBridgeMuscles
from xb_muscle_ros.plant.plant import Array
from xb_muscle_ros.plant.reflex import NO_REFLEX, Reflex, ReflexArc, ReflexLoop

_STEPS, _PRECISION_F0, _LEAST = 60, 1e-13, 1e-300


class Drive(Protocol):
    """Muscles of one body, constantly activated at what holds its stance."""

    model: str
    driven_by: dict[str, dict[str, float]]
    """What holds the stance: of each muscle ``calcium_um``, µM, or ``activation``, 0 to 1."""

    def reset(self) -> None:
        """Settle at the stance, where the body is."""

    def advance(self) -> None:
        """Go on to the muscles' lengths of now; called once a tick, when positions and velocities are known."""


class OwnMuscles:
    """MuJoCo's muscle actuators: no memory, constant activation but for a reflex."""

    def __init__(self, body: Body, stance: Stance, reflex: Reflex = NO_REFLEX) -> None:
        """Take the stance's activations.

        Args:
            body, stance: to hold.
            reflex: of the muscles.

        Raises:
            UserError: the reflex does not fit.
        """
        self.model = f"{OWN}, reflex" if reflex.works else OWN
        self._body, self._activation = body, stance.activation
        self._arc = functools.partial(ReflexArc, reflex, body.muscles, body.tick_s)
        self._arc()
        self._works = reflex.works
        self._f0_n = read_muscles(body.model).f0_n
        self._level: Array = stance.activation
        self._reflex: ReflexLoop | None = None
        names = zip(body.muscles, stance.activation.tolist(), strict=True)
        self.driven_by = {"activation": dict(names)}

    def reset(self) -> None:
        """Activate."""
        stage = ReflexActivation(self._activation, self._body.tick_s)
        self._reflex = ReflexLoop(self._arc(), self._activation, stage) if self._works else None
        self._activate(self._activation)

    def advance(self) -> None:
        """MuJoCo computes force within its step; a reflex has to know it before."""
        if self._reflex is None:
            return
        body = self._body
        self._activate(self._level)
        body.mj.mj_fwdActuation(body.model, body.data)
        length_l0 = body.data.actuator_length / body.l0_m
        self._level = self._reflex.observe(length_l0, -body.data.actuator_force / self._f0_n)

    def _activate(self, activation: Array) -> None:
        self._level = activation
        self._body.data.act[:] = activation
        self._body.data.ctrl[:] = activation


class FibreMuscles:
    """Fibres of this package in place of MuJoCo's muscles, at constant calcium but for a reflex.

    Calcium is what gives, settled, the very force that the stance asks of each muscle: fibres and MuJoCo's muscle then
    stand at the same posture with the same forces.
    """

    def __init__(
        self, body: Body, stance: Stance, table: Mapping[str, Any], model: str, reflex: Reflex = NO_REFLEX
    ) -> None:
        """Replace the body's muscles and find calcium.

        Args:
            body: its actuators become plain forces.
            stance: to hold.
            table: of `CrossBridgeMuscles`.
            model: what it is called; with a reflex that is added.
            reflex: of the muscles.

        Raises:
            UserError: a muscle cannot give the force that the stance asks of it, or the reflex does not fit.
        """
        self.model = f"{model}, reflex" if reflex.works else model
        self._body, self._stance = body, stance
        self._muscles = CrossBridgeMuscles(body.model, table)
        body.place(stance.qpos)
        self.activation = self._activation_of_stance()
        self.calcium_um = self._muscles.calcium_um(self.activation)
        self.of_reflex = reflex
        names = zip(body.muscles, self.calcium_um.tolist(), strict=True)
        self.driven_by = {"calcium_um": dict(names)}
        self._start()

    @property
    def muscles(self) -> CrossBridgeMuscles:
        """Of the body."""
        return self._muscles

    def reflex_loop(self) -> ReflexLoop | None:
        """A reflex from its start on; None where there is none.

        Raises:
            UserError: it does not fit the muscles or the tick.
        """
        arc = ReflexArc(self.of_reflex, self._body.muscles, self._body.tick_s)
        if not self.of_reflex.works:
            return None
        level = reflex_calcium(self.activation, self.calcium_um, self._muscles.calcium_um, self._body.tick_s)
        return ReflexLoop(arc, self.calcium_um, level)

    def _start(self) -> None:
        self._now_um, self._reflex = self.calcium_um, self.reflex_loop()

    def _activation_of_stance(self) -> Array:
        """Activation at which settled muscles pull as the stance asks: regula falsi (Illinois), all at once."""
        low, high = np.zeros_like(self._stance.force_n), np.ones_like(self._stance.force_n)
        below, above = self._excess_f0(low), self._excess_f0(high)
        for k in np.flatnonzero((below > 0.0) | (above < 0.0))[:1]:
            f0_n, asked = float(self._muscles.f0_n[k]), float(self._stance.force_n[k])
            raise UserError(
                f"{self.model}: the stance asks {asked:.4g} N of {self._body.muscles[k]}, which at this length gives "
                f"{asked + f0_n * below[k]:.4g} to {asked + f0_n * above[k]:.4g} N; take another --tone or model,"
                " or rigid tendons"
            )
        rose = np.full(low.shape, -1)
        for _ in range(_STEPS):
            now = (low * above - high * below) / np.maximum(above - below, _LEAST)
            excess = self._excess_f0(now)
            if np.max(np.abs(excess)) < _PRECISION_F0:
                break
            rises = excess < 0.0
            # An end that stays twice counts half, so that it moves too.
            again = np.where(rises == rose, 0.5, 1.0)
            above, below = np.where(rises, again * above, excess), np.where(rises, excess, again * below)
            low, high, rose = np.where(rises, now, low), np.where(rises, high, now), rises
        found: Array = now
        return found

    def _excess_f0(self, activation: Array) -> Array:
        """Settled pull beyond what the stance asks, F0."""
        pull = self._muscles.reset(self._body.data, self._muscles.calcium_um(activation))
        excess: Array = (pull - self._stance.force_n) / self._muscles.f0_n
        return excess

    def reset(self) -> None:
        """Settle."""
        self._start()
        self._muscles.reset(self._body.data, self.calcium_um)

    def advance(self) -> None:
        """One step of all fibres."""
        data = self._body.data
        pull_n = self._muscles.advance(data, self._now_um)
        if self._reflex is not None:
            force_f0 = pull_n / self._muscles.f0_n
            length_l0 = self._muscles.fibre_change_l0(self._muscles.length_change_l0(data), force_f0)
            self._now_um = self._reflex.observe(length_l0, force_f0)


def make_fibres(
    fibre: Fibre, source: str, elastic: bool, reflex: Reflex = NO_REFLEX
) -> Callable[[Body, Stance], FibreMuscles]:
    """As `make_drive`, for models of this package."""
    table = _table(fibre, source, elastic)
    return functools.partial(FibreMuscles, table=table, model=fibre.model, reflex=reflex)


def bridged(body: Body, fibre: Fibre, source: str, elastic: bool) -> CrossBridgeMuscles:
    """The muscles alone, in place of the body's own; arguments as for `make_drive`."""
    return CrossBridgeMuscles(body.model, _table(fibre, source, elastic))


def _table(fibre: Fibre, source: str, elastic: bool) -> Mapping[str, Any]:
    return {"default": {"fibre": source, "model": fibre.model, "tendon": "elastic" if elastic else "rigid"}}


def make_drive(
    fibre: Fibre | None, source: str, elastic: bool, reflex: Reflex = NO_REFLEX
) -> Callable[[Body, Stance], Drive]:
    """Makes the drive of a body for its stance.

    Args:
        fibre: whose model the muscles have; None: MuJoCo's own.
        source: file or name of the fibre.
        elastic: tendons stretch; MuJoCo's muscle has none.
        reflex: of the muscles, from lengths of the fibres alone.
    """
    if fibre is None:
        return functools.partial(OwnMuscles, reflex=reflex)
    return make_fibres(fibre, source, elastic, reflex)
