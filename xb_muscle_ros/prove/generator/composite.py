"""A composite: a fibre that lacks several things at once, recorded with ordinary error of the measurement."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.prove.generator.case import Concealed, dressed, full_enough, isometric_of, usable
from xb_muscle_ros.prove.generator.composite_mix import FAULT, CompositeSpec
from xb_muscle_ros.prove.generator.effects import EFFECTS
from xb_muscle_ros.prove.generator.fibres import drawn_around, fibres_with, nominal
from xb_muscle_ros.prove.generator.nuisances import error_columns
from xb_muscle_ros.prove.generator.ordinary import ORDINARY, draw_ordinary, with_artefacts
from xb_muscle_ros.prove.generator.recording import Faults, noise
from xb_muscle_ros.prove.generator.refit import Refit
from xb_muscle_ros.prove.generator.rest import Rest, Taken
from xb_muscle_ros.prove.generator.study import Planned, plan
from xb_muscle_ros.prove.generator.truth import study_forces
from xb_muscle_ros.prove.generator.world import Mesh, Stimulus, World

Array = npt.NDArray[np.float64]

# Draws of a fibre in which every effect has to be of the size that is meant, and draws in all.
_STRICT, _ATTEMPTS = 8, 40
_LEAST_F0, _MOST_F0 = 0.003, 0.05
_NEAR = 0.25
_ROUNDS, _WEAKER = 2, 4
# What an artefact is to leave: force (F0), or an error that goes so many SDs of what is ordinary.
_FAULT_F0, _FAULT_SD = 0.0015, 2.5
# Differences and slopes want little: 1 ms steps are good to 0.05 % F0, the same with and without an effect.
_COARSE = Mesh(steps=2, dx=0.2)
_COARSEST = Mesh(steps=1, dx=0.2, still=1e-5)
_LESS = 0.6


class Composite(NamedTuple):
    """A finished case.

    Attributes:
        spec: what it was to be.
        fibre: whose constants it was drawn around.
        nominal: constants of the fibre file that goes with it.
        values: the true constants.
        study: planned trials in the order of recording.
        concealed: effects, in the order of the spec.
        sizes: what each leaves beside the rest, F0.
        ordinary: errors of the measurement that are ordinary.
        faults: all errors, artefacts among them.
        artefacts_left: what artefacts leave, F0, and the farthest that they pull an ordinary error, in its SDs.
        recorded: force as recorded, F0, noise and all, by trial.
        noise_sd: of each trial, F0.
        left: what a refit of the plain base with ordinary errors leaves of all effects together, F0, by trial.
        before: RMS difference to the base with the true constants, F0, without errors of the measurement.
    """

    spec: CompositeSpec
    fibre: str
    nominal: dict[str, float]
    values: dict[str, float]
    study: list[Planned]
    concealed: list[Concealed]
    sizes: list[float]
    ordinary: Faults
    faults: Faults
    artefacts_left: tuple[float, float] | None
    recorded: list[Array]
    noise_sd: list[float]
    left: list[Array]
    before: float

    @property
    def model(self) -> str:
        """That the tool is given."""
        return self.spec.model


def make_composite(spec: CompositeSpec, seed: int, number: int) -> Composite:
    """Draw until the fibre is one that a physiologist would have kept, and its effects are of the sizes meant.

    Raises:
        UserError: none was found, which tells of a mix that cannot be made.
    """
    for attempt in range(_ATTEMPTS):
        case = _attempt(spec, np.random.default_rng([seed, number, attempt + 1]), attempt < _STRICT)
        if case is not None:
            return case
    raise UserError(
        f"case {number} ({', '.join([*spec.labels, *spec.artefacts]) or 'null'}, {spec.model}): no usable fibre in "
        f"{_ATTEMPTS} draws; take another seed"
    )


def _attempt(spec: CompositeSpec, random: np.random.Generator, strict: bool) -> Composite | None:
    """A case of one draw; None where it is not usable, or where `strict` and of another size than meant."""
    fibre = str(random.choice(fibres_with(spec.model)))
    given = nominal(fibre, spec.model)
    values = drawn_around(given, random)
    base = World(spec.model, values)
    if not full_enough(base):
        return None
    concealed = [Concealed(label, EFFECTS[label].start, EFFECTS[label].draw(random)) for label in spec.labels]
    # Levels of calcium are chosen by what the fibre does, which its effects change; so perhaps twice.
    for _ in range(2):
        study = plan(random, isometric_of(concealed, base), spec.model.endswith("_rigid"), spec.trials)
        if study is None:
            return None
        ordinary = draw_ordinary(random, study)
        sized = Sized(base, study, ordinary)
        concealed, sizes = sized.scaled(concealed, spec.sizes)
        forces = study_forces(dressed(concealed, base), sized.stimuli)
        if usable(study, forces):
            break
        if not concealed:
            return None
    else:
        return None
    if strict and not all(_LEAST_F0 <= size <= (1.0 + _NEAR) * _MOST_F0 for size in sizes):
        return None
    faults = with_artefacts(spec.artefacts, random, study, ordinary)
    artefacts_left = None
    if spec.kind == FAULT:
        taken = sized.of_faults(faults)
        artefacts_left = taken.rms, float(np.max(np.abs(taken.pulled[sized.constants :])))
        if strict and artefacts_left[0] < _FAULT_F0 and artefacts_left[1] < _FAULT_SD:
            return None
        # What is recorded follows from what was in the bath and at the motor, artefacts and all.
        forces = study_forces(dressed(concealed, base), _given(study, faults))
    shares = [float(force[0]) for force in forces]
    noises = [noise(random, f.size, share / max(shares)) for f, share in zip(forces, shares, strict=True)]
    difference = sized.difference(concealed)
    return Composite(
        spec, fibre, given, dict(values), study, concealed, sizes, ordinary, faults, artefacts_left,
        recorded=[faults.recorded(f, i) + drawn for i, (f, (drawn, _)) in enumerate(zip(forces, noises, strict=True))],
        noise_sd=[sd for _, sd in noises],
        left=sized.split(sized.plain.take(difference).left),
        before=float(np.sqrt(np.mean(difference**2))),
    )  # fmt: skip


def _given(study: Sequence[Planned], faults: Faults) -> list[Stimulus]:
    """What the fibre was truly given."""
    return [trial.stimulus(faults.pca_shift.get(trial.pca, 0.0), faults.length_gain) for trial in study]


class Sized:
    """Sizes of effects in one fibre and one study with its ordinary errors.

    Attributes:
        stimuli: what the fibre was truly given, by ordinary errors.
        constants: how many of the base can be fitted.
        plain: what the base and ordinary errors can take up.
    """

    def __init__(self, base: World, study: Sequence[Planned], ordinary: Faults) -> None:
        """Take slopes of the base."""
        self._base, self._study, self._ordinary = base, study, ordinary
        self.stimuli = _given(study, ordinary)
        columns, self.constants = self._columns([])
        self.plain = Rest(columns, len(study))
        self._plain_force = self._force([])

    def difference(self, concealed: Sequence[Concealed]) -> Array:
        """What effects change, F0, samples of all trials."""
        return self._force(concealed) - self._plain_force

    def split(self, joined: Array) -> list[Array]:
        """Samples of all trials by trial."""
        return np.split(joined, np.cumsum([s.length.size for s in self.stimuli])[:-1])

    def of_faults(self, faults: Faults) -> Taken:
        """What is left of all that artefacts change beyond the ordinary errors, by a refit of the base."""
        world = dressed([], self._base)
        both = [
            [f.recorded(force, i) for i, force in enumerate(study_forces(world, _given(self._study, f), _COARSE))]
            for f in (faults, self._ordinary)
        ]
        return self.plain.take(np.concatenate(both[0]) - np.concatenate(both[1]))

    def scaled(self, concealed: list[Concealed], sizes: Sequence[float]) -> tuple[list[Concealed], list[float]]:
        """Effects at scales that leave about what is asked for beside the rest, within what is plausible.

        Returns:
            The effects, and what each leaves, F0; not finite where the fibre is not usable.
        """
        if not concealed:
            return [], []
        concealed = self._kept([self._alone(c, size) for c, size in zip(concealed, sizes, strict=True)])
        slopes, taken_at = self._columns(concealed), concealed
        found = self._beside_rest(concealed, slopes)
        for _ in range(_ROUNDS):
            factors = [float(np.clip(s / max(f, 1e-9), 0.3, 3.0)) for s, f in zip(sizes, found, strict=True)]
            # A size that is not finite fails every comparison: such a fibre is not usable.
            if not max(abs(factor - 1.0) for factor in factors) >= _NEAR:
                break
            wanted = self._kept([_times(c, factor) for c, factor in zip(concealed, factors, strict=True)])
            if wanted == concealed:
                break
            concealed, found = wanted, self._beside_rest(wanted, slopes)
        if concealed != taken_at:
            found = self._beside_rest(concealed, self._columns(concealed))
        return concealed, found

    def _kept(self, concealed: list[Concealed]) -> list[Concealed]:
        """So much less of all effects that the fibre is one that is kept; perhaps in vain."""
        for _ in range(_WEAKER):
            if usable(self._study, self.split(self._force(concealed))):
                break
            concealed = [_times(c, _LESS) for c in concealed]
        return concealed

    def _alone(self, concealed: Concealed, size: float) -> Concealed:
        """The effect at a scale at which it alone leaves about so much."""
        for _ in range(4):
            left = self.plain.take(self.difference([concealed])).rms
            if not np.isfinite(left):
                concealed = _times(concealed, 0.3)
                continue
            factor = float(np.clip(size / max(left, 1e-9), 0.05, 20.0))
            concealed = _times(concealed, factor)
            if abs(factor - 1.0) < _NEAR:
                break
        return concealed

    def _beside_rest(self, concealed: Sequence[Concealed], slopes: tuple[Array, int]) -> list[float]:
        """What each effect leaves if the model has all others, and all that the model has is fitted again, F0."""
        whole = self._force(concealed)
        without = [self._force([c for j, c in enumerate(concealed) if j != i]) for i in range(len(concealed))]
        columns, constants = slopes
        rest = Rest(columns, len(self._study))
        return [rest.without(constants + i).take(whole - other).rms for i, other in enumerate(without)]

    def _columns(self, concealed: Sequence[Concealed]) -> tuple[Array, int]:
        """Slopes at a truth: constants, then logarithms of the effects' scales, then ordinary errors.

        Returns:
            Shape (samples, coordinates); how many constants there are.
        """
        refit = Refit(self._base, self.stimuli, lambda world: dressed(concealed, world), _COARSEST)
        plain = refit.plain()
        scales = []
        for i, c in enumerate(concealed):
            more = [*concealed[:i], c._replace(scale=1.05 * c.scale), *concealed[i + 1 :]]
            scales.append((self._force(more, _COARSEST) - np.concatenate(plain)) / 0.05)
        errors = error_columns(
            lambda shift, gain: study_forces(
                dressed(concealed, self._base), [_moved(s, shift, gain) for s in self.stimuli], _COARSEST
            ),
            self._study, plain, ORDINARY,
        )  # fmt: skip
        return np.column_stack([refit.jacobian, *scales, *errors]), refit.jacobian.shape[1]

    def _force(self, concealed: Sequence[Concealed], mesh: Mesh = _COARSEST) -> Array:
        return np.concatenate(study_forces(dressed(concealed, self._base), self.stimuli, mesh))


def _moved(stimulus: Stimulus, shift: float, gain: float) -> Stimulus:
    """The same at a pCa higher by `shift`, with length changes larger by `gain`."""
    return Stimulus((1.0 + gain) * stimulus.length, stimulus.calcium * 10.0**-shift)


def _times(concealed: Concealed, factor: float) -> Concealed:
    return concealed._replace(scale=min(concealed.scale * factor, EFFECTS[concealed.label].most))
