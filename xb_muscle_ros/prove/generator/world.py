"""A fibre of the generator and what it does in a trial."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from xb_muscle_ros.prove.generator import kernel
from xb_muscle_ros.prove.generator.layout import At, Series, Thick, Thin
from xb_muscle_ros.prove.generator.pieces import series_length
from xb_muscle_ros.trials.trial import Array

FORCE_SCALE = 2.0
"""F0 per cross-bridge force."""
GAMMA = 130.0
"""Half-sarcomere length in power strokes."""
_FIXED = {
    At.K12: 2.0, At.W: 1.0 / 6.0, At.KOFF: 80.0, At.J1: 6.17, At.J2: 200.0, At.TAU_ACT: 0.005, At.GAMMA: GAMMA,
    At.TEAR_STRAIN: 2.0, At.TEAR_STEEPNESS: 6.0, At.REBIND_RATE: 1000.0, At.LATTICE_BEST: 0.93, At.WEAK_RATE: 500.0,
    At.WEAK_STRAIN: 3.0, At.WEAK_LAG: 0.01, At.CREEP_TIME: 1.0, At.SERIES_FORCE: 0.2, At.SERIES_LENGTH: 1.0,
}  # fmt: skip
_BY_NAME = {
    "f": At.F, "w": At.W, "k11": At.K11, "k12": At.K12, "k21": At.K21, "k22": At.K22, "kon": At.KON, "koff": At.KOFF,
    "koop": At.KOOP, "kappa": At.KAPPA, "n": At.N, "tau_act": At.TAU_ACT, "J1": At.J1, "J2": At.J2, "JF": At.JF,
    "kse": At.KSE, "kse0": At.KSE0, "gamma": At.GAMMA,
}  # fmt: skip
MODELS = {
    "2state": (Thin.SIGMOID, Thick.ALWAYS_ON),
    "2state_coop": (Thin.COOPERATIVE, Thick.ALWAYS_ON),
    "3state_coop": (Thin.COOPERATIVE, Thick.FORCE_DEPENDENT),
}
"""Plain worlds by the name of the model that is given to the tool; with ``_rigid`` behind, without series spring."""


class Mesh(NamedTuple):
    """Resolution: samples are 1 ms apart, a sample has so many steps; strains run from first to last.

    A fibre is at rest where its tension changes by less than `still` in a second.
    """

    steps: int = 4
    dx: float = 0.1
    first: float = -6.0
    last: float = 14.0
    still: float = 1e-6

    @property
    def bins(self) -> int:
        """Number of bins."""
        return round((self.last - self.first) / self.dx) + 1


SAMPLE_S = 1e-3


class Stimulus(NamedTuple):
    """What a fibre is given: length change (L0) at every sample, shape (n,), and free calcium in µM, held."""

    length: Array
    calcium: float


@dataclass(frozen=True)
class Acting:
    """What effects make of length and calcium before heads know of it; each of shape (n - 1,), one per sample interval.

    Attributes:
        calcium: factor of free calcium.
        attachment: factor of the attachment rate.
        switch_off: factor of koff.
        recruitment: added to J1's factor.
    """

    calcium: Array
    attachment: Array
    switch_off: Array
    recruitment: Array

    @classmethod
    def plain(cls, n: int) -> Acting:
        """Nothing but the calcium given."""
        return cls(np.ones(n), np.ones(n), np.ones(n), np.zeros(n))


@dataclass(frozen=True)
class World:
    """A fibre.

    Attributes:
        model: a key of `MODELS`, perhaps with ``_rigid``.
        values: constants by their names in fibre files, kpe (F0 per power stroke) and Fpe0 (F0) among them.
        changes: entries of the loop's vector that an effect sets.
        strength: (units,), of half-sarcomeres in series.
    """

    model: str
    values: Mapping[str, float]
    changes: Mapping[At, float] = field(default_factory=dict)
    strength: tuple[float, ...] = (1.0,)

    def with_values(self, values: Mapping[str, float]) -> World:
        """The same with other constants."""
        return replace(self, values={**self.values, **values})

    def vector(self) -> Array:
        """The loop's constants."""
        p = np.zeros(len(At))
        for place, value in _FIXED.items():
            p[place] = value
        for name, value in self.values.items():
            if name in _BY_NAME:
                p[_BY_NAME[name]] = value
        thin, thick = MODELS[self.model.removesuffix("_rigid")]
        p[At.THIN], p[At.THICK] = float(thin), float(thick)
        p[At.SERIES] = float(Series.RIGID if self.model.endswith("_rigid") else Series.EXPONENTIAL)
        for place, value in self.changes.items():
            p[place] = value
        return p


