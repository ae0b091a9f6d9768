"""The page of a diagnosis: for every verdict, with gaps, with names that try to break it, for one trial and for sixty."""

from __future__ import annotations

import base64
import json
import re
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from scipy.optimize import nnls
from scipy.signal import lfilter

from xb_muscle_ros.diagnose.names import FAMILY, Name, Verdict
from xb_muscle_ros.diagnose.report import write_report
from xb_muscle_ros.diagnose.summary import summary_text
from xb_muscle_ros.diagnose.words import is_fault
from xb_muscle_ros.errors import UserError
from xb_muscle_ros.models.fibre_file import changed, load_fibre
from xb_muscle_ros.models.muscle import Muscle
from xb_muscle_ros.replay.made import NOISE_SD_F0, coloured_noise
from xb_muscle_ros.replay.offline import simulate_trial
from xb_muscle_ros.trials.protocol import StretchShortenStretch
from xb_muscle_ros.trials.trial import Trial

Array = Any
Signals = dict[str, list[Array]]
Writer = Callable[..., Path]

PCAS = (9.0, 6.6, 6.4, 6.2, 6.1, 6.0, 4.5)
TAUS_S = tuple(float(t) for t in np.geomspace(0.002, 2.0, 10))
ANSWERS: dict[str, tuple[str, ...]] = {
    "physics": ("viscous_drag",),
    "ambiguous": ("viscous_drag", "passive_viscoelasticity"),
    "measurement": ("length_gain",),
}
# Fewer independent observations than samples: noise remembers about 20 samples.
MEMORY = 20.0


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
            "static_calcium_stiffness": [b[0] * t.length_change_l0 for b, t in zip(self.before, self.trials, strict=True)],
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


def table_of(study: Study, left: list[Array]) -> dict[str, Any]:
    """Map of what is left over trials and phases; a cell counts where it is beyond three times its error."""
    names = list(dict.fromkeys(p.name for t in study.trials for p in t.facts.phases))
    cells: dict[str, list[list[float | None]]] = {"rms_f0": [], "mean_f0": [], "p_value": []}
    for trial, rest in zip(study.trials, left, strict=True):
        phases = trial.phases_by_name()
        for rows in cells.values():
            rows.append([None] * len(names))
        for j, name in enumerate(names):
            if name not in phases:
                continue
            part = rest[(trial.time_s >= phases[name].start_s) & (trial.time_s < phases[name].end_s)]
            cells["rms_f0"][-1][j], cells["mean_f0"][-1][j] = rms(part), float(part.mean())
            beyond = rms(part) ** 2 - NOISE_SD_F0**2 > 3.0 * NOISE_SD_F0**2 * np.sqrt(2.0 * MEMORY / part.size)
            cells["p_value"][-1][j] = 0.002 if beyond else 0.4
    return {"trials": [t.facts.trial for t in study.trials], "phases": names, **cells}


