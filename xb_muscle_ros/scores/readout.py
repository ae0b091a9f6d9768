"""What is read off the force of a trial, measured or simulated: one list for all commands."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from xb_muscle_ros.scores.estimate import Estimate, quotient
from xb_muscle_ros.scores.standard_error import NO_NOISE_KNOWN, ForceNoise, force_noise
from xb_muscle_ros.scores.steady import steady_part
from xb_muscle_ros.scores.stiffness import WINDOW_S, stiffness_of_phase
from xb_muscle_ros.trials.trial import Array, Phase, Trial

SRS_CONDITIONING, SRS_TEST, ISOMETRIC = "srs_conditioning", "srs_test", "isometric_f0"
Done = tuple[str, float | None, float | None, float | None]
"""Fibre, pCa, amplitude (L0) and recovery time (s) of a trial; None or NaN where not known."""
TEXT = {
    SRS_CONDITIONING: "SRS of the conditioning stretch",
    SRS_TEST: "SRS of the test stretch",
    ISOMETRIC: "isometric force",
}


def isometric_force(trial: Trial, time_s: Array, force_f0: Array, noise: ForceNoise | None = None) -> Estimate:
    """Mean force (F0) over the steady isometric part that a trial begins with: the one definition of all commands.

    Args:
        trial, time_s, force_f0: see `steady_part`.
        noise: of the force; None for simulated force.
    """
    inside, why, told = steady_part(trial, time_s, force_f0)
    if why:
        return Estimate(None, why=why)
    se = None if noise is None else noise.of_mean(time_s[inside])
    return Estimate(float(np.mean(force_f0[inside])), se, told)


def read_off(trial: Trial, time_s: Array, force_f0: Array, noise: ForceNoise | None = None) -> dict[str, Estimate]:
    """SRS (F0/L0) of both stretches and isometric force (F0) by the keys of `TEXT`.

    Args:
        trial: lengths, phases, calcium.
        time_s, force_f0: shape (n,), s and F0.
        noise: of the force; None for simulated force.
    """
    phases = trial.phases_by_name()

    def srs(phase: Phase | None) -> Estimate:
        begin_s = -np.inf if phase is None else phase.start_s
        near = slice(*np.searchsorted(time_s, [begin_s, begin_s + 2.0 * WINDOW_S]).tolist())
        length = trial.length_change_at(time_s[near])
        return stiffness_of_phase(time_s[near], length, force_f0[near], phase, noise)

    return {
        SRS_CONDITIONING: srs(phases.get("conditioning_stretch")),
        SRS_TEST: srs(phases.get("test_stretch")),
        ISOMETRIC: isometric_force(trial, time_s, force_f0, noise),
    }


def read_off_measured(trial: Trial) -> dict[str, Estimate]:
    """The same of the measured force, with standard errors as far as its quiet times tell them."""
    noise = force_noise(trial)
    found = read_off(trial, trial.force_time_s, trial.measured_f0, noise)
    if noise is not None:
        return found
    unknown = {name: "; ".join(filter(None, (each.why, NO_NOISE_KNOWN))) for name, each in found.items()}
    return {name: each if each.value is None else each._replace(why=unknown[name]) for name, each in found.items()}


def references(trials: Sequence[Done]) -> list[int | None]:
    """For each trial the place of the reference trial (amplitude 0) of its fibre and pCa.

    Of several that which is nearest in recovery time: it lay nearest in the order of the experiment.
    """
    known: dict[tuple[str, str], list[int]] = {}
    for k, (fibre, pca, amplitude_l0, _) in enumerate(trials):
        if amplitude_l0 == 0.0:
            known.setdefault((fibre, _level(pca)), []).append(k)
    recovery = [0.0 if each is None or math.isnan(each) else each for *_, each in trials]
    return [
        min(known.get((fibre, _level(pca)), []), key=lambda r: abs(recovery[r] - recovery[k]), default=None)
        for k, (fibre, pca, _, _) in enumerate(trials)
    ]


def _level(pca: float | None) -> str:
    return f"{math.nan if pca is None else pca:.6g}"


def relative_srs(test: Estimate, reference: Estimate, is_reference: bool) -> Estimate:
    """SRS of a test stretch over that of the reference trial; the reference itself has 1, without error.

    Why either SRS is missing is said of itself, and not once more here.
    """
    if is_reference and test.value:
        return Estimate(1.0)
    return quotient(test._replace(why=""), reference._replace(why=""))
