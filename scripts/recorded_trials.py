"""What is done to recordings before they are diagnosed, and what their forces at rest tell of the parallel spring."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.optimize import least_squares

from xb_muscle_ros.trials.trial import Phase, Trial

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


def until(trial: Trial, end_s: float) -> Trial:
    """The part of a trial up to a time, s."""
    kept, force = trial.time_s <= end_s, trial.force_time_s <= end_s
    phases = tuple(
        Phase(p.name, p.start_s, min(p.end_s, end_s)) for p in trial.facts.phases if p.start_s < end_s
    )  # fmt: skip
    return replace(
        trial,
        facts=replace(trial.facts, phases=phases),
        time_s=trial.time_s[kept],
        length_m=trial.length_m[kept],
        force_time_s=trial.force_time_s[force],
        force_n=trial.force_n[force],
    )


def _first(trial: Trial, chosen: npt.NDArray[np.bool_]) -> float:
    """When one of some steps of calcium comes first, s; infinity where none does."""
    at = np.flatnonzero(chosen)
    return float(trial.calcium_time_s[at[0] + 1]) if at.size else np.inf


def stimulated(trial: Trial) -> Trial:
    """A trial with straight lengths, without force in the first second of stimulation and without what follows it.

    How fast calcium comes and goes is assumed, not known.
    """
    steps = np.diff(trial.calcium_um)
    begin, end = _first(trial, steps > 0.0), _first(trial, steps < 0.0)
    kept = (trial.force_time_s < begin) | (trial.force_time_s >= begin + 1.0)
    told = replace(trial, force_time_s=trial.force_time_s[kept], force_n=trial.force_n[kept])
    return until(straight_length(told), end)


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

        return least_squares(left, start, bounds=([-7.0, -0.5, 0.7], [5.0, 0.5, 6.0]))

    starts = [np.array([0.0, at, sharpness]) for at in (0.0, 0.1) for sharpness in (2.3, 4.0)]
    best = min((fit_from(start) for start in starts), key=lambda found: found.cost)
    return {"kpe": float(np.exp(best.x[0])) / gamma, "lpe0": float(best.x[1]), "pe_sharpness": float(np.exp(best.x[2]))}
