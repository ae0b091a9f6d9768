"""Recordings and model forces made of simple signals, for records that need traces to belong to."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from scipy.signal import lfilter

from xb_muscle_ros.diagnose.component import Kind, Parameter
from xb_muscle_ros.diagnose.report.traces import TrialTraces

Array = Any
PCAS = (6.6, 6.4, 6.2, 6.1, 6.0, 5.8, 4.5)
PHASES = (
    ("isometric", 0.0, 0.2), ("conditioning_stretch", 0.2, 0.28), ("conditioning_shortening", 0.28, 0.36),
    ("recovery", 0.36, 0.66), ("test_stretch", 0.66, 0.74), ("hold", 0.74, 1.1),
)  # fmt: skip
STEP_S = 0.002
NOISE_F0 = 0.0012


class Effect(NamedTuple):
    """A component to put into made recordings.

    Attributes:
        name, kind, family, members: of the component.
        probability: stated for it.
        size: of its signal, about F0.
        parameter: that the record tells.
        direction: in words.
    """

    name: str
    kind: Kind
    family: str
    members: tuple[str, ...]
    probability: float
    size: float
    parameter: Parameter
    direction: str


DETACHMENT = Effect(
    "forcible_detachment", Kind.MECHANISM, "heads_under_strain", ("forcible_detachment",), 0.998, 0.05,
    Parameter("k", "1/s", 1040.0, (870.0, 1230.0), spread=120.0), "lowers force late in fast stretch",
)  # fmt: skip
DRAG = Effect(
    "viscous_drag", Kind.MECHANISM, "parallel_viscoelasticity", ("viscous_drag",), 0.93, 0.02,
    Parameter("drag", "F0·s/L0", 0.0284, (0.019, 0.0371), spread=0.009),
    "raises force in stretch, lowers it in shortening",
)  # fmt: skip
SPRINGS = Effect(
    "calcium_dependent_elasticity", Kind.MECHANISM, "calcium_dependent_elasticity",
    ("active_titin", "static_calcium_stiffness"), 0.71, 0.012,
    Parameter("titin_stiffness", "F0/L0", 1.31, (0.42, 2.2)), "raises force while the fibre is longer",
)  # fmt: skip
DRIFT = Effect(
    "force_drift", Kind.ARTEFACT, "force_zero", ("force_drift",), 0.87, 0.015,
    Parameter("force_drift [pCa 6.2]", "F0/s", 0.0143, (0.0094, 0.0192)), "force creeps up during a trial",
)  # fmt: skip


def remembered(speed: Array, tau_s: float) -> Array:
    """Speed through an exponential memory, L0."""
    return lfilter([STEP_S], [1.0, -math.exp(-STEP_S / tau_s)], speed)


def rms(values: Array) -> float:
    return float(np.sqrt(np.mean(np.square(values)))) if np.size(values) else math.nan


def protocol() -> tuple[Array, Array]:
    """Time in s and length change in L0."""
    time_s = np.arange(0.0, PHASES[-1][2], STEP_S)
    return time_s, np.interp(time_s, [0.2, 0.28, 0.36, 0.66, 0.74], [0.0, 0.038, 0.0, 0.0, 0.038])


def signals(pca: float, effects: tuple[Effect, ...]) -> tuple[Array, dict[str, Array]]:
    """Force of the base model, and of each effect, F0."""
    time_s, length = protocol()
    speed = np.gradient(length, time_s)
    level = 1.0 / (1.0 + 10.0 ** (2.5 * (pca - 6.1)))
    base = level * (1.0 + 13.0 * remembered(speed, 0.03) + 4.0 * remembered(speed, 0.25)) + 1.5 * length
    late = np.clip(remembered(np.clip(speed, 0.0, None), 0.05) - 0.012, 0.0, None)
    shapes = {
        "forcible_detachment": -level * late / 0.012,
        "viscous_drag": speed / 0.5,
        "calcium_dependent_elasticity": level * length / 0.038,
        "force_drift": time_s * (1.0 if pca == 6.2 else 0.1),
    }
    return base, {e.name: e.size * shapes[e.name] for e in effects}


def made(fibres: tuple[str, ...], effects: tuple[Effect, ...], unknown_f0: float, seed: int = 1) -> list[TrialTraces]:
    """Traces: the base takes a part of every effect for its own, held-out predictions are a little worse."""
    random = np.random.default_rng(seed)
    out = []
    for k, fibre in enumerate(fibres):
        for pca in PCAS:
            time_s, length = protocol()
            force, added = signals(pca, effects)
            scale = 1.0 + 0.1 * math.sin(3.0 * k)
            total = scale * sum(added.values(), np.zeros_like(force))
            rest = unknown_f0 * np.sin(2.0 * np.pi * 6.0 * time_s) * np.exp(-np.abs(time_s - 0.7) / 0.1)
            noise = lfilter([0.2], [1.0, -0.95], random.normal(0.0, 1.0, time_s.size))
            measured = force + total + rest + NOISE_F0 * noise / rms(noise)
            before, after = force + 0.3 * total, force + 0.94 * total
            level = 0.02 * (1.0 + random.normal(0.0, 0.5)) * force
            fits = (before, after) if effects else (before, before)
            unseen = (
                (before + 0.5 * level - 0.1 * total, after + 0.25 * level) if effects else (before + 0.5 * level,) * 2
            )
            out.append(
                TrialTraces(
                    fibre, f"{fibre}_pca{10 * pca:.0f}", time_s, length, measured, 0.93 * force, *fits, *unseen,
                    {e.name: after - 0.94 * scale * added[e.name] for e in effects},
                )
            )  # fmt: skip
    return out
