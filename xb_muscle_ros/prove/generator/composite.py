"""A composite: a fibre that lacks several things at once, recorded with ordinary measurement artefacts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from xb_muscle_ros.diagnose.names import FAMILY
from xb_muscle_ros.prove.generator.artefacts import Artefacts, draw_ordinary, with_artefacts
from xb_muscle_ros.prove.generator.case import Case, Drawn, drawn_until, forces_of, noises, planned, rms, usable
from xb_muscle_ros.prove.generator.composite_sizes import LEAST_F0, MOST_F0, Sized
from xb_muscle_ros.prove.generator.effects import OUTSIDE
from xb_muscle_ros.prove.generator.mix import ARTEFACT, Spec

# Draws of a fibre in which every effect has to be of the size that is meant.
_STRICT = 4
# What an artefact is to leave: force (F0), or an ordinary artefact that goes so many of its SDs.
_ARTEFACT_F0, _ARTEFACT_SD = 0.0015, 2.5


@dataclass(frozen=True)
class Composite(Case):
    """A finished composite; `before` is without measurement artefacts.

    Attributes:
        sizes: unique contribution of each effect, F0.
        artefact_residual: RMS residual of artefacts beyond the ordinary, F0, and the largest prior residual of an
            ordinary one that they cause, in its SDs; None where there are none.
    """

    sizes: list[float]
    ordinary: Artefacts
    artefact_residual: tuple[float, float] | None

    def facts(self) -> dict[str, Any]:
        """What the key says of composites alone."""
        effects = [
            {
                **c._asdict(), "family": None if c.label in OUTSIDE else FAMILY[c.label], "asked_f0": asked,
                "unique_contribution_f0": size,
            }
            for c, asked, size in zip(self.concealed, self.spec.sizes, self.sizes, strict=True)
        ]  # fmt: skip
        residual_f0, prior_residual_sd = self.artefact_residual or (None, None)
        return {
            "trials": self.spec.trials,
            "effects": effects,
            "artefacts": list(self.spec.artefacts),
            "artefact_residual_f0": residual_f0,
            "artefact_prior_residual_sd": prior_residual_sd,
            "ordinary_artefact_sizes": self.ordinary.as_json(),
        }


def make_composite(spec: Spec, seed: int, number: int) -> Composite:
    """See `case.drawn_until`; in the first draws effects are of the sizes meant."""
    return drawn_until(lambda found, random, k: _attempt(spec, found, random, k < _STRICT), spec, seed, number)


def _attempt(spec: Spec, found: Drawn, random: np.random.Generator, strict: bool) -> Composite | None:
    """A case of one draw; None where it is not usable, or where `strict` and of another size than meant."""
    base, concealed = found.base, found.concealed
    # Levels of calcium are chosen by what the fibre does, which its effects change; so perhaps twice.
    for _ in range(2):
        study = planned(spec, random, concealed, base)
        if study is None:
            return None
        ordinary = draw_ordinary(random, study)
        sized = Sized(base, study, ordinary)
        concealed, sizes = sized.scaled(concealed, spec.sizes, LEAST_F0 if strict else 0.0)
        forces = forces_of(concealed, base, sized.stimuli)
        if usable(study, forces):
            break
        if not concealed:
            return None
    else:
        return None
    if strict and not all(LEAST_F0 <= size <= MOST_F0 for size in sizes):
        return None
    artefacts, residual = with_artefacts(spec.artefacts, random, study, ordinary), None
    if spec.kind == ARTEFACT:
        fit = sized.of_artefacts(artefacts)
        residual = fit.rms, float(np.max(np.abs(fit.prior_residual[sized.constants :])))
        if strict and residual[0] < _ARTEFACT_F0 and residual[1] < _ARTEFACT_SD:
            return None
        # What is recorded follows from what was in the bath and at the motor, artefacts and all.
        forces = forces_of(concealed, base, artefacts.given(study))
    noise = noises(random, forces)
    return Composite(
        spec, found.fibre, found.nominal, dict(base.values), study, concealed, artefacts,
        recorded=[artefacts.recorded(f, i) + noise[i][0] for i, f in enumerate(forces)],
        noise_sd=[sd for _, sd in noise],
        before=rms([sized.difference(concealed)]),
        sizes=sizes,
        ordinary=ordinary,
        artefact_residual=residual,
    )  # fmt: skip
