"""What is done to recordings before they are diagnosed, and what their forces at rest tell of the parallel spring."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.optimize import least_squares

from xb_muscle_ros.trials.trial import Trial

Array = npt.NDArray[np.float64]


def chosen(trials: Sequence[Trial], patterns: Sequence[str]) -> list[Trial]:
    """Trials whose whole name matches one of some regular expressions, in the order of the expressions."""
    return [t for p in patterns for t in trials if re.fullmatch(p, t.facts.trial)]


def straight_length(trial: Trial) -> Trial:
    """Length along straight lines between the ends of its phases, each pause at its mean.

    A muscle of 30 F0/L0 makes 3 % F0 of a wobble of 0.1 % L0 in a length record; its recorded force shows none.
    """
    phases = trial.facts.phases
    if not phases:
        return trial
    pauses = [p for p in phases if p.name in ("isometric", "hold", "recovery")]
    times, lengths = [], []
    for p in pauses:
        inside = (trial.time_s >= p.start_s) & (trial.time_s <= p.end_s)
        level = float(np.mean(trial.length_m[inside]))
        times += [p.start_s, p.end_s]
        lengths += [level, level]
    return replace(trial, length_m=np.interp(trial.time_s, times, lengths))


def told_calcium(trial: Trial, rise_s: float, fall_s: float) -> Trial:
    """Without force while calcium comes and goes, for some time after each change: its time course is assumed.

    What follows stays: force that has settled, and the passive force of a muscle that has relaxed.
    """
    steps = np.diff(trial.calcium_um)
    kept = np.ones(trial.force_time_s.size, dtype=np.bool_)
    for wanted, wait_s in ((steps > 0.0, rise_s), (steps < 0.0, fall_s)):
        if np.any(wanted):
            first = trial.calcium_time_s[1:][wanted][0]
            kept &= (trial.force_time_s < first) | (trial.force_time_s >= first + wait_s)
    return replace(trial, force_time_s=trial.force_time_s[kept], force_n=trial.force_n[kept])


def stimulated(trial: Trial) -> Trial:
    """A trial with straight lengths, without force in the first second of stimulation and the two after its end."""
    return told_calcium(straight_length(trial), 1.0, 2.0)


def at_rest(trials: Sequence[Trial], before_s: float) -> tuple[Array, Array]:
    """Length changes (L0) and forces (F0) of a muscle at rest: the means of each trial until some time, s."""
    length = [float(np.mean(t.length_change_l0[t.time_s < before_s])) for t in trials]
    force = [float(np.mean(t.measured_f0[t.force_time_s < before_s])) for t in trials]
    return np.array(length), np.array(force)


def soft_spring(length_l0: Array, force_f0: Array, gamma: float) -> dict[str, float]:
    """kpe, lpe0 and pe_sharpness of F = kpe gamma ln(1 + exp(K (ΔL - lpe0)))/K by least squares."""

    def fit_from(start: Array) -> Any:
        def left(z: Array) -> Array:
            sharpness = np.exp(z[2])
            force = np.exp(z[0]) * np.logaddexp(0.0, sharpness * (length_l0 - z[1])) / sharpness
            # Next to nothing, so that what the forces do not tell stays where it was.
            return np.append(force - force_f0, 1e-3 * (z - start))

        return least_squares(left, start, bounds=([-7.0, -0.5, 0.7], [5.0, 0.5, 6.0]))  # type: ignore[operator]

    starts = [np.array([0.0, at, sharpness]) for at in (0.0, 0.1) for sharpness in (2.3, 4.0)]
    best = min((fit_from(start) for start in starts), key=lambda found: found.cost)
    return {"kpe": float(np.exp(best.x[0])) / gamma, "lpe0": float(best.x[1]), "pe_sharpness": float(np.exp(best.x[2]))}
