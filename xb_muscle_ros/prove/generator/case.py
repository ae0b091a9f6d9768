"""One case: a fibre, a study, what is concealed, and how much of it a refit leaves."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.prove.generator.effects import EFFECTS, Shape
from xb_muscle_ros.prove.generator.fibres import drawn_around, fibres_with, nominal
from xb_muscle_ros.prove.generator.mix import SIZES, Spec
from xb_muscle_ros.prove.generator.nuisances import left_beside_nuisances
from xb_muscle_ros.prove.generator.recording import Faults, draw_faults, noise
from xb_muscle_ros.prove.generator.refit import Refit, Refitted
from xb_muscle_ros.prove.generator.study import Planned, plan
from xb_muscle_ros.prove.generator.truth import Truth, study_forces
from xb_muscle_ros.prove.generator.world import World, isometric
from xb_muscle_ros.work import JsonValue

Array = npt.NDArray[np.float64]

_ATTEMPTS = 60
_FULL = (0.7, 1.3)
# Sizes within this of what was asked for are as asked for.
_NEAR = 0.12
_BELOW = 0.85


class Concealed(NamedTuple):
    """An effect as it is in a truth."""

    label: str
    scale: float
    shape: Shape


class Case(NamedTuple):
    """A finished case.

    Attributes:
        spec: what it was to be.
        fibre: whose constants it was drawn around.
        nominal: constants of the fibre file that goes with it.
        values: the true constants.
        study: planned trials in the order of recording.
        concealed: effects.
        faults: of the measurement.
        recorded: force as recorded, F0, noise and all, by trial.
        noise_sd: of each trial, F0.
        refitted: what a refit of the plain base leaves of the noise-free recording.
        before: RMS difference to the base with the true constants, F0.
        beside_nuisances: RMS left when usual faults of the measurement may explain it as well, F0.
    """

    spec: Spec
    fibre: str
    nominal: dict[str, float]
    values: dict[str, float]
    study: list[Planned]
    concealed: list[Concealed]
    faults: Faults
    recorded: list[Array]
    noise_sd: list[float]
    refitted: Refitted
    before: float
    beside_nuisances: float


def make_case(spec: Spec, seed: int, number: int) -> Case:
    """Draw until the fibre is one that a physiologist would have kept.

    Raises:
        UserError: none was found, which tells of a mix that cannot be made.
    """
    for attempt in range(_ATTEMPTS):
        case = _attempt(spec, np.random.default_rng([seed, number, attempt + 1]))
        if case is not None:
            return case
    raise UserError(
        f"case {number} ({', '.join(spec.labels) or 'null'}, {spec.model}): no usable fibre in {_ATTEMPTS} draws; "
        "take another seed"
    )


def _attempt(spec: Spec, random: np.random.Generator) -> Case | None:
    fibre = str(random.choice(fibres_with(spec.model)))
    given = nominal(fibre, spec.model)
    values = drawn_around(given, random)
    base = World(spec.model, values)
    if not _FULL[0] <= isometric(base, 10.0**1.5) <= _FULL[1]:
        return None
    study = plan(random, lambda pca: isometric(base, 10.0 ** (6.0 - pca)), spec.model.endswith("_rigid"))
    if study is None:
        return None
    faults = draw_faults(spec.labels[0], random, study) if spec.kind == "fault" else Faults()
    refit = Refit(base, [trial.stimulus() for trial in study])
    forces, concealed, refitted = _conceal(spec, base, study, faults, refit, random)
    shares = [float(force[0]) for force in forces]
    if not _usable(study, forces):
        return None
    full = max(shares)
    noises = [noise(random, force.size, share / full) for force, share in zip(forces, shares, strict=True)]
    plain = np.concatenate(refit.plain())
    return Case(
        spec, fibre, given, values, study, concealed, faults,
        recorded=[force + drawn for force, (drawn, _) in zip(forces, noises, strict=True)],
        noise_sd=[sd for _, sd in noises],
        refitted=refitted,
        before=float(np.sqrt(np.mean((np.concatenate(forces) - plain) ** 2))),
        beside_nuisances=left_beside_nuisances(base, study, refit, refitted),
    )  # fmt: skip


def _conceal(
    spec: Spec, base: World, study: list[Planned], faults: Faults, refit: Refit, random: np.random.Generator
) -> tuple[list[Array], list[Concealed], Refitted]:
    """Noise-free recording, the effects in it, and what a refit leaves of them."""
    if spec.size is None:
        plain = [trial.stimulus(faults.pca_shift.get(trial.pca, 0.0), faults.length_gain) for trial in study]
        forces = [faults.recorded(f, i) for i, f in enumerate(study_forces(Truth(base), plain))]
        if spec.kind == "null":
            zero = [np.zeros(force.size) for force in forces]
            return forces, [], Refitted(0.0, zero, dict(base.values))
        return forces, [], refit(forces)
    shapes = [EFFECTS[label].draw(random) for label in spec.labels]
    scales = [
        _scale_alone(label, shape, base, study, refit, spec.size / np.sqrt(len(shapes)))
        for label, shape in zip(spec.labels, shapes, strict=True)
    ]
    forces, refitted = [], Refitted(0.0, [], {})
    for _ in range(4):
        concealed = [Concealed(*row) for row in zip(spec.labels, scales, shapes, strict=True)]
        forces = _forces(concealed, base, study)
        refitted = refit(forces)
        if not np.isfinite(refitted.rms) or abs(refitted.rms / spec.size - 1.0) < _NEAR:
            break
        factor = float(np.clip(spec.size / refitted.rms, 0.1, 5.0))
        wanted = [min(scale * factor, EFFECTS[label].most) for label, scale in zip(spec.labels, scales, strict=True)]
        if wanted == scales:
            break
        scales = wanted
    return forces, concealed, refitted


def _scale_alone(
    label: str, shape: Shape, base: World, study: list[Planned], refit: Refit, size: float
) -> float:
    """Scale at which one effect leaves about so much, by linear refits."""
    effect = EFFECTS[label]
    scale = effect.start
    for _ in range(4):
        left = refit.left_at_once(_forces([Concealed(label, scale, shape)], base, study))
        if not np.isfinite(left):
            scale *= 0.3
            continue
        factor = float(np.clip(size / max(left, 1e-9), 0.05, 20.0))
        scale = min(scale * factor, effect.most)
        if abs(factor - 1.0) < 0.2:
            break
    return scale


def _forces(concealed: Sequence[Concealed], base: World, study: Sequence[Planned]) -> list[Array]:
    truth = Truth(base)
    for label, scale, shape in concealed:
        truth = EFFECTS[label].apply(truth, scale, shape)
    return study_forces(truth, [trial.stimulus() for trial in study])


def _usable(study: Sequence[Planned], forces: Sequence[Array]) -> bool:
    """Whether the fibre is plausible: finite, strong, steady at first, and at three levels between rest and full."""
    if not all(np.all(np.isfinite(force)) and np.max(np.abs(force)) < 6.0 for force in forces):
        return False
    full = [float(f[0]) for t, f in zip(study, forces, strict=True) if t.pca == 4.5]
    if not all(_FULL[0] <= force <= _FULL[1] for force in full):
        return False
    shares = {t.pca: float(f[0]) / max(full) for t, f in zip(study, forces, strict=True)}
    return sum(0.1 <= share <= 0.92 for pca, share in shares.items() if 4.5 < pca < 9.0) >= 3


def size_class(achieved: float) -> float:
    """The class of `SIZES` that a size belongs to: the highest that it reaches, 0 below all."""
    return max((size for size in SIZES if achieved >= _BELOW * size), default=0.0)


def cells(case: Case) -> list[dict[str, JsonValue]]:
    """RMS of what a refit leaves in every phase of every trial, F0."""
    out: list[dict[str, JsonValue]] = []
    for i, (trial, left) in enumerate(zip(case.study, case.refitted.left, strict=True)):
        for phase in trial.phases:
            first, last = (round(t * 1e3) for t in (phase.start_s, phase.end_s))
            part = left[first : last + 1]
            out.append({"trial": trial_name(i), "phase": phase.name, "rms_f0": float(np.sqrt(np.mean(part**2)))})
    return out


def trial_name(i: int) -> str:
    """Name of trial i."""
    return f"trial_{i + 1:02d}"