def candidate_rows(study: Study) -> list[dict[str, Any]]:
    """Every signal, best first, the base among them, and some that were screened."""
    scale = 2.0 * MEMORY * NOISE_SD_F0**2
    base = np.array([float(r @ r) for r in study.left])
    rows: list[dict[str, Any]] = [{
        "name": "base", "kind": "base", "family": None, "parameters": {}, "interval": {}, "delta_elpd": 0.0, "se": 0.0,
        "train_rmsd_f0": rms(np.concatenate(study.left)), "heldout_rmsd_f0": rms(np.concatenate(study.left)), "note": "",
    }]  # fmt: skip
    for name, signal in study.signals.items():
        value, inside, outside = study.explained(name)
        error = NOISE_SD_F0 * np.sqrt(MEMORY / sum(float(s @ s) for s in signal))
        gains = (base - [float(np.sum((r - o) ** 2)) for r, o in zip(study.left, outside, strict=True)]) / scale
        key = {"viscous_drag": "drag", "passive_viscoelasticity": "kpe", "static_calcium_stiffness": "kca"}.get(name, name)
        rows.append({
            "name": name, "kind": "measurement" if is_fault(name) else "mechanism", "family": FAMILY[Name(name)],
            "parameters": {key: value}, "interval": {key: [value - 1.96 * error, value + 1.96 * error]},
            "train_rmsd_f0": rms(np.concatenate([r - i for r, i in zip(study.left, inside, strict=True)])),
            "heldout_rmsd_f0": rms(np.concatenate([r - o for r, o in zip(study.left, outside, strict=True)])),
            "delta_elpd": float(gains.sum()), "se": float(np.sqrt(gains.size) * gains.std()), "note": "",
        })  # fmt: skip
    rows.sort(key=lambda row: -row["delta_elpd"])
    for name in ("phosphate", "temperature", "half_sarcomere_spread", "series_compliance", "lattice_spacing"):
        rows.append({
            "name": name, "kind": "mechanism", "family": FAMILY[Name(name)], "parameters": {}, "interval": {},
            "train_rmsd_f0": None, "heldout_rmsd_f0": None, "delta_elpd": None, "se": None,
            "note": "screened: explains 3 % of what is left",
        })  # fmt: skip
    return rows


