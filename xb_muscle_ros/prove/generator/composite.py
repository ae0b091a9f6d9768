"""A composite: a fibre that lacks several things at once, recorded with ordinary error of the measurement."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from xb_muscle_ros.errors import UserError
from xb_muscle_ros.prove.generator.case import Concealed, dressed, full_enough, isometric_of, usable
from xb_muscle_ros.prove.generator.composite_mix import FAULT, CompositeSpec
from xb_muscle_ros.prove.generator.composite_sizes import LEAST_F0, MOST_F0, Sized, given
from xb_muscle_ros.prove.generator.effects import EFFECTS
from xb_muscle_ros.prove.generator.fibres import drawn_around, fibres_with, nominal
from xb_muscle_ros.prove.generator.ordinary import draw_ordinary, with_artefacts
from xb_muscle_ros.prove.generator.recording import Faults, noise
from xb_muscle_ros.prove.generator.study import Planned, plan
from xb_muscle_ros.prove.generator.truth import study_forces
from xb_muscle_ros.prove.generator.world import World

Array = npt.NDArray[np.float64]

# Draws of a fibre in which every effect has to be of the size that is meant, and draws in all.
_STRICT, _ATTEMPTS = 4, 40
# What an artefact is to leave: force (F0), or an error that goes so many SDs of what is ordinary.
_FAULT_F0, _FAULT_SD = 0.0015, 2.5


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
    around = nominal(fibre, spec.model)
    values = drawn_around(around, random)
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
        concealed, sizes = sized.scaled(concealed, spec.sizes, LEAST_F0 if strict else 0.0)
        forces = study_forces(dressed(concealed, base), sized.stimuli)
        if usable(study, forces):
            break
        if not concealed:
            return None
    else:
        return None
    if strict and not all(LEAST_F0 <= size <= MOST_F0 for size in sizes):
        return None
    faults = with_artefacts(spec.artefacts, random, study, ordinary)
    artefacts_left = None
    if spec.kind == FAULT:
        taken = sized.of_faults(faults)
        artefacts_left = taken.rms, float(np.max(np.abs(taken.pulled[sized.constants :])))
        if strict and artefacts_left[0] < _FAULT_F0 and artefacts_left[1] < _FAULT_SD:
            return None
        # What is recorded follows from what was in the bath and at the motor, artefacts and all.
        forces = study_forces(dressed(concealed, base), given(study, faults))
    shares = [float(force[0]) for force in forces]
    noises = [noise(random, f.size, share / max(shares)) for f, share in zip(forces, shares, strict=True)]
    return Composite(
        spec, fibre, around, dict(values), study, concealed, sizes, ordinary, faults, artefacts_left,
        recorded=[faults.recorded(f, i) + drawn for i, (f, (drawn, _)) in enumerate(zip(forces, noises, strict=True))],
        noise_sd=[sd for _, sd in noises],
        before=float(np.sqrt(np.mean(sized.difference(concealed) ** 2))),
    )  # fmt: skip
