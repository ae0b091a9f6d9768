"""A study made by the model, and signals that may explain what the base model leaves of it."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.optimize import nnls
from scipy.signal import lfilter

from xb_muscle_ros.models.fibre_file import changed, load_fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.replay.made import coloured_noise
from xb_muscle_ros.replay.offline import simulate_trial
from xb_muscle_ros.trials.protocol import StretchShortenStretch
from xb_muscle_ros.trials.trial import Trial

Array = Any
Signals = dict[str, list[Array]]

TAUS_S = tuple(float(t) for t in np.geomspace(0.002, 2.0, 10))


class Study:
    """A study made by the model: what was measured, what the base model says, and signals that may explain the rest."""

    def __init__(self, pcas: tuple[float, ...], effect: str, seed: int = 0) -> None:
        """Simulate; an effect is drag, gain, other (unknown to the candidates) or nothing."""
        random = np.random.default_rng(seed)
        fibre = changed(load_fibre("18Dec2017a"), {"smoothing": 0.0}, "test")
        muscle, other = Muscle(fibre), Muscle(changed(fibre, {"f": 95.0, "k21": 19.0}, "test"))
        protocols = [StretchShortenStretch(0.0383, 0.3, lead_s=0.15, hold_s=0.25), StretchShortenStretch(0.0, 0.3)]
        cases = [protocols[1] if i == len(pcas) - 2 and len(pcas) > 4 else protocols[0] for i in range(len(pcas))]
        self.trials = [case.trial("18Dec2017a", pca) for case, pca in zip(cases, pcas, strict=True)]
        memo: dict[tuple[str, int], Array] = {}

        def force(of: Muscle, trial: Trial, gain: float = 0.0) -> Array:
            key = (f"{trial.facts.trial} {gain}", id(of))
            if key not in memo:
                given = trial.__class__(**{**vars(trial), "length_m": 1.0 + (1.0 + gain) * trial.length_change_l0})
                memo[key] = simulate_trial(of, given).force_n / trial.facts.f0_n
            return memo[key]

        self.before = [force(muscle, trial) for trial in self.trials]
        self.start = [force(other, trial) for trial in self.trials]
        speed = [np.gradient(trial.length_change_l0, trial.time_s) for trial in self.trials]
        self.signals: Signals = {
            "viscous_drag": speed,
            "passive_viscoelasticity": [remembered(v, 0.008) for v in speed],
            "static_calcium_stiffness": [
                b[0] * t.length_change_l0 for b, t in zip(self.before, self.trials, strict=True)
            ],
            "length_gain": [(force(muscle, t, 0.01) - force(muscle, t)) / 0.01 for t in self.trials],
            "force_offset": [np.ones_like(v) for v in speed],
        }
        self.memories = [np.column_stack([remembered(v, tau) for tau in TAUS_S]) for v in speed]
        wave = [np.sin(2.0 * np.pi * 9.0 * t.time_s) * t.length_change_l0 for t in self.trials]
        added = {
            "drag": [0.012 * v for v in speed],
            "gain": [0.06 * s for s in self.signals["length_gain"]],
            "other": [0.6 * w for w in wave],
            "nothing": [0.0 * v for v in speed],
        }[effect]
        noise = [coloured_noise(random, v.size) for v in speed]
        self.measured = [b + a + n for b, a, n in zip(self.before, added, noise, strict=True)]
        self.left = [m - b for m, b in zip(self.measured, self.before, strict=True)]

    def explained(self, name: str) -> tuple[float, list[Array], list[Array]]:
        """Least squares of a signal: value, what it explains in each trial, and the same with that trial left out."""
        signal = self.signals[name]
        products = np.array([float(s @ r) for s, r in zip(signal, self.left, strict=True)])
        squares = np.array([float(s @ s) for s in signal])
        value = products.sum() / squares.sum()
        others = (products.sum() - products) / np.maximum(squares.sum() - squares, 1e-12)
        return value, [value * s for s in signal], [o * s for o, s in zip(others, signal, strict=True)]

    def flexible(self) -> float:
        """RMSD on trials left out of a ridge over many memories of the velocity."""
        errors = []
        for i in range(len(self.left)):
            rest = [j for j in range(len(self.left)) if j != i] or [i]
            a, y = np.vstack([self.memories[j] for j in rest]), np.concatenate([self.left[j] for j in rest])
            weights = np.linalg.solve(a.T @ a + 1e-3 * np.eye(a.shape[1]), a.T @ y)
            errors.append(rms(self.left[i] - self.memories[i] @ weights))
        return rms(np.array(errors))

    def kernel(self) -> dict[str, Any]:
        """Non-negative weights of memories of the velocity."""
        a, y = np.vstack(self.memories), np.concatenate(self.left)
        weights, rest = nnls(a, y)
        return {
            "time_constant_s": float(np.exp(np.average(np.log(TAUS_S), weights=weights + 1e-12))),
            "scales_with": "constant",
            "gain": float(weights.sum()),
            "explained": 1.0 - float(rest**2) / float(y @ y),
            "tau_s": list(TAUS_S),
            "weight_f0": weights.tolist(),
        }


def remembered(speed: Array, tau_s: float) -> Array:
    """Speed through an exponential memory, in L0."""
    decay = np.exp(-1e-3 / tau_s)
    return lfilter([1e-3], [1.0, -decay], speed)


def rms(values: Array) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