def diagnosis_of(study: Study, verdict: str) -> dict[str, Any]:
    """What the tool would write of a study, every number computed from its traces."""
    answer = ANSWERS.get(verdict, ())
    rows = candidate_rows(study)
    _, inside, outside = study.explained(answer[0]) if answer else (0.0, [0.0] * len(study.left), [0.0] * len(study.left))
    after = [r - i for r, i in zip(study.left, inside, strict=True)]
    heldout = [r - o for r, o in zip(study.left, outside, strict=True)]
    shown = table_of(study, study.left)
    found = []
    for trial, rest in zip(study.trials, study.left, strict=True):
        i = shown["trials"].index(trial.facts.trial)
        for phase in trial.facts.phases:
            j = shown["phases"].index(phase.name)
            if shown["p_value"][i][j] < 0.05:
                mean = shown["mean_f0"][i][j]
                found.append({
                    "trial": trial.facts.trial, "phase": phase.name, "start_s": phase.start_s, "end_s": phase.end_s,
                    "size_f0": shown["rms_f0"][i][j], "mean_f0": mean, "sign": 1 if mean > 0 else -1, "p_value": 0.002,
                })  # fmt: skip
    found.sort(key=lambda row: -row["size_f0"])
    best = next((row for row in rows if answer and row["name"] == answer[0]), None)
    profile = None
    if best is not None:
        ((key, value),) = best["parameters"].items()
        low, high = best["interval"][key]
        sd = (high - low) / 3.92
        points = [[value + k * sd, abs(k)] for k in np.linspace(-3, 3, 13).tolist()]
        unit = {"drag": "s"}.get(key, "1")
        profile = {"parameter": key, "unit": unit, "points": points, "interval": [low, high]}
    rivals = [ANSWERS["ambiguous"][0], ANSWERS["ambiguous"][1]]
    quiet = verdict in ("none", "parameters")
    facts: dict[str, Any] = {
        "version": 1, "fibre": "18Dec2017a", "model": "3state_coop", "method": "gaussian", "quick": False, "seed": 1,
        "seconds": 81.2, "verdict": verdict, "answer": list(answer),
        "family": best["family"] if best else None, "p_value": 0.41 if quiet else 0.003,
        "confidence": {"ambiguous": 0.55, "unexplained": 0.2, "none": 0.9}.get(verdict, 0.94),
        "trials": [
            {
                "trial": trial.facts.trial, "pca": trial.facts.pca, "noise_sd_f0": NOISE_SD_F0,
                "phases": [{"name": p.name, "start_s": p.start_s, "end_s": p.end_s} for p in trial.facts.phases],
                "before_rmsd_f0": rms(study.left[i]), "after_rmsd_f0": rms(after[i]),
                "heldout_before_f0": 1.05 * rms(study.left[i]), "heldout_after_f0": rms(heldout[i]),
            }
            for i, trial in enumerate(study.trials)
        ],
        "mismatch": found, "map": shown, "map_after": table_of(study, after),
        "kernel": None if quiet else study.kernel(),
        "nuisances": [
            {"name": "pca_shift", "group": f"pCa {t.facts.pca:g}", "value": 0.01, "sd": 0.008, "prior_sd": 0.05, "unit": "1"}
            for t in study.trials
        ],
        "base_parameters": [
            {"name": "f", "start": 95.0, "fitted": 80.2, "unit": "1/s"}, {"name": "k21", "start": 19.0, "fitted": 22.4, "unit": "1/s"},
            {"name": "kse", "start": 0.33, "fitted": 0.331, "unit": "F0/L0"},
        ],
        "candidates": rows, "profile": profile,
        "before": {"train_rmsd_f0": rms(np.concatenate(study.left)), "heldout_rmsd_f0": 1.05 * rms(np.concatenate(study.left))},
        "after": {"train_rmsd_f0": rms(np.concatenate(after)), "heldout_rmsd_f0": rms(np.concatenate(heldout)) if answer else 1.05 * rms(np.concatenate(study.left))},
        "start": {"train_rmsd_f0": rms(np.concatenate([m - s for m, s in zip(study.measured, study.start, strict=True)]))},
        "flexible_bound_rmsd_f0": study.flexible(),
        "checks": [
            {"name": "what is left is beyond chance (p < 0.01)", "passed": not quiet, "value": "0.41" if quiet else "0.003"},
            {"name": "faults of the measurement do worse by more than two standard errors", "passed": verdict == "physics", "value": "3.1"},
            {"name": "the interval of the parameter leaves out zero", "passed": bool(answer), "value": ""},
            {"name": "places located are clean afterwards", "passed": verdict == "physics", "value": "0 of 9"},
            {"name": "gains at least half of what a flexible curve does", "passed": None if quiet else bool(answer), "value": None},
        ],
        "next_experiment": None if quiet else {
            "bag": "next_experiment",
            "protocol": "Stretch by 4 % L0 at 0.05, 0.2, 1 and 2 L0/s at pCa 9 and 4.5, with a hold of 1 s.",
            "separates": rivals, "expected_difference_f0": 0.012,
        },
        "augmented_fiber": "augmented.yaml" if answer else None,
        "missing": ["a trial without any stretch, to tell drift from slow elasticity", "a second speed of stretch"],
        "warnings": ["parameter k12 ended at its upper bound"] if not quiet else [],
        "how": {
            "rmsd": "Root of the mean square of measured minus modelled force over all samples at 1 kHz, trials weighted alike.",
            "p_value": "Share of 199 simulated repeats (parametric bootstrap with refit) that leave at least as much, plus one over 200.",
            "something_else": "An entry that no number on the page links to.",
        },
    }  # fmt: skip
    facts["summary"] = summary_text(facts)
    return facts


def save(folder: Path, study: Study, facts: dict[str, Any]) -> Path:
    """Both files as the tool writes them."""
    folder.mkdir(parents=True, exist_ok=True)
    answer = facts["answer"]
    inside = study.explained(answer[0])[1] if answer and answer[0] in study.signals else [0.0] * len(study.left)
    arrays = {}
    for i, trial in enumerate(study.trials):
        arrays |= {
            f"t{i}_time_s": trial.time_s,
            f"t{i}_length_l0": trial.length_change_l0,
            f"t{i}_measured_f0": study.measured[i],
            f"t{i}_start_f0": study.start[i],
            f"t{i}_before_f0": study.before[i],
            f"t{i}_after_f0": study.before[i] + inside[i],
        }
    np.savez(folder / "traces.npz", **arrays)
    (folder / "diagnosis.json").write_text(json.dumps(facts), encoding="utf-8")
    return folder


EFFECTS = {"physics": "drag", "ambiguous": "drag", "measurement": "gain", "unexplained": "other"}
