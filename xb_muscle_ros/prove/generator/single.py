"""A single: a fibre that lacks at most one thing or a pair, and how much of it a refit leaves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from xb_muscle_ros.prove.generator.artefacts import Artefacts, draw_artefact
from xb_muscle_ros.prove.generator.case import (
    Case,
    Concealed,
    Drawn,
    drawn_until,
    forces_of,
    noises,
    planned,
    rms,
    trial_name,
    usable,
)
from xb_muscle_ros.prove.generator.effects import EFFECTS
from xb_muscle_ros.prove.generator.mix import NULL, SIZES, Spec
from xb_muscle_ros.prove.generator.nuisances import residual_beside_nuisances
from xb_muscle_ros.prove.generator.refit import Refit, Refitted
from xb_muscle_ros.prove.generator.study import Planned
from xb_muscle_ros.prove.generator.world import World
from xb_muscle_ros.trials.trial import Array

_ROUNDS = 7
# Sizes within this of what was asked for are as asked for.
_NEAR = 0.12
# An effect too strong for the fibre to be kept is tried again so much weaker.
_LESS = 0.6
_BELOW = 0.85


@dataclass(frozen=True)
class Single(Case):
    """A finished single.

    Attributes:
        refitted: what a refit of the plain base leaves of the noise-free recording.
        beside_nuisances: what is left when ordinary artefacts may explain it as well, F0, by trial.
    """

    refitted: Refitted
    beside_nuisances: list[Array]

    def facts(self) -> dict[str, Any]:
        """What the key says of singles alone."""
        found = facts(self.spec, self.study, self.concealed, self.refitted, self.beside_nuisances)
        return {**found, "refitted": self.refitted.values}


def facts(
    spec: Spec, study: Sequence[Planned], concealed: Sequence[Concealed], refitted: Refitted, beside: Sequence[Array]
) -> dict[str, Any]:
    """Sizes of what is concealed, as JSON can hold them."""
    return {
        "asked_size_f0": spec.size,
        "size_f0": refitted.rms,
        "size_class_f0": size_class(refitted.rms) if concealed else None,
        "beside_nuisances_f0": rms(beside),
        "concealed": [c._asdict() for c in concealed],
        "cells": cells(study, refitted.residual, beside),
    }


def make_single(spec: Spec, seed: int, number: int) -> Single:
    """See `case.drawn_until`."""
    return drawn_until(lambda found, random, _: _attempt(spec, found, random), spec, seed, number)


def _attempt(spec: Spec, found: Drawn, random: np.random.Generator) -> Single | None:
    """A case of one draw; None where it is not usable."""
    base, concealed = found.base, found.concealed
    # Levels of calcium are chosen by what the fibre does, which its effects change; so perhaps twice.
    for _ in range(2):
        study = planned(spec, random, concealed, base)
        if study is None:
            return None
        refit = Refit(base, [trial.stimulus() for trial in study])
        artefacts = draw_artefact(spec.artefacts[0], random, study) if spec.artefacts else Artefacts()
        concealed, forces, refitted = conceal(spec, concealed, base, study, artefacts, refit)
        if usable(study, forces):
            break
        if not concealed:
            return None
    else:
        return None
    noise = noises(random, forces)
    return Single(
        spec, found.fibre, found.nominal, dict(base.values), study, concealed, artefacts,
        recorded=[force + added for force, (added, _) in zip(forces, noise, strict=True)],
        noise_sd=[sd for _, sd in noise],
        before=rms([np.concatenate(forces) - np.concatenate(refit.plain())]),
        refitted=refitted,
        beside_nuisances=residual_beside_nuisances(base, study, refit, refitted),
    )  # fmt: skip


def conceal(
    spec: Spec, concealed: list[Concealed], base: World, study: list[Planned], artefacts: Artefacts, refit: Refit
) -> tuple[list[Concealed], list[Array], Refitted]:
    """The effects at the scale asked for, the noise-free recording, and what a refit leaves of it."""
    if spec.size is None:
        forces = [artefacts.recorded(f, i) for i, f in enumerate(forces_of([], base, artefacts.given(study)))]
        if spec.kind == NULL:
            zero = [np.zeros(force.size) for force in forces]
            return [], forces, Refitted(0.0, zero, dict(base.values), np.zeros(0))
        return [], forces, refit(forces)
    stimuli = [trial.stimulus() for trial in study]
    share = spec.size / np.sqrt(len(concealed))
    concealed = [c._replace(scale=_scale_alone(c, base, study, refit, share)) for c in concealed]
    refitted, most = None, np.inf
    for rounds in range(_ROUNDS):
        forces = forces_of(concealed, base, stimuli)
        if not usable(study, forces) and rounds < _ROUNDS - 1:
            # So much of it and nobody would have kept the fibre: less, and never again as much.
            concealed, most = _times(concealed, _LESS), 1.0
            continue
        refitted = refit(forces, refitted)
        factor = min(float(np.clip(spec.size / refitted.rms, 0.2, 5.0)), most)
        # A size that is not finite fails every comparison: such a fibre is not usable.
        if not abs(factor - 1.0) >= _NEAR:
            break
        wanted = _times(concealed, factor)
        if wanted == concealed or rounds == _ROUNDS - 1:
            break
        concealed = wanted
    assert refitted is not None
    return concealed, forces, refitted


def _times(concealed: Sequence[Concealed], factor: float) -> list[Concealed]:
    return [c._replace(scale=min(c.scale * factor, EFFECTS[c.label].most)) for c in concealed]


def _scale_alone(concealed: Concealed, base: World, study: list[Planned], refit: Refit, size: float) -> float:
    """Scale at which one effect leaves about so much, by linear refits."""
    most, scale = EFFECTS[concealed.label].most, concealed.scale
    stimuli = [trial.stimulus() for trial in study]
    for _ in range(4):
        residual = refit.linear_rms(forces_of([concealed._replace(scale=scale)], base, stimuli))
        if not np.isfinite(residual):
            scale *= 0.3
            continue
        factor = float(np.clip(size / max(residual, 1e-9), 0.05, 20.0))
        scale = min(scale * factor, most)
        if abs(factor - 1.0) < 0.2:
            break
    return scale


def size_class(achieved: float) -> float:
    """The class of `SIZES` that a size belongs to: the highest that it reaches, 0 below all."""
    return max((size for size in SIZES if achieved >= _BELOW * size), default=0.0)


def cells(study: Sequence[Planned], residual: Sequence[Array], beside: Sequence[Array]) -> list[dict[str, Any]]:
    """RMS residual in every phase of every trial, F0: of a refit, and of one with nuisance parameters as well."""
    out: list[dict[str, Any]] = []
    for i, trial in enumerate(study):
        for phase in trial.phases:
            first, last = (round(t * 1e3) for t in (phase.start_s, phase.end_s))
            sizes = [float(np.sqrt(np.mean(part[i][first : last + 1] ** 2))) for part in (residual, beside)]
            row = {"trial": trial_name(i), "phase": phase.name}
            out.append({**row, "rms_f0": sizes[0], "beside_nuisances_f0": sizes[1]})
    return out
