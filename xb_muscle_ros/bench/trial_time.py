"""A whole trial: the paper's 2.34 s at a step of 1e-4 s, and with variable steps."""

from __future__ import annotations

import functools

import numpy as np

from xb_muscle_ros.bench.measure import Figure, timed
from xb_muscle_ros.models.muscle import Array, Muscle
from xb_muscle_ros.trials.protocol import StretchShortenStretch

_DURATION_S = 2.34
_REPEATS = 21


def figures(muscle: Muscle, pca: float = 6.1, step_s: float = 1e-4) -> list[Figure]:
    """Time of a 2.34 s trial (AMP 3.83 %, RT 1 ms) with the fixed and the variable stepper, and their force errors."""
    calcium = 10.0 ** (6.0 - pca)
    bare = StretchShortenStretch(0.0383, 0.001, lead_s=0.0, hold_s=0.0).corners()[0][-1]
    protocol = StretchShortenStretch(0.0383, 0.001, lead_s=2.0, hold_s=_DURATION_S - 2.0 - float(bare))
    corner_s, corner_l0 = protocol.corners()
    state = muscle.settle(0.0, calcium)
    time_s = np.arange(round(_DURATION_S / step_s) + 1) * step_s
    length = np.interp(time_s, corner_s, corner_l0)
    dt_s = np.diff(time_s)
    held = np.full_like(time_s, calcium)
    corner_calcium = np.full_like(corner_s, calcium)
    # Forces are compared where both have a sample; the reference lands on the corners as the variable stepper does.
    every = max(1, round(1e-3 / step_s))
    sample_s = np.minimum(time_s[::every], corner_s[-1])

    def force(states: Array) -> Array:
        return muscle.outputs_of(states)["force_f0"]

    def variable(tolerance: float) -> Array:
        return muscle.follow(state, corner_s, corner_l0, corner_calcium, sample_s, tolerance)

    exact = force(variable(1e-10))
    sampled = force(muscle.run(state, dt_s, length, held, 8)[::every])
    fixed = force(muscle.run(state, dt_s, length, held)[::every])
    seconds, spread = timed(lambda: muscle.run(state, dt_s, length, held, every=every), _REPEATS)
    name = f"2.34 s trial, {muscle.fibre.model}"
    steps = time_s.size - 1
    paper = f"paper: 400 ms; {steps} steps, states kept at 1 kHz"
    made = [
        Figure(f"{name}, step {step_s:g} s", seconds * 1e3, "ms", spread * 1e3, paper),
        Figure(
            f"{name}, step {step_s:g} s, force error", 100.0 * float(np.max(np.abs(fixed - sampled))), "% F0", None,
            "against 8 times smaller steps on the same samples; paper: < 0.01 % F0",
        ),
    ]  # fmt: skip
    for tolerance in (1e-4, 1e-6):
        seconds, spread = timed(functools.partial(variable, tolerance), _REPEATS)
        error = np.max(np.abs(force(variable(tolerance)) - exact))
        what = f"force error {100.0 * error:.2g} % F0 against tolerance 1e-10"
        made.append(Figure(f"{name}, variable steps, tolerance {tolerance:g}", seconds * 1e3, "ms", spread * 1e3, what))
    return made