class Answer(NamedTuple):
    """What a fibre does at every sample, each of shape (n,).

    Attributes:
        force: of the whole fibre but for what is added beside it, F0: heads and parallel spring.
        n_on: active sites.
        bound: bound heads.
    """

    force: Array
    n_on: Array
    bound: Array


class _State(NamedTuple):
    n: Array
    units: Array
    shared: Array
    strength: Array


AtRest = dict[tuple[float, ...], _State]
"""Steady states by length (L0), calcium (µM) and what else acts."""


def isometric(world: World, calcium_um: float) -> float:
    """Isometric force at rest length, F0, quickly: of the plain fibre, without any effect."""
    mesh, p = Mesh(), world.vector()
    n, unit = np.zeros(mesh.bins), np.zeros(kernel.ROWS)
    kernel.level(calcium_um, mesh.first, mesh.dx, mesh.bins, p, unit, n)
    return float(FORCE_SCALE * unit[kernel.FORCE] + world.values["Fpe0"])


def simulate(
    world: World, stimulus: Stimulus, acting: Acting | None = None, mesh: Mesh | None = None, rest: AtRest | None = None
) -> Answer:
    """A trial, from isometric steady state.

    Args:
        stimulus: length linear between samples 1 ms apart.
        acting: see there; None for a fibre without such effects.
        mesh: resolution; None for the usual one.
        rest: steady states of this world and resolution that are known, by what holds there; gets those that are found.
    """
    mesh = mesh or Mesh()
    p = world.vector()
    count = stimulus.length.size
    acting = acting or Acting.plain(count - 1)
    rows = np.column_stack(
        [stimulus.calcium * acting.calcium, acting.attachment, acting.switch_off, acting.recruitment]
    )
    rest = {} if rest is None else rest
    held = (stimulus.length[0], *rows[0])
    if held not in rest:
        rest[held] = _settled(world, stimulus, rows[0], mesh, p)
    state = _State(*(part.copy() for part in rest[held]))
    start = _sample(state)
    fine = np.linspace(0, count - 1, (count - 1) * mesh.steps + 1)
    length = np.interp(fine, np.arange(count), stimulus.length)
    out = np.empty((count - 1, 3))
    kernel.advance(
        *state, length, np.repeat(rows, mesh.steps, axis=0), SAMPLE_S / mesh.steps, mesh.steps, mesh.first, mesh.dx,
        p, out,
    )  # fmt: skip
    tension, n_on, bound = np.vstack([start, out]).T
    parallel = world.values["kpe"] * GAMMA * np.maximum(stimulus.length, 0.0) + world.values["Fpe0"]
    return Answer(FORCE_SCALE * tension + parallel, n_on, bound)


def _sample(state: _State) -> Array:
    units = state.units
    return np.array([state.shared[kernel.TENSION], units[:, kernel.N_ON].mean(), units[:, kernel.Q0].mean()])


def _settled(world: World, stimulus: Stimulus, row: Array, mesh: Mesh, p: Array) -> _State:
    """Isometric at the first sample's length until force stands still."""
    strength = np.asarray(world.strength, dtype=np.float64)
    count = strength.size
    state = _State(np.zeros((count, mesh.bins)), np.zeros((count, kernel.ROWS)), np.zeros(kernel.SHARED), strength)
    for m in range(count):
        kernel.level(float(row[0]), mesh.first, mesh.dx, mesh.bins, p, state.units[m], state.n[m])
    # Ties bear what half-sarcomeres of one force differ by in strength, and nothing of the fibre's force.
    borne = strength * state.units[:, kernel.FORCE]
    tension = float(np.mean(borne))
    state.units[:, kernel.LENGTH] = GAMMA * stimulus.length[0] - series_length(tension, p)
    if p[At.UNIT_STIFFNESS] > 0.0:
        state.units[:, kernel.LENGTH] += (tension - borne) / p[At.UNIT_STIFFNESS]
    state.shared[kernel.TENSION] = tension
    if p[At.CREEP] > 0.0:
        state.shared[kernel.CREPT] = p[At.CREEP] * tension
        state.units[:, kernel.LENGTH] -= state.shared[kernel.CREPT]
    for steps, h, chunks in ((200, 1e-3, 100), (50, SAMPLE_S / mesh.steps, 8)):
        rows = np.repeat(row[None, :], steps, axis=0)
        length = np.full(steps + 1, stimulus.length[0])
        out = np.empty((1, 3))
        for _ in range(chunks):
            last = state.shared[kernel.TENSION]
            kernel.advance(*state, length, rows, h, steps, mesh.first, mesh.dx, p, out)
            if abs(state.shared[kernel.TENSION] - last) < mesh.still * steps * h:
                break
    return state
