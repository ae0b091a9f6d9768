"""One case: a fibre, a study, what is concealed and what was recorded of it."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeVar

import numpy as np

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.prove.generator.artefacts import Artefacts
from xb_muscle_ros.prove.generator.effects import EFFECTS, Shape
from xb_muscle_ros.prove.generator.fibres import drawn_around, fibres_with, nominal
from xb_muscle_ros.prove.generator.mix import Spec
from xb_muscle_ros.prove.generator.noise import noise
from xb_muscle_ros.prove.generator.study import Planned, plan
from xb_muscle_ros.prove.generator.truth import Truth, study_forces, trial_force
from xb_muscle_ros.prove.generator.world import Mesh, Stimulus, World, isometric
from xb_muscle_ros.trials.trial import Array

C = TypeVar("C", bound="Case")

_ATTEMPTS = 40
_FULL = (0.7, 1.3)


class Concealed(NamedTuple):
    """An effect as it is in a truth."""

    label: str
    scale: float
    shape: Shape


class Drawn(NamedTuple):
    """A fibre that may become a case.

    Attributes:
        fibre: whose constants it was drawn around.
        nominal: constants of the fibre file that goes with it.
        base: the true fibre without effects.
        concealed: its effects at usual scales.
    """

    fibre: str
    nominal: dict[str, float]
    base: World
    concealed: list[Concealed]


@dataclass(frozen=True)
class Case:
    """A finished case.

    Attributes:
        fibre, nominal: as in `Drawn`.
        values: the true constants.
        study: planned trials in the order of recording.
        concealed: effects, in the order of the spec.
        recorded: force as recorded, F0, noise and all, by trial.
        noise_sd: of each trial, F0.
        before: RMS difference to the base with the true constants, F0.
    """

    spec: Spec
    fibre: str
    nominal: dict[str, float]
    values: dict[str, float]
    study: list[Planned]
    concealed: list[Concealed]
    artefacts: Artefacts
    recorded: list[Array]
    noise_sd: list[float]
    before: float

    def facts(self) -> dict[str, Any]:
        """What the key says of this kind of case alone."""
        return {}


def drawn_until(
    attempt: Callable[[Drawn, np.random.Generator, int], C | None], spec: Spec, seed: int, number: int
) -> C:
    """Draw until the fibre is one that a physiologist would have kept.

    Args:
        attempt: a case of a fibre that was drawn, what draws, and the draw's number from 0 on; None where it is not
            usable.

    Raises:
        UserError: none was found, which tells of a mix that cannot be made.
    """
    for k in range(_ATTEMPTS):
        random = np.random.default_rng([seed, number, k + 1])
        found = _drawn(spec, random)
        case = None if found is None else attempt(found, random, k)
        if case is not None:
            return case
    what = ", ".join([*spec.labels, *spec.artefacts]) or "null"
    raise UserError(f"case {number} ({what}, {spec.model}): no usable fibre in {_ATTEMPTS} draws; take another seed")


def _drawn(spec: Spec, random: np.random.Generator) -> Drawn | None:
    """A fibre with the effects of a spec; None where nobody would keep it for its force at full activation."""
    fibre = str(random.choice(fibres_with(spec.model)))
    given = nominal(fibre, spec.model)
    base = World(spec.model, drawn_around(given, random))
    if not _FULL[0] <= isometric(base, 10.0**1.5) <= _FULL[1]:
        return None
    return Drawn(fibre, given, base, usual(spec, random))


def usual(spec: Spec, random: np.random.Generator) -> list[Concealed]:
    """The effects of a spec at usual scales, their forms drawn."""
    return [Concealed(label, EFFECTS[label].start, EFFECTS[label].draw(random)) for label in spec.labels]


def planned(
    spec: Spec, random: np.random.Generator, concealed: Sequence[Concealed], base: World
) -> list[Planned] | None:
    """Its study: levels of calcium are chosen by the isometric force of the fibre with its effects."""
    truth = dressed(concealed, base)
    rest = np.zeros(2)

    @functools.cache
    def force(pca: float) -> float:
        calcium = 10.0 ** (6.0 - pca)
        if truth.world is base:
            return isometric(base, calcium)
        return float(trial_force(truth, [Stimulus(rest, calcium)], 0)[0])

    return plan(random, force, spec.model.endswith("_rigid"), spec.trials)


def noises(random: np.random.Generator, forces: Sequence[Array]) -> list[tuple[Array, float]]:
    """Noise of every trial, F0, and its SD."""
    shares = [float(force[0]) for force in forces]
    return [noise(random, f.size, share / max(shares)) for f, share in zip(forces, shares, strict=True)]


def dressed(concealed: Sequence[Concealed], base: World) -> Truth:
    """The fibre with its effects."""
    truth = Truth(base)
    for label, scale, shape in concealed:
        truth = EFFECTS[label].apply(truth, scale, shape)
    return truth


def forces_of(
    concealed: Sequence[Concealed], base: World, stimuli: Sequence[Stimulus], mesh: Mesh | None = None
) -> list[Array]:
    """Force of the fibre with its effects, F0, by trial."""
    return study_forces(dressed(concealed, base), stimuli, mesh)


def usable(study: Sequence[Planned], forces: Sequence[Array]) -> bool:
    """Whether the fibre is plausible: finite, strong, steady at first, and at three levels between rest and full."""
    if not all(np.all(np.isfinite(force)) and np.max(np.abs(force)) < 6.0 for force in forces):
        return False
    full = [float(f[0]) for t, f in zip(study, forces, strict=True) if t.pca == 4.5]
    if not all(_FULL[0] <= force <= _FULL[1] for force in full):
        return False
    shares = {t.pca: float(f[0]) / max(full) for t, f in zip(study, forces, strict=True)}
    return sum(0.1 <= share <= 0.92 for pca, share in shares.items() if 4.5 < pca < 9.0) >= 3


def rms(parts: Sequence[Array]) -> float:
    """Root mean square over all trials."""
    return float(np.sqrt(np.mean(np.concatenate(list(parts)) ** 2)))


def trial_name(i: int) -> str:
    """Name of trial i, from 0 on."""
    return f"trial_{i + 1:02d}"
