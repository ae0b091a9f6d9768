"""Input as a control loop may give it: fast ramps while calcium jumps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from xb_muscle_ros.models.fibre_file import load_fibre
from xb_muscle_ros.models.muscle import Muscle


@pytest.mark.parametrize("smoothing", [100.0, 0.0])
@pytest.mark.parametrize(
    ("fibre", "model"), [("18Dec2017a", "3state_coop"), ("18Dec2017a", "2state"), ("7Aug2018a", "3state_coop")]
)
def test_ramps_of_2_per_second_while_calcium_jumps(fibre: str, model: str, smoothing: float) -> None:
    """Regression: few heads lost their variance, and heads left sites that falling calcium had switched off."""
    loaded = load_fibre(fibre, model)
    muscle = Muscle(replace(loaded, values={**loaded.values, "smoothing": smoothing}))
    rng = np.random.default_rng(11)
    for _ in range(8):
        length, calcium = [0.0], [1.0]
        while len(length) < 2000:
            count, speed, level = rng.integers(20, 400), rng.uniform(-2.0, 2.0), 10.0 ** rng.uniform(-2.0, 1.5)
            for _ in range(count):
                length.append(float(np.clip(length[-1] + speed * 1e-3, -0.1, 0.1)))
                calcium.append(level)
        n = len(length)
        states = muscle.run(muscle.settle(0.0, 1.0), np.full(n - 1, 1e-3), np.array(length), np.array(calcium))
        out = muscle.outputs_of(states)
        # No fibre bears more than a few times its isometric force; a slack one pushes a little, since the released
        # series spring goes on below zero.
        assert out["force_ce_f0"].max() < 4.0
        assert out["force_ce_f0"].min() > -0.25
        assert out["n_on"].min() >= -1e-3
        assert out["q0"].max() <= 1.0
