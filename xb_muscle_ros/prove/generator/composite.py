"""A composite: a fibre that lacks several things at once, recorded with ordinary error of the measurement."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.diagnose.names import Name
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
_STRICT, _ATTEMPTS = 4, 40
_LEAST_F0, _MOST_F0 = 0.003, 0.05
_NEAR = 0.4
_WEAKER = 4
_LINEAR, _BESIDE = 1.7, 0.3
# What a scale is changed by at once: fits of large effects end early and leave too much.
_AT_ONCE = (0.5, 2.0)
# What one effect may change of the force before any refit (RMS), F0: more, and it is hardly one effect among others.
_USUAL_CHANGE_F0 = 0.2
# What stands in for a part of the base changes more.
_CHANGE_F0 = {
    name.value: 0.3
    for name in (Name.SERIES_COMPLIANCE, Name.THIN_FILAMENT_COOPERATIVITY, Name.THICK_FILAMENT_COOPERATIVITY)
}
# What an artefact is to leave: force (F0), or an error that goes so many SDs of what is ordinary.
_FAULT_F0, _FAULT_SD = 0.0015, 2.5
# Differences and slopes want little: 1 ms steps are good to 0.05 % F0, the same with and without an effect.
_COARSE = Mesh(steps=2, dx=0.2)
_COARSEST = Mesh(steps=1, dx=0.2, still=1e-5)
_LESS = 0.6
# Effects that are brief or weak need more than single ones do to be of any size; the change of force bounds them.
_MORE = {Name.VISCOUS_DRAG.value: 2.0, Name.WEAKLY_BOUND_HEADS.value: 3.0}


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
        concealed, sizes = sized.scaled(concealed, spec.sizes, _LEAST_F0 if strict else 0.0)
        forces = study_forces(dressed(concealed, base), sized.stimuli)
        if usable(study, forces):
            break
        if not concealed:
            return None
    else:
        return None
    if strict and not all(_LEAST_F0 <= size <= _MOST_F0 for size in sizes):
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
    return Composite(
        spec, fibre, given, dict(values), study, concealed, sizes, ordinary, faults, artefacts_left,
        recorded=[faults.recorded(f, i) + drawn for i, (f, (drawn, _)) in enumerate(zip(forces, noises, strict=True))],
        noise_sd=[sd for _, sd in noises],
        before=float(np.sqrt(np.mean(sized.difference(concealed) ** 2))),
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
        slopes = self._slopes(base, [])
        self.constants = slopes.constants
        self.plain = Rest(slopes.columns, len(study))
        self._plain_force = self._force([])

    def difference(self, concealed: Sequence[Concealed]) -> Array:
        """What effects change, F0, samples of all trials."""
        return self._force(concealed) - self._plain_force

    def of_faults(self, faults: Faults) -> Taken:
        """What is left of all that artefacts change beyond the ordinary errors, by a linear refit of the base."""
        world = dressed([], self._base)
        both = [
            [f.recorded(force, i) for i, force in enumerate(study_forces(world, _given(self._study, f), _COARSE))]
            for f in (faults, self._ordinary)
        ]
        return self.plain.take(np.concatenate(both[0]) - np.concatenate(both[1]))

    def scaled(
        self, concealed: list[Concealed], sizes: Sequence[float], least: float
    ) -> tuple[list[Concealed], list[float]]:
        """Effects at scales that leave about what is asked for beside the rest, within what is plausible.

        Args:
            concealed: at usual scales.
            sizes: asked for, F0.
            least: no more is done where an effect leaves less than this even alone, F0.

        Returns:
            The effects, and what each leaves, F0; not finite where the fibre is not usable.
        """
        if not concealed:
            return [], []
        # True refits leave less than linear ones, and less beside others than alone.
        more = _LINEAR * (1.0 + _BESIDE * (len(concealed) - 1))
        alone = [self._alone(c, more * size) for c, size in zip(concealed, sizes, strict=True)]
        # What leaves too little by itself leaves less beside others.
        if not all(a.left >= least for a in alone):
            return concealed, [a.left for a in alone]
        concealed = self._kept([a.concealed for a in alone])
        found = self.beside_rest(concealed)
        # A size that is not finite fails every comparison: such a fibre is not usable.
        if any(size < _LEAST_F0 or size > _MOST_F0 for size in found):
            factors = [float(np.clip(s / max(f, 1e-9), *_AT_ONCE)) for s, f in zip(sizes, found, strict=True)]
            wanted = self._kept(
                [
                    c._replace(scale=min(c.scale * factor, a.most))
                    for c, factor, a in zip(concealed, factors, alone, strict=True)
                ]
            )
            if wanted != concealed:
                concealed, found = wanted, self.beside_rest(wanted)
        return concealed, found

    def _alone(self, concealed: Concealed, size: float) -> _Alone:
        """The effect at a scale at which it alone leaves about so much, by linear refits."""
        left, plausible = np.nan, EFFECTS[concealed.label].most * _MORE.get(concealed.label, 1.0)
        most = plausible
        for _ in range(4):
            difference = self.difference([concealed])
            left, change = self.plain.take(difference).rms, float(np.sqrt(np.mean(difference**2)))
            factor = float(np.clip(size / max(left, 1e-9), 0.05, 20.0)) if np.isfinite(left) else 0.3
            within = _CHANGE_F0.get(concealed.label, _USUAL_CHANGE_F0) / change if np.isfinite(change) else 0.3
            most = min(plausible, concealed.scale * within)
            wanted = concealed._replace(scale=min(concealed.scale * factor, most))
            if abs(wanted.scale / concealed.scale - 1.0) < _NEAR:
                break
            concealed = wanted
        return _Alone(concealed, left, most)

    def _kept(self, concealed: list[Concealed]) -> list[Concealed]:
        """So much less of all effects that the fibre is one that is kept; perhaps in vain."""
        for _ in range(_WEAKER):
            if usable(self._study, self._split(self._force(concealed))):
                break
            concealed = [c._replace(scale=_LESS * c.scale) for c in concealed]
        return concealed

    def beside_rest(self, concealed: Sequence[Concealed]) -> list[float]:
        """What each effect leaves if the model has all others, and all that the model has is fitted again, F0."""
        data = self._force(concealed)
        if not np.all(np.isfinite(data)):
            return [np.nan] * len(concealed)
        whole = self._slopes(self._base, concealed)
        return [self._left_without(i, concealed, data, whole) for i in range(len(concealed))]

    def _left_without(self, i: int, concealed: Sequence[Concealed], data: Array, whole: _Slopes) -> float:
        """RMS that a refit of everything but effect i leaves, F0."""
        others = [c for j, c in enumerate(concealed) if j != i]
        # Constants, and scales of the others, by their logarithms; then errors, in SDs.
        constants, coordinates = self.constants, self.constants + len(others)
        columns = np.delete(whole.columns, constants + i, axis=1)
        errors = columns[:, coordinates:]

        def there(at: Array) -> tuple[World, list[Concealed]]:
            changed = [c._replace(scale=c.scale * np.exp(s)) for c, s in zip(others, at[constants:], strict=False)]
            return self._base.with_values(whole.refit.values_at(at[:constants])), changed

        def model(at: Array) -> Array:
            world, changed = there(at)
            return (
                np.concatenate(study_forces(dressed(changed, world), self.stimuli, _COARSEST))
                + errors @ (at[coordinates:])
            )

        def slopes(at: Array) -> Array:
            return np.column_stack([self._slopes(*there(at)).columns[:, :coordinates], errors])

        return Rest(columns, len(self._study)).refit(data, model, slopes, coordinates).rms

    def _slopes(self, base: World, concealed: Sequence[Concealed]) -> _Slopes:
        """Slopes at a truth."""
        refit = Refit(base, self.stimuli, lambda world: dressed(concealed, world), _COARSEST)
        plain = np.concatenate(refit.plain())
        scales = []
        for i, c in enumerate(concealed):
            more = [*concealed[:i], c._replace(scale=1.05 * c.scale), *concealed[i + 1 :]]
            moved = study_forces(dressed(more, base), self.stimuli, _COARSEST)
            scales.append((np.concatenate(moved) - plain) / 0.05)
        errors = error_columns(
            lambda shift, gain: study_forces(
                dressed(concealed, base), [_moved(s, shift, gain) for s in self.stimuli], _COARSEST
            ),
            self._study, refit.plain(), ORDINARY,
        )  # fmt: skip
        return _Slopes(refit, np.column_stack([refit.jacobian, *scales, *errors]), refit.jacobian.shape[1])

    def _force(self, concealed: Sequence[Concealed]) -> Array:
        return np.concatenate(study_forces(dressed(concealed, self._base), self.stimuli, _COARSEST))

    def _split(self, joined: Array) -> list[Array]:
        return np.split(joined, np.cumsum([s.length.size for s in self.stimuli])[:-1])


class _Alone(NamedTuple):
    """An effect as it is alone, what it leaves by a linear refit, F0, and the scale that is not to be exceeded."""

    concealed: Concealed
    left: float
    most: float


class _Slopes(NamedTuple):
    """Change of all forces, F0, by one prior SD of each coordinate.

    Attributes:
        refit: of constants.
        columns: constants, then logarithms of the effects' scales, then ordinary errors; shape (samples, coordinates).
        constants: how many there are.
    """

    refit: Refit
    columns: Array
    constants: int


def _moved(stimulus: Stimulus, shift: float, gain: float) -> Stimulus:
    """The same at a pCa higher by `shift`, with length changes larger by `gain`."""
    return Stimulus((1.0 + gain) * stimulus.length, stimulus.calcium * 10.0**-shift)
