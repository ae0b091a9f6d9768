"""Unique contributions of the effects of a composite: what nothing else that is there can make up for."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from xb_muscle_ros.diagnose.names import Name
from xb_muscle_ros.prove.generator.artefacts import ORDINARY, Artefacts
from xb_muscle_ros.prove.generator.case import Concealed, dressed, forces_of, usable
from xb_muscle_ros.prove.generator.effects import EFFECTS
from xb_muscle_ros.prove.generator.nuisances import artefact_columns
from xb_muscle_ros.prove.generator.refit import Refit
from xb_muscle_ros.prove.generator.rest import LinearFit, Rest
from xb_muscle_ros.prove.generator.study import Planned
from xb_muscle_ros.prove.generator.world import Mesh, Stimulus, World
from xb_muscle_ros.trials.trial import Array

LEAST_F0, MOST_F0 = 0.003, 0.05
"""Bounds of the unique contribution of an effect, F0."""
# What one effect may change of the force before any refit (RMS), F0: more, and it is hardly one effect among others.
_USUAL_CHANGE_F0 = 0.2
# What stands in for a part of the base changes more.
_CHANGE_F0: Mapping[str, float] = {
    Name.SERIES_COMPLIANCE: 0.3,
    Name.THIN_FILAMENT_COOPERATIVITY: 0.3,
    Name.THICK_FILAMENT_COOPERATIVITY: 0.3,
}
# Effects that are brief or weak need more than single ones do to be of any size; the change of force bounds them.
_MORE: Mapping[str, float] = {Name.VISCOUS_DRAG: 2.0, Name.WEAKLY_BOUND_HEADS: 3.0}
# First-order refits leave so much more than true ones, and so much more yet for each other effect in the model.
_LINEAR, _BESIDE = 1.7, 0.3
# A scale that is to change by less than this is near enough.
_NEAR = 0.4
# What a scale is changed by at once: refits of large effects end early and leave too much.
_AT_ONCE = (0.5, 2.0)
# How often refits take slopes anew, to scale an effect and to say its size.
_ROUGHLY, _WELL = 0, 6
# How often, and by what, all effects are made weaker where nobody would have kept the fibre.
_WEAKER, _LESS = 4, 0.6
# Steps of 1 ms are good to 0.05 % F0, the same with and without an effect.
_COARSEST = Mesh(steps=1, dx=0.2, still=1e-5)
_forces = functools.partial(forces_of, mesh=_COARSEST)


class Sized:
    """Sizes of effects in one fibre and one study with its ordinary artefacts.

    Attributes:
        stimuli: what the fibre was truly given, by ordinary artefacts.
        constants: how many of the base can be fitted.
        plain: what the base and ordinary artefacts can take up.
    """

    def __init__(self, base: World, study: Sequence[Planned], ordinary: Artefacts) -> None:
        """Take slopes of the base."""
        self._base, self._study, self._ordinary = base, study, ordinary
        self.stimuli = ordinary.given(study)
        slopes = self._slopes(base, [])
        self.constants = slopes.constants
        self.plain = Rest(slopes.columns, len(study))
        self._plain_force = self._force([])

    def difference(self, concealed: Sequence[Concealed]) -> Array:
        """What effects change, F0, samples of all trials."""
        return self._force(concealed) - self._plain_force

    def of_artefacts(self, artefacts: Artefacts) -> LinearFit:
        """Residual of all that artefacts change beyond the ordinary ones, after a linear refit of the base."""
        both = [
            [f.recorded(force, i) for i, force in enumerate(_forces([], self._base, f.given(self._study)))]
            for f in (artefacts, self._ordinary)
        ]
        return self.plain.fit(np.concatenate(both[0]) - np.concatenate(both[1]))

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
        if not all(a.residual >= least for a in alone):
            return concealed, [a.residual for a in alone]
        concealed = self._kept([a.concealed for a in alone])
        found = self.unique_contributions(concealed, _ROUGHLY)
        # A size that is not finite fails every comparison: such a fibre is not usable.
        if any(size < LEAST_F0 or size > MOST_F0 for size in found):
            factors = [float(np.clip(s / max(f, 1e-9), *_AT_ONCE)) for s, f in zip(sizes, found, strict=True)]
            concealed = self._kept(
                [
                    c._replace(scale=min(c.scale * factor, a.most))
                    for c, factor, a in zip(concealed, factors, alone, strict=True)
                ]
            )
        return concealed, self.unique_contributions(concealed, _WELL)

    def _alone(self, concealed: Concealed, size: float) -> _Alone:
        """The effect at a scale at which it alone leaves about so much, by linear refits."""
        residual, plausible = np.nan, EFFECTS[concealed.label].most * _MORE.get(concealed.label, 1.0)
        most = plausible
        for _ in range(4):
            difference = self.difference([concealed])
            residual, change = self.plain.fit(difference).rms, float(np.sqrt(np.mean(difference**2)))
            factor = float(np.clip(size / max(residual, 1e-9), 0.05, 20.0)) if np.isfinite(residual) else 0.3
            within = _CHANGE_F0.get(concealed.label, _USUAL_CHANGE_F0) / change if np.isfinite(change) else 0.3
            most = min(plausible, concealed.scale * within)
            wanted = concealed._replace(scale=min(concealed.scale * factor, most))
            if abs(wanted.scale / concealed.scale - 1.0) < _NEAR:
                break
            concealed = wanted
        return _Alone(concealed, residual, most)

    def _kept(self, concealed: list[Concealed]) -> list[Concealed]:
        """So much less of all effects that the fibre is one that is kept; perhaps in vain."""
        for _ in range(_WEAKER):
            if usable(self._study, self._split(self._force(concealed))):
                break
            concealed = [c._replace(scale=_LESS * c.scale) for c in concealed]
        return concealed

    def unique_contributions(self, concealed: Sequence[Concealed], anew: int) -> list[float]:
        """What each effect leaves if the model has all others, and all that the model has is fitted again, F0.

        Args:
            anew: how often refits may take their slopes anew.
        """
        data = self._force(concealed)
        if not np.all(np.isfinite(data)):
            return [np.nan] * len(concealed)
        whole = self._slopes(self._base, concealed)
        return [self._residual_without(i, concealed, data, whole, anew) for i in range(len(concealed))]

    def _residual_without(
        self, i: int, concealed: Sequence[Concealed], data: Array, whole: _Slopes, anew: int
    ) -> float:
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
            return np.concatenate(_forces(changed, world, self.stimuli)) + errors @ (at[coordinates:])

        def slopes(at: Array) -> Array:
            refit, scales = self._of_model(*there(at))
            return np.column_stack([refit.jacobian, *scales, errors])

        return Rest(columns, len(self._study)).refit(data, model, slopes, coordinates, anew).rms

    def _slopes(self, base: World, concealed: Sequence[Concealed]) -> _Slopes:
        """Slopes at a truth."""
        refit, scales = self._of_model(base, concealed)
        errors = artefact_columns(
            lambda shift, gain: _forces(concealed, base, [_moved(s, shift, gain) for s in self.stimuli]),
            self._study, refit.plain(), ORDINARY,
        )  # fmt: skip
        return _Slopes(refit, np.column_stack([refit.jacobian, *scales, *errors]), refit.jacobian.shape[1])

    def _of_model(self, base: World, concealed: Sequence[Concealed]) -> tuple[Refit, list[Array]]:
        """Slopes by constants (in the refit) and by logarithms of the effects' scales."""
        refit = Refit(base, self.stimuli, lambda world: dressed(concealed, world), _COARSEST)
        plain = np.concatenate(refit.plain())
        scales = []
        for i, c in enumerate(concealed):
            more = [*concealed[:i], c._replace(scale=1.05 * c.scale), *concealed[i + 1 :]]
            scales.append((np.concatenate(_forces(more, base, self.stimuli)) - plain) / 0.05)
        return refit, scales

    def _force(self, concealed: Sequence[Concealed]) -> Array:
        return np.concatenate(_forces(concealed, self._base, self.stimuli))

    def _split(self, joined: Array) -> list[Array]:
        return np.split(joined, np.cumsum([s.length.size for s in self.stimuli])[:-1])


class _Alone(NamedTuple):
    """An effect as it is alone, what it leaves by a linear refit, F0, and the scale that is not to be exceeded."""

    concealed: Concealed
    residual: float
    most: float


class _Slopes(NamedTuple):
    """Change of all forces, F0, by one prior SD of each coordinate.

    Attributes:
        columns: constants, logarithms of the effects' scales, ordinary artefacts; shape (samples, coordinates).
        constants: how many there are.
    """

    refit: Refit
    columns: Array
    constants: int


def _moved(stimulus: Stimulus, shift: float, gain: float) -> Stimulus:
    """The same at a pCa higher by `shift`, with length changes larger by `gain`."""
    return Stimulus((1.0 + gain) * stimulus.length, stimulus.calcium * 10.0**-shift)
