"""A whole trial: the paper's 2.34 s at a step of 1e-4 s, and with variable steps."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np

from xb_muscle_ros.bench.measure import Figure, Setting, smooth_and_exact, timed
from xb_muscle_ros.bench.papers_trial import STEP_S, PapersTrial
from xb_muscle_ros.models.muscle import Muscle

_REPEATS = 21


def study(setting: Setting) -> list[Figure]:
    """Of a fibre's model, smooth and exact."""
    smooth, exact = smooth_and_exact(setting.fibre)
    return [*figures(smooth), *(replace(figure, name=f"{figure.name}, exact") for figure in figures(exact))]


def figures(muscle: Muscle) -> list[Figure]:
    """Time with the fixed and the variable stepper, and their force errors."""
    trial = PapersTrial(muscle)
    name = f"2.34 s trial, {muscle.fibre.model}"
    fixed = f"{name}, step {STEP_S:g} s"
    finer = trial.force_f0(trial.fixed(8))
    error = 100.0 * float(np.max(np.abs(trial.force_f0(trial.fixed()) - finer)))
    against = "against 8 times smaller steps on the same samples; paper: < 0.01 % F0"
    made = [
        timed(fixed, trial.fixed, _REPEATS, "ms", f"paper: 400 ms; {trial.steps} steps, states kept at 1 kHz"),
        Figure(f"{fixed}, force error", error, "% F0", against),
    ]
    exact = trial.force_f0(trial.variable(1e-10))
    for tolerance in (1e-4, 1e-6):
        work = functools.partial(trial.variable, tolerance)
        error = 100.0 * float(np.max(np.abs(trial.force_f0(work()) - exact)))
        what = f"force error {error:.2g} % F0 against tolerance 1e-10"
        made.append(timed(f"{name}, variable steps, tolerance {tolerance:g}", work, _REPEATS, "ms", what))
    return made
