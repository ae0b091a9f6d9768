"""Fast stretches: what forcible detachment changes, after the paper's supplementary figure S7 (0.1 to 10 L0/s)."""

from __future__ import annotations

import numpy as np

from xb_muscle_ros.bench.measure import Figure, Setting
from xb_muscle_ros.models.fibre_file import load_fibre
from xb_muscle_ros.models.muscle import Array, Muscle
from xb_muscle_ros.plotting.style import MODEL, SECOND, figure, save

SPEEDS_L0_PER_S = (0.1, 0.3, 1.0, 3.0, 10.0)
STRETCH_L0 = 0.1
MODELS = (("3state_coop", "3-state", MODEL, "-"), ("4state_coop", "4-state", SECOND, "--"))
_PCA = 4.5
_SAMPLES = 400


def stretch(muscle: Muscle, speed_l0_per_s: float) -> tuple[Array, Array]:
    """Length change (L0) and force (F0) of a stretch of 10 % L0 from isometric at pCa 4.5."""
    calcium = 10.0 ** (6.0 - _PCA)
    end = STRETCH_L0 / speed_l0_per_s
    time_s = np.linspace(0.0, end, _SAMPLES)
    corner_s, corner_l0 = np.array([0.0, end]), np.array([0.0, STRETCH_L0])
    states = muscle.follow(muscle.settle(0.0, calcium), corner_s, corner_l0, np.full(2, calcium), time_s)
    return states[:, -3], muscle.outputs_of(states)["force_f0"]


def study(setting: Setting) -> list[Figure]:
    """Draw both models at all speeds; returns their overshoot and what is left of it at the end."""
    made = []
    with figure(178.0, 65.0) as drawn:
        axes = drawn.subplots(1, len(SPEEDS_L0_PER_S), sharey=True)
        for model, label, colour, line in MODELS:
            muscle = Muscle(load_fibre(setting.fibre.name, model))
            for one, speed in zip(axes, SPEEDS_L0_PER_S, strict=True):
                length, force = stretch(muscle, speed)
                one.plot(100.0 * length, force, color=colour, linestyle=line, label=label)
                one.set_title(f"{speed:g} L$_0$/s")
                one.set_xlabel("ΔL (% L$_0$)")
                give = float(force.max() - force[-1])
                name = f"fast stretch, {model}, {speed:g} L0/s"
                made.append(Figure(f"{name}, peak force", float(force.max()), "F0", "isometric: 1 F0"))
                made.append(Figure(f"{name}, give after the peak", give, "F0", "peak less force at 10 % L0"))
        axes[0].set_ylabel("Force (F$_0$)")
        axes[0].legend(frameon=False)
        save(drawn, setting.drawing("fast_stretch"))
    return made
