"""Small studies that the models themselves make: short trials with noise, ordinary errors and what is concealed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from xb_muscle_ros.diagnose.intake import FibreStudy
from xb_muscle_ros.fit.data import FitTrial, fit_trials
from xb_muscle_ros.models.fibre_file import Fibre, changed, load_fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.simulation.made import made
from xb_muscle_ros.trials.protocol import StretchShortenStretch
from xb_muscle_ros.trials.trial import Trial

FIBRE = "18Dec2017a"
PCAS = (4.5, 6.0, 6.2, 6.4, 9.0)
NOISE_F0 = 7e-4
# Half a second at 1 kHz.
PROTOCOL = StretchShortenStretch(0.0383, 0.05, lead_s=0.1, hold_s=0.1)


def given_fibre(model: str = "3state_coop", name: str = FIBRE) -> Fibre:
    """The fibre that a diagnosis starts from, smoothing off."""
    return changed(load_fibre(name, model), {"smoothing": 0.0}, "test")


def truth(model: str = "3state_coop", base: str = "3state_coop", **values: float) -> Fibre:
    """A fibre that differs from the file's in its parameters, and by what is concealed."""
    given = changed(load_fibre(FIBRE, model), {"smoothing": 0.0, **values}, "test")
    scaled = {n: given.values[n] * factor for n, factor in (("f", 1.2), ("k21", 0.85), ("kse", 1.15))}
    return in_its_own_f0(replace(given, values=MappingProxyType({**given.values, **scaled})))


def in_its_own_f0(fibre: Fibre) -> Fibre:
    """The fibre in units of its own isometric force at pCa 4.5, as forces are recorded."""
    for _ in range(4):
        muscle = Muscle(fibre)
        force = muscle.outputs(muscle.settle(0.0, 10.0**1.5)).force_f0
        fibre = changed(fibre, {"Fscale": fibre.values["Fscale"] / force}, "test")
    return fibre


def trials_of(
    fibre: Fibre,
    pcas: Sequence[float] = PCAS,
    seed: int = 3,
    protocol: StretchShortenStretch = PROTOCOL,
    noise_f0: float = NOISE_F0,
    shifts: Mapping[float, float] = MappingProxyType({}),
    ordinary: bool = True,
) -> list[Trial]:
    """Recordings of a fibre.

    Args:
        fibre: the truth.
        pcas: of the trials, one each.
        seed: of noise and errors.
        protocol: of all trials.
        noise_f0: standard deviation, F0.
        shifts: error of a solution's pCa by stated pCa; the others have an ordinary one.
        ordinary: whether there are ordinary errors: of pCa, of force zero, of the moment and of L0.
    """
    random, muscle = np.random.default_rng(seed), Muscle(fibre)
    size = float(ordinary)
    common = {"time_shift": size * random.normal(0.0, 5e-4), "length_gain": size * random.normal(0.0, 0.01)}
    found = []
    for pca in pcas:
        own = {"pca_shift": size * random.normal(0.0, 0.04), "force_offset": size * random.normal(0.0, 0.004)}
        own["pca_shift"] = shifts.get(pca, own["pca_shift"])
        found.append(made(muscle, protocol.trial(fibre.name, pca), random, noise_f0, **common, **own))
    return found


def study_of(given: Fibre, trials: Sequence[Trial]) -> FibreStudy:
    """A study as it is read."""
    return FibreStudy(given, tuple(trials), ())


def fitted_trials(trials: Sequence[Trial]) -> tuple[FitTrial, ...]:
    """Trials as a fit sees them, whole."""
    return fit_trials(trials, [False] * len(trials), whole=True)
